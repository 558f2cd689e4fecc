"""The belief about a site as part of algorithm 1."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from advise_ros.core.advice.advice import AdviceRecord, Verdict
from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.site import plan as plan_module
from advise_ros.core.site import search, tempering
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.within_advise import belief_of, imitate
from support.sites import flown_site


def test_an_answer_stands_in_each_state_for_what_is_believed_right_there_over_all_else() -> None:
    """An advised state has no other rows in the program; what they leave open may be flown."""
    site, flights = flown_site()
    layout = layout_of(site.grid)
    belief = belief_of(site.grid, count(site.grid, flights), advice_state(()), 0)
    best = plan(layout, belief.keep_out).best
    east_alone = np.flatnonzero((best == 1 << 1) & (layout.acting > 0))[:2].tolist()
    north_alone = np.flatnonzero((best == 1) & (layout.acting > 0))[:1].tolist()
    west_alone = np.flatnonzero((best == 1 << 3) & (layout.acting > 0))[:1].tolist()
    asked = tuple(sorted([*east_alone, *north_alone, *west_alone]))
    answer = AdviceRecord(1, 1, asked, (0, 1), (2,), Verdict.ANSWER)
    advice = imitate(site.grid, belief, advice_state((answer,))).advice
    rows = {record.states: (record.preferred, record.avoided) for record in advice}
    assert rows == {
        **{(state,): ((1,), (0, 2, 3)) for state in east_alone}, **{(state,): ((0,), (1, 2, 3)) for state in north_alone},
    }, 'where WEST is believed right the answer is outvoted'


@pytest.mark.parametrize('loop', [tempering._draw, search.cheapest_sets, plan_module._least, plan_module._expected_costs])
def test_others_go_on_while_compiled_loops_run(loop: Any) -> None:
    """On 20 x 20 cells the executor stood still for 1.4 s while maps were drawn in the worker's thread."""
    assert loop.targetoptions['nogil']
