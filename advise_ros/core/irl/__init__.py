"""Inverse reinforcement learning: equation (1) of the paper and the policy that follows from it."""
