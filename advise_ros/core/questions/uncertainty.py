"""UNCERTAINTY of algorithm 1 (section 3.3), and what the demonstrations' share of it comes from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from advise_ros.core.numerics import Floats, Ints, entropy


class Uncertainty(NamedTuple):
    """Definition 3: F of the demonstrations, G of the policy, U_s = w_p F + (1 - w_p) G; each (n,) [nat]."""

    demonstrations: Floats
    policy: Floats
    state: Floats


class Sources(NamedTuple):
    """F = disagreement + scarcity, each (n,) [nat] and at least 0.

    Attributes:
        disagreement: the demonstrator contradicts himself; 0 without a visit or with one action alone, and the
            entropy of his actions after many visits.
        scarcity: few visits; the logarithm of the number of actions without a visit, 0 after many.
    """

    disagreement: Floats
    scarcity: Floats


def uncertainty(demonstrated: Floats, policy: Floats, w_p: float) -> Uncertainty:
    """Definition 3 for every state, from two (n, n_actions) distributions."""
    f, g = entropy(demonstrated), entropy(policy)
    return Uncertainty(f, g, w_p * f + (1.0 - w_p) * g)


def cluster_uncertainty(labels: Ints, state: Floats, score: str) -> Floats:
    """U_c of each cluster: the mean (definition 4) or the sum (algorithm 1) of U_s over its states.

    Args:
        labels: (n,) cluster of each state, -1 without one.
        state: (n,) U_s [nat].
        score: 'mean' or 'sum'.
    """
    members = labels >= 0
    total: Floats = np.bincount(labels[members], weights=state[members]).astype(np.float64)
    return total / np.maximum(np.bincount(labels[members]), 1) if score == 'mean' else total


def sources(taken: Ints, laplace: float) -> Sources:
    """What the paper's F, the entropy of smoothed counts, comes from.

    The smoothed distribution is the seen one with weight visits / (visits + pseudo-counts), and a fair die with the
    rest. Disagreement is the seen one's entropy with that weight; what is left of F is there for want of visits.

    Args:
        taken: (n, n_actions) counts.
        laplace: added to each.
    """
    visits = taken.sum(axis=1, keepdims=True)
    smoothed = (taken + laplace) / (visits + laplace * taken.shape[1])
    weight = visits[:, 0] / (visits[:, 0] + laplace * taken.shape[1])
    disagreement = weight * entropy(taken / np.maximum(visits, 1))
    return Sources(disagreement, np.maximum(entropy(smoothed) - disagreement, 0.0))
