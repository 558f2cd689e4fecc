"""SELECTQUERY of algorithm 1 in any process: which states are asked about next."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from advise_ros.core.advice.answer_beliefs import BY_WORTH
from advise_ros.core.advice.state import AdviceState, Imitated
from advise_ros.core.demonstrations.demonstration import Counts
from advise_ros.core.irl.reward import Inferred
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.numerics import Bools, Floats, Ints
from advise_ros.core.planning.process import FiniteProcess, occupancy
from advise_ros.core.questions.acquisition import Ranking, select
from advise_ros.core.questions.clusters import finer_clusters
from advise_ros.core.questions.expected_corrections import Known, Worth, worth
from advise_ros.core.questions.uncertainty import Uncertainty, sources, uncertainty

if TYPE_CHECKING:
    from advise_ros.core.site.belief import SiteBelief
    from advise_ros.core.site.questions import SiteQuestion


# Units of what a question is worth, by the acquisition in effect; the last one is disagreement where the policy goes.
STEPS_SAVED, SHARE_OF_VISITS, DISAGREEMENT = 'steps saved', 'share of the visits', 'nat^2 a visit'


@dataclass(frozen=True, eq=False)
class Situation:
    """Where algorithm 1 stands after some answers: everything that a question is chosen by.

    Attributes:
        settings: with the acquisition that is in effect.
        counts: what was demonstrated.
        clusters: (n,) labels, -1 for states in which no action is chosen.
        advice: what was answered.
        imitated: what the program learnt from.
        inferred: the reward and the policy.
        belief: about the site, with acquisition `site`.
    """

    process: FiniteProcess
    settings: LearnSettings
    counts: Counts
    clusters: Ints
    advice: AdviceState
    imitated: Imitated
    inferred: Inferred
    belief: SiteBelief | None = None

    @cached_property
    def demonstrated(self) -> Floats:
        """(n, n_actions) smoothed action distributions of the demonstrations."""
        return self.counts.distribution(self.settings.laplace)

    @cached_property
    def uncertainty(self) -> Uncertainty:
        """Definition 3."""
        return uncertainty(self.demonstrated, self.inferred.probabilities, self.settings.w_p)

    def visits(self) -> Floats:
        """(n,) discounted visits that the policy is expected to pay."""
        return occupancy(self.process.mdp, self.inferred.probabilities, self.process.start)


class Question(NamedTuple):
    """States (m,) to ask about, ascending; `again`: because their last answer is doubtful; `of_site`: what it decides there."""

    states: Ints
    again: bool = False
    of_site: SiteQuestion | None = None


class Selection:
    """What to ask next, and what that is worth; each part is computed when it is first asked for.

    Args:
        situation: where the learner stands.
        rng: for orders that draw; None: seeded by the settings and the number of answers.
    """

    def __init__(self, situation: Situation, rng: np.random.Generator | None = None) -> None:
        self._situation = situation
        self._rng = np.random.default_rng([situation.settings.seed, len(situation.advice.active)]) if rng is None else rng

    def question(self) -> Question | None:
        """After a doubtful answer the same states again, then the best ones that are left; None without any."""
        doubtful = self._situation.advice.doubtful
        if doubtful is not None:
            return Question(np.array(doubtful.states), again=True)
        return None if self._best is None else Question(self._best, of_site=self._of_site)

    @property
    def is_enough(self) -> bool:
        """Whether, on a site, no answer is expected to save `enough` steps; elsewhere every cluster is asked about."""
        return self._situation.belief is not None and (self._best is None or self.worth < self.least)

    @property
    def least(self) -> float:
        """What a question has to be worth to be asked, in `unit`; 0: anything."""
        return 0.0 if self._situation.belief is None else self._situation.settings.enough

    @property
    def unit(self) -> str:
        """Of `worth` and `least`."""
        if self._situation.belief is not None:
            return STEPS_SAVED
        return SHARE_OF_VISITS if self._situation.settings.acquisition in BY_WORTH else DISAGREEMENT

    @cached_property
    def worth(self) -> float:
        """Of the best question, in `unit`."""
        if self._situation.belief is not None:
            return 0.0 if self._of_site is None else self._of_site.worth
        if self._situation.settings.acquisition in BY_WORTH:
            return self._corrections.most
        labels, visits = self._ranking.labels, self._ranking.occupancy
        per_cluster = float(self._ranking.doubt[self._open].max(initial=0.0))
        return per_cluster / max(float(visits[labels >= 0].sum()), np.finfo(float).tiny)

    @cached_property
    def _best(self) -> Ints | None:
        situation = self._situation
        if situation.belief is not None:
            return None if self._of_site is None else np.array(self._of_site.states)
        if situation.settings.acquisition in BY_WORTH:
            return self._corrections.best()
        chosen = select(situation.settings.acquisition, self._ranking, self._open)
        return None if chosen is None else np.flatnonzero(situation.clusters == chosen)

    @cached_property
    def _of_site(self) -> SiteQuestion | None:
        situation = self._situation
        if situation.belief is None or situation.process.grid is None:
            return None
        return _within_advise().ask(situation.process.grid, situation.belief, situation.advice, situation.settings.seed)

    @cached_property
    def _corrections(self) -> Worth:
        """Of questions about clusters, finer ones and single states."""
        situation = self._situation
        partitions = [situation.clusters, *finer_clusters(situation.process, situation.counts, situation.settings)]
        return worth(partitions, Known(
            situation.counts.taken, situation.inferred.greedy, situation.visits(), situation.advice, situation.imitated,
        ))

    @cached_property
    def _ranking(self) -> Ranking:
        situation, settings = self._situation, self._situation.settings
        return Ranking(
            situation.clusters, situation.uncertainty.state, settings.cluster_score, situation.visits,
            sources(situation.counts.taken, settings.laplace), self._rng,
        )

    @cached_property
    def _open(self) -> Bools:
        return open_clusters(self._situation.clusters, self._situation.advice.asked(len(self._situation.clusters)))


def open_clusters(labels: Ints, asked: Bools) -> Bools:
    """Clusters that were not asked about: less than half of the states are covered by earlier questions.

    So each cluster is asked once, and again only when new demonstrations have made another of it.

    Args:
        labels: (n,) cluster of each state, -1 without one.
        asked: (n,) states that the person was asked about.

    Returns:
        (clusters,) whether each is open.
    """
    members = labels >= 0
    share = np.bincount(labels[members], weights=asked[members]) / np.bincount(labels[members])
    return share < 0.5


def _within_advise() -> ModuleType:
    from advise_ros.core.site import within_advise  # noqa: PLC0415 - compiled loops take half a second to import

    return within_advise
