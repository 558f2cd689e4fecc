"""Algorithm 1 on any finite process: the grid is one of them."""

from __future__ import annotations

import numpy as np
import pytest

from advise_ros.core.advice.state import Imitated
from advise_ros.core.demonstrations.demonstration import Counts, count
from advise_ros.core.errors import InputError
from advise_ros.core.irl.reward import infer, solver_by_name
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.algorithm import improve, margins_in_range
from advise_ros.core.learning.learner import learn
from advise_ros.core.planning.process import FiniteProcess, process_of
from advise_ros.core.questions.clusters import cluster_states
from advise_ros.core.questions.select import Selection
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.domains import find
from advise_ros.domains.drone import route
from advise_ros.experiments.sites import random_site
from support.learning import NORTH, ROUND_TRIP, SOUTH, flights, record


@pytest.mark.parametrize('acquisition', ['paper', 'occupancy', 'gain', 'belief'])
def test_a_domain_of_the_experiments_learns_and_asks_as_the_learner_that_flies(acquisition: str) -> None:
    settings, flown = LearnSettings(acquisition=acquisition), flights(0, 16)
    first = learn(ROUND_TRIP, settings, flown, ())
    assert first.query is not None
    log = (record(1, first.query.states, (NORTH,), (SOUTH,)),)
    learned = learn(ROUND_TRIP, settings, flown, log)
    process = route('trip', ROUND_TRIP, [ROUND_TRIP.start_state()]).process
    counts = count(ROUND_TRIP, flown)
    found = improve(process, settings, counts, cluster_states(process, counts, settings), log, solver_by_name('auto'))
    question = Selection(found).question()
    assert np.array_equal(found.inferred.reward, learned.reward)
    assert np.array_equal(found.clusters, learned.clusters)
    assert question is not None and learned.query is not None
    assert tuple(question.states.tolist()) == learned.query.states


def test_a_process_without_a_grid_has_no_site() -> None:
    process: FiniteProcess = find('sailing').process
    counts = Counts(np.ones((process.mdp.n_states, process.mdp.n_actions), dtype=np.int64))
    settings = LearnSettings(acquisition='site')
    with pytest.raises(InputError, match="acquisition 'site' is for routes on a grid"):
        improve(process, settings, counts, cluster_states(process, counts, settings), (), solver_by_name('auto'))


SITES = [*(('12x12-6', seed) for seed in range(4)), ('20x20-8', 1)]


@pytest.mark.parametrize(('size', 'seed'), SITES)
@pytest.mark.parametrize('doubts', [False, True])
def test_where_every_state_is_imitated_the_policy_is_the_plan(size: str, seed: int, doubts: bool) -> None:
    """Margins of 0.2 do not all fit along so long a way: equation (1) gave up a tenth of these states for the others. And of
    equally good actions the lowest index is not what any rewards of states say everywhere: it gave up a few more."""
    rng = np.random.default_rng([41000, seed])
    site = random_site(size, rng)
    layout, process = layout_of(site.grid), process_of(site.grid, 0.0, 0.95)
    weights = np.where(rng.random(layout.n_cells) < 0.3, np.round(rng.random(layout.n_cells), 2), 0.0) if doubts else 0.0
    way = plan(layout, np.maximum(site.keep_out, weights))
    favourite = np.where((layout.acting > 0) & (way.best > 0), way.greedy, -1)
    settings = margins_in_range(site.grid, LearnSettings())
    learnt = infer(process.mdp, Imitated(favourite, ()), settings, solver_by_name('auto'))
    acting = favourite >= 0
    assert np.array_equal(learnt.greedy[acting], favourite[acting])
    assert 0.0 < settings.margin_cap < LearnSettings.margin_cap
    assert margins_in_range(ROUND_TRIP, LearnSettings(margin_cap=0.001)).margin_cap == 0.001
