"""Laws of learning: what must hold for any demonstrations and any answers."""

from __future__ import annotations

from dataclasses import fields, replace
from random import Random

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import Learned, learn
from support.learning import BY_CLUSTERS, ROUND_TRIP, answer, flights, ready

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=8, deadline=None, derandomize=True)
N_STATES = ROUND_TRIP.n_states


@st.composite
def logs(draw: st.DrawFn) -> tuple[AdviceRecord, ...]:
    """Answers about any states, contradictions among them."""
    rng = np.random.default_rng(draw(SEEDS))
    records = []
    for number in range(1, draw(st.integers(0, 4)) + 1):
        states = np.sort(rng.choice(N_STATES, size=rng.integers(1, 12), replace=False))
        order, cut = rng.permutation(4), int(rng.integers(1, 4))
        verdict = Verdict.ANSWER if rng.random() < 0.8 else Verdict.SKIP
        preferred, avoided = (order[:cut], order[cut:]) if verdict is Verdict.ANSWER else ((), ())
        records.append(AdviceRecord(
            number, number, tuple(states.tolist()),
            tuple(sorted(int(a) for a in preferred)), tuple(sorted(int(a) for a in avoided)), verdict,
        ))
    return tuple(records)


def _bits(learned: Learned) -> dict[str, object]:
    """Every field, arrays as bytes."""
    values = {spec.name: getattr(learned, spec.name) for spec in fields(learned)}
    return {name: value.tobytes() if isinstance(value, np.ndarray) else value for name, value in values.items()}


@FEW
@given(SEEDS, logs(), st.sampled_from(['paper', 'occupancy', 'random']))
def test_what_is_learnt_is_well_formed(seed: int, log: tuple[AdviceRecord, ...], acquisition: str) -> None:
    learned = learn(ROUND_TRIP, LearnSettings(acquisition=acquisition, cluster_features=0.5), flights(seed), log)
    assert learned.probabilities.sum(axis=1) == pytest.approx(np.ones(N_STATES))
    assert learned.demonstrated.sum(axis=1) == pytest.approx(np.ones(N_STATES))
    assert np.abs(learned.reward).max() <= learned.settings.r_max + 1e-7
    assert learned.value == pytest.approx(learned.q.max(axis=1), abs=1e-7)
    lost = learned.q.max(axis=1) - learned.q[np.arange(N_STATES), learned.greedy]
    assert (lost <= 1e-6 * np.maximum(1.0, np.abs(learned.q).max(axis=1))).all()
    assert learned.query is not None
    assert len({learned.clusters[s] for s in learned.query.states}) == 1
    assert not learned.greedy.flags.writeable
    assert set(learned.contradictions) <= {entry.advice_id for entry in log}


@FEW
@given(SEEDS, logs())
def test_learning_again_gives_the_same_bits(seed: int, log: tuple[AdviceRecord, ...]) -> None:
    flown = flights(seed)
    first, second = (learn(ROUND_TRIP, BY_CLUSTERS, flown, log) for _ in range(2))
    assert _bits(first) == _bits(second)


@FEW
@given(SEEDS, logs(), st.randoms(use_true_random=False))
def test_the_order_of_demonstrations_and_answers_does_not_matter(
    seed: int, log: tuple[AdviceRecord, ...], random: Random,
) -> None:
    flown = flights(seed)
    shuffled, told = list(flown), list(log)
    random.shuffle(shuffled)
    random.shuffle(told)
    first = learn(ROUND_TRIP, BY_CLUSTERS, flown, log)
    second = learn(ROUND_TRIP, BY_CLUSTERS, tuple(shuffled), tuple(told))
    assert _bits(first) == _bits(second)


@FEW
@given(SEEDS, st.data())
def test_what_is_taken_back_was_never_told(seed: int, data: st.DataObject) -> None:
    told, silent = ready(seed % 1000), ready(seed % 1000)
    for _ in range(data.draw(st.integers(0, 2))):
        for session in (told, silent):
            session.submit(answer(session))
            session.learn()
    assert told.query is not None
    one_state = len(told.query.states) == 1
    verdict = data.draw(st.sampled_from([verdict for verdict in Verdict if verdict is not Verdict.SPLIT or not one_state]))
    part = told.query.states[:1] if verdict is Verdict.SPLIT else ()
    told.submit(replace(answer(told, verdict=verdict), part=part))
    told.learn()
    told.undo()
    with_undo, without = told.learn(), silent.learned
    assert without is not None
    assert with_undo.digest == without.digest
    assert _decided(with_undo) == _decided(without)


def _decided(learned: Learned) -> tuple[object, ...]:
    states = learned.query.states if learned.query else None
    arrays = (learned.greedy, learned.clusters, learned.reward, learned.q)
    return *(array.tobytes() for array in arrays), states, learned.contradictions


@FEW
@given(SEEDS, logs())
def test_the_solvers_explain_the_evidence_equally_well(seed: int, log: tuple[AdviceRecord, ...]) -> None:
    flown: tuple[Demonstration, ...] = flights(seed, number=1)
    direct = learn(ROUND_TRIP, BY_CLUSTERS, flown, log)
    paper = learn(ROUND_TRIP, LearnSettings(acquisition='occupancy', solver='cvxpy'), flown, log)
    assert direct.objective == pytest.approx(paper.objective, rel=1e-6, abs=1e-6)


def test_the_digest_tells_every_cause_apart() -> None:
    flown = flights(0)
    log = (AdviceRecord(1, 1, (5, 6), (1,), (3,), Verdict.ANSWER),)
    digests = [
        learn(ROUND_TRIP, BY_CLUSTERS, flown, ()).digest,
        learn(ROUND_TRIP, BY_CLUSTERS, flown[1:], ()).digest,
        learn(ROUND_TRIP, BY_CLUSTERS, flown, log).digest,
        learn(ROUND_TRIP, LearnSettings(acquisition='occupancy', gamma=0.9), flown, ()).digest,
        learn(ROUND_TRIP, LearnSettings(acquisition='occupancy', seed=1), flown, ()).digest,
    ]
    assert len(set(digests)) == len(digests)
    assert all(len(text) == 64 for text in digests)
