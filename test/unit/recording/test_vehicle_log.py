"""What a bridge logs of its vehicle: each change once."""

from __future__ import annotations

from advise_ros.mavlink.companion import Status
from advise_ros.ros.change_log import ChangeLog, VehicleLog
from support.log_lines import Lines

GROUND = Status(
    'px4', 'LOITER', connected=True, ready=True, armed=False, in_air=False, commandable=False, waiting_for='', text='',
)
OURS = GROUND._replace(mode='OFFBOARD', armed=True, in_air=True, commandable=True, owner='ours')
TAKEN = OURS._replace(
    mode='LAND', commandable=False, owner='others', failsafe='no GPS',
    waiting_for='mavlink_bridge/take_over: the failsafe "no GPS" has it (it is in LAND)',
)


def logged(*statuses: Status, under_way: bool = False) -> list[str]:
    """Each is looked at twenty times a second for five seconds; `under_way`: a goal, while the vehicle is not ours."""
    lines = Lines()
    log = VehicleLog(ChangeLog(lines))
    for tick in range(100 * len(statuses)):
        status = statuses[tick // 100]
        log.look(status, tick * 0.05, under_way=under_way and status.owner != 'ours')
    return lines.lines


def test_a_flight_without_trouble_warns_of_nothing() -> None:
    assert logged(GROUND, OURS, GROUND, OURS) == [
        "it is this bridge's: it took off or was taken over here", "it is disarmed, and nobody's",
        "it is this bridge's: it took off or was taken over here",
    ]


def test_a_failsafe_and_its_end_are_logged_once_each() -> None:
    assert logged(OURS, TAKEN, OURS)[1:] == [
        'WARN the autopilot is in a failsafe: no GPS',
        'WARN it is others\', and gets no commands from here: the failsafe "no GPS" has it (it is in LAND)',
        "it is this bridge's: it took off or was taken over here", 'the failsafe is over after 5.0 s',
    ]


def test_a_lost_link_says_that_it_is_lost_and_when_it_is_back() -> None:
    lost = OURS._replace(connected=False, commandable=False, waiting_for='heartbeat: the link to the autopilot is lost')
    assert logged(OURS, lost, OURS)[1:] == [
        'WARN the link to the autopilot is lost', 'the loss of the link is over after 5.0 s',
    ]


def test_a_bridge_that_waits_for_its_first_vehicle_has_lost_nothing() -> None:
    nobody = GROUND._replace(autopilot='', connected=False, waiting_for='heartbeat: no autopilot has answered')
    assert logged(nobody, GROUND) == []


def test_the_phases_of_our_own_goal_are_nobody_elses_doing() -> None:
    flying = GROUND._replace(mode='LOITER', armed=True, in_air=True, owner='others')
    phases = [flying._replace(waiting_for=phase) for phase in ('setpoint stream', 'flight mode', 'touch-down')]
    assert logged(*phases, OURS, under_way=True) == ["it is this bridge's: it took off or was taken over here"]
    assert logged(flying._replace(waiting_for='mavlink_bridge/take_over: somebody flies it'), *phases[:0]) == [
        "WARN it is others', and gets no commands from here: somebody flies it"]
