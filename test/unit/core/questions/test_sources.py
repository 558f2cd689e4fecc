"""F of definition 3 taken apart: few visits are not the same as contradictions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from advise_ros.core.numerics import entropy
from advise_ros.core.questions.uncertainty import sources


@given(
    arrays(np.int64, st.tuples(st.integers(1, 6), st.integers(2, 5)), elements=st.integers(0, 50)),
    st.floats(0.01, 5.0),
)
def test_the_two_sources_are_the_papers_f(taken: np.ndarray, laplace: float) -> None:
    disagreement, scarcity = sources(taken, laplace)
    smoothed = (taken + laplace) / (taken + laplace).sum(axis=1, keepdims=True)
    assert disagreement + scarcity == pytest.approx(entropy(smoothed))
    assert (disagreement >= 0.0).all()
    assert (scarcity >= 0.0).all()


def test_without_a_visit_all_is_scarcity_and_with_one_action_nothing_is_disagreement() -> None:
    disagreement, scarcity = sources(np.array([[0, 0, 0, 0], [7, 0, 0, 0]]), 1.0)
    assert disagreement == pytest.approx([0.0, 0.0])
    assert scarcity[0] == pytest.approx(np.log(4))


def test_after_many_visits_all_is_disagreement() -> None:
    disagreement, scarcity = sources(np.array([[5000, 5000, 0, 0]]), 1.0)
    assert disagreement == pytest.approx([np.log(2)], abs=0.01)
    assert scarcity == pytest.approx([0.0], abs=0.01)


def test_more_of_the_same_moves_scarcity_into_disagreement() -> None:
    few, many = sources(np.array([[2, 2, 0, 0], [20, 20, 0, 0]]), 1.0), sources(np.array([[20, 20, 0, 0]]), 1.0)
    assert few.disagreement[0] < many.disagreement[0]
    assert few.scarcity[0] > many.scarcity[0]
