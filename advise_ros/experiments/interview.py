"""One trial of a way to ask: performance and doubt after each of ten questions."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from advise_ros.core.irl.program import Solution
from advise_ros.experiments import ends
from advise_ros.experiments.method import Protocol, Variant
from advise_ros.experiments.trial import DECIMALS, Dialogue, Shown, show

BUDGET = 10
# Not algorithm 1 but `ends`.
ENDS = Variant('ends')


class Interview(NamedTuple):
    """What came of a trial.

    Attributes:
        performance: after 0, 1, ... questions.
        doubt: what the best open question was worth then, as `LearnerStatus.doubt_left`.
    """

    performance: tuple[float, ...]
    doubt: tuple[float, ...]


def interviews(protocol: Protocol, variants: tuple[Variant, ...], seed: int) -> list[Interview]:
    """Each variant on the same demonstrations."""
    shown = show(protocol, seed)
    first = shown.first()
    return [
        _whole(*ends.interview(shown, BUDGET)) if variant == ENDS else _interview(shown, variant, first) for variant in variants
    ]


def _whole(performance: list[float], doubts: list[float]) -> Interview:
    """With nothing left to ask performance stays as it is and no doubt is left."""
    missing = BUDGET + 1 - len(performance)
    return Interview((*performance, *performance[-1:] * missing), (*doubts, *[0.0] * missing))


def _interview(shown: Shown, variant: Variant, first: Solution) -> Interview:
    """Until the budget is spent or nothing is left to ask."""
    dialogue = Dialogue(shown, variant, first)
    performance, doubts = [dialogue.performance], [round(dialogue.selection.worth, DECIMALS)]
    while len(performance) <= BUDGET and dialogue.ask():
        dialogue.learn()
        performance.append(dialogue.performance)
        doubts.append(round(dialogue.selection.worth, DECIMALS))
    return _whole(performance, doubts)


def with_errors(protocol: Protocol, rate: float) -> Protocol:
    """The protocol with an expert whose answers are wrong at this rate, 0 to 1."""
    return replace(protocol, expert=replace(protocol.expert, error_rate=rate))
