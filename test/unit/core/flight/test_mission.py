"""The order of take-off, flight and landing around a pilot's flights."""

from advise_ros.core.flight.mission import GRACE_S, RETRY_S, Ask, Mission, MissionStage
from advise_ros.core.flight.vehicle_state import VehicleState

GROUND = VehicleState(ready=True, armed=False, in_air=False, commandable=False)
BOOTING = GROUND._replace(ready=False, waiting_for='EKF', text='PreArm: wait')
CLIMBING = VehicleState(ready=True, armed=True, in_air=True, commandable=False, mode='GUIDED')
FLYING = CLIMBING._replace(commandable=True)


def flown(mission: Mission, now_s: float = 0.0) -> Mission:
    """On to the present flight's end."""
    mission.advance(GROUND, now_s)
    mission.replied(True, '', now_s)
    mission.advance(FLYING, now_s)
    mission.flown(now_s)
    return mission


def test_two_flights_ask_for_what_they_need_and_nothing_twice() -> None:
    mission = Mission(2)
    for flight in (1, 2):
        assert mission.flight == flight
        assert mission.advance(BOOTING, 0.0) is None
        assert mission.advance(GROUND, 1.0) is Ask.TAKEOFF
        assert mission.advance(GROUND, 2.0) is None
        mission.replied(True, 'taking off', 2.0)
        assert mission.advance(CLIMBING, 3.0) is None
        assert mission.stage is MissionStage.TAKING_OFF
        assert mission.advance(FLYING, 4.0) is None
        assert mission.stage is MissionStage.FLYING
        mission.flown(5.0)
        assert mission.advance(FLYING, 5.0) is Ask.LAND
        mission.replied(True, 'landing', 5.0)
        assert mission.advance(CLIMBING, 6.0) is None
        mission.advance(GROUND, 7.0)
    assert mission.stage is MissionStage.DONE
    assert mission.failure == ''


def test_no_flights_are_done_at_once() -> None:
    assert Mission(0).over


def test_a_vehicle_in_the_air_already_is_flown_from_there() -> None:
    mission = Mission(1)
    assert mission.advance(FLYING, 0.0) is None
    assert mission.stage is MissionStage.FLYING


def test_when_somebody_else_handles_the_vehicle_nothing_is_asked() -> None:
    mission = Mission(2, handle_vehicle=False)
    assert mission.advance(GROUND, 0.0) is None
    assert mission.stage is MissionStage.WAITING
    mission.advance(FLYING, 1.0)
    mission.flown(2.0)
    assert mission.advance(FLYING, 3.0) is None
    mission.advance(GROUND, 4.0)
    assert (mission.stage, mission.flight) == (MissionStage.WAITING, 2)


def test_a_refusal_is_tried_again_and_then_told() -> None:
    mission = Mission(1)
    mission.advance(GROUND, 0.0)
    mission.replied(False, 'Arm: GPS', 0.0)
    assert mission.advance(GROUND, 0.5 * RETRY_S) is None
    assert mission.advance(GROUND, RETRY_S) is Ask.TAKEOFF
    mission.replied(False, 'Arm: GPS', RETRY_S)
    assert mission.advance(GROUND, 2 * RETRY_S) is Ask.TAKEOFF
    mission.replied(False, 'Arm: GPS', 2 * RETRY_S)
    assert mission.failure == 'flight 1 of 1 could not be flown: the vehicle refused 3 times to take off: Arm: GPS'


def test_a_service_that_is_not_there_is_no_refusal() -> None:
    mission = Mission(1, timeout_s=100.0)
    assert mission.advance(GROUND, 0.0) is Ask.TAKEOFF
    for second in range(1, 50):
        mission.unanswered(float(second - 1))
        assert mission.advance(GROUND, float(second)) is Ask.TAKEOFF
    assert not mission.over


def test_waiting_ends_with_what_was_missing() -> None:
    silent = Mission(1, timeout_s=10.0)
    silent.advance(None, 0.0)
    silent.advance(None, 11.0)
    assert 'no vehicle_status came within 10 s' in silent.failure
    booting = Mission(1, timeout_s=10.0)
    booting.advance(BOOTING, 0.0)
    booting.advance(BOOTING, 11.0)
    assert booting.failure.endswith('waiting for the vehicle took longer than 10 s; waiting for EKF; "PreArm: wait"')


def test_a_flight_may_take_long_but_a_landing_may_not() -> None:
    mission = Mission(1, timeout_s=10.0)
    mission.advance(FLYING, 0.0)
    mission.advance(FLYING, 1000.0)
    assert mission.stage is MissionStage.FLYING
    mission.flown(1000.0)
    mission.advance(CLIMBING, 1011.0)
    assert 'landing took longer than 10 s' in mission.failure


def test_a_mode_that_somebody_else_set_ends_the_mission_but_a_short_loss_does_not() -> None:
    mission = Mission(1)
    mission.advance(FLYING, 0.0)
    mission.advance(CLIMBING, 1.0)
    mission.advance(FLYING, 1.0 + 0.9 * GRACE_S)
    mission.advance(CLIMBING._replace(mode='RTL'), 20.0)
    assert mission.stage is MissionStage.FLYING
    mission.advance(CLIMBING._replace(mode='RTL'), 21.0 + GRACE_S)
    assert 'takes no commands any more (mode RTL)' in mission.failure


def test_a_disarmed_vehicle_ends_the_mission_at_once() -> None:
    mission = Mission(1)
    mission.advance(FLYING, 0.0)
    mission.advance(GROUND, 0.1)
    assert 'it is disarmed' in mission.failure


def test_the_first_failure_stands() -> None:
    mission = flown(Mission(2))
    mission.fail('one')
    mission.fail('two')
    mission.advance(GROUND, 1.0)
    assert mission.failure == 'flight 1 of 2 could not be flown: one'
