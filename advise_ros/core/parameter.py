"""Fields of settings that are parameters of a node: default, meaning and range stand here once."""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any


def parameter(
    default: Any,
    doc: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field that is a node's parameter.

    Args:
        default: its value unless given.
        doc: one line for --help and docs/parameters.md.
        low, high: range, both ends included; None: unbounded.
        choices: allowed texts.
    """
    return field(default=default, metadata={'doc': doc, 'low': low, 'high': high, 'choices': choices})


def same_as(owner: type[Any], name: str) -> Any:
    """A dataclass field with the default, meaning and range of the field of this name in `owner`."""
    (spec,) = (spec for spec in fields(owner) if spec.name == name)
    return field(default=spec.default, metadata=spec.metadata)
