"""The error tree: what a user can put right, and nothing else."""

from __future__ import annotations


class AdviseError(Exception):
    """Base of every error that the package raises on purpose."""


class InputError(AdviseError):
    """Something that a person gave is wrong; the message names it, its value and the remedy."""


class LogError(InputError):
    """A recording cannot be read or lacks what is needed."""
