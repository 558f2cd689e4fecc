"""Laws of what fly_check recommends: once it is written, nothing is wrong and nothing more is recommended."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from advise_ros.mavlink import preflight
from advise_ros.mavlink.findings import Level, Room
from advise_ros.mavlink.preflight import parameter_findings

METRES = st.floats(0.5, 500.0, width=32)
ROOMS = st.none() | st.builds(Room, METRES, METRES, st.floats(0.1, 10.0), st.floats(0.5, 5.0))
VALUES = st.one_of(st.sampled_from([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]), st.floats(0.0, 1000.0, width=32))


AUTOPILOTS = st.sampled_from(sorted(preflight.RULES)).flatmap(
    lambda autopilot: st.tuples(st.just(autopilot), st.fixed_dictionaries(dict.fromkeys(preflight.names(autopilot), VALUES))),
)


# A busy machine draws slowly.
@settings(suppress_health_check=[HealthCheck.too_slow])
@given(autopilot_and_values=AUTOPILOTS, room=ROOMS)
def test_what_is_recommended_is_enough_and_stays_so(
    autopilot_and_values: tuple[str, dict[str, float]], room: Room | None,
) -> None:
    autopilot, values = autopilot_and_values
    recommended = preflight.changes(parameter_findings(autopilot, values, room))
    values |= {change.name: float(np.float32(change.value)) for change in recommended}
    again = parameter_findings(autopilot, values, room)
    assert preflight.changes(again) == []
    wrong = [finding.what for finding in again if finding.level is Level.WRONG]
    assert [what for what in wrong if room is not None or 'there is no fence' not in what] == []


@given(ceiling=METRES, climb=METRES, room=ROOMS)
def test_px4_always_comes_home_below_its_ceiling(ceiling: float, climb: float, room: Room | None) -> None:
    values = {'GF_MAX_VER_DIST': ceiling, 'RTL_RETURN_ALT': climb}
    values |= {change.name: change.value for change in preflight.changes(parameter_findings('px4', values, room))}
    assert values['RTL_RETURN_ALT'] < values['GF_MAX_VER_DIST']
    assert values['GF_MAX_VER_DIST'] >= ceiling
    assert values['RTL_RETURN_ALT'] <= climb
