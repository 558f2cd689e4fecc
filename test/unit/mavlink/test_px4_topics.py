"""PX4's topics in the words of MAVLink, and back; what the messages look like is px4_msgs 1.17's."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from advise_ros.core.errors import InputError
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink import px4_topics
from advise_ros.mavlink.px4_topics import TopicReader
from support.paths import ROOT

# RIHS of the definitions of px4_msgs v1.17.0, by rosbags; names and order of fields and their types are in it.
HASHES = {
    'BatteryStatus': '92fd1f3af4149312736945b5a3537b61e5268fca090d27abbb3b8ba243a5df8e',
    'OffboardControlMode': 'e87463f252f320d2f197d1feadd643b8645e5ef53a2b158dccfdf11372e00f9f',
    'TrajectorySetpoint': '9a7deb0cb7db5e52b441169a284b90188c4efdf06b302d55cb1db33ca0358c1a',
    'VehicleCommand': '1f0ab537807e2e20e04826633ea2c52e5431bea8eb0187152ff23bd07f1dd30b',
    'VehicleCommandAck': '36038d69f9db90980fb8fe154f27f22dffed0c35e530b32413cf0456aa8a29e2',
    'VehicleLandDetected': 'ced22fc1699e2a3746a1fa86aa4b5463b42f5b9c97e7913063365a04d8324901',
    'VehicleLocalPosition': '690ad535169297241c696494adbd98bbdc45566645026fe7963513a29a1bf144',
    'VehicleOdometry': '4295b96ad312084aa35c84bdcec65ba2f57eb4f6a293d57d52d95acbe99ff817',
    'VehicleStatus': '828bddbb7d4c2aa6ad93757955f6893be1ec5d8f11885ec7715bcdd76b5226c9',
}
DEFINITIONS = sorted((ROOT / 'test' / 'px4_definitions' / 'msg').glob('*.msg'))
US = 1_000_000


@pytest.mark.parametrize('path', DEFINITIONS, ids=lambda path: path.stem)
def test_the_messages_of_the_tests_are_those_of_px4(path: Path) -> None:
    store, name = get_typestore(Stores.EMPTY), f'px4_msgs/msg/{path.stem}'
    store.register(get_types_from_msg(path.read_text(encoding='utf-8'), name))
    assert store.hash_rihs01(name) == f'RIHS01_{HASHES[path.stem]}'


def status(**changes: Any) -> SimpleNamespace:
    return SimpleNamespace(**{
        'system_id': 7, 'component_id': 1, 'system_type': 2, 'arming_state': 1, 'nav_state': 4, 'nav_state_user_intention': 4,
        'failsafe': False, 'pre_flight_checks_pass': True, **changes,
    })


def local(at_us: int, **changes: Any) -> SimpleNamespace:
    return SimpleNamespace(**{
        'timestamp': at_us, 'x': 1.0, 'y': 2.0, 'z': -3.0, 'vx': 0.1, 'vy': 0.2, 'vz': -0.3, 'eph': 0.5, 'epv': 0.5,
        'xy_valid': True, 'z_valid': True, 'v_xy_valid': True, 'v_z_valid': True, 'xy_global': True, 'dead_reckoning': False,
        **changes,
    })


def odometry(at_us: int, resets: int = 0, q: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> SimpleNamespace:
    return SimpleNamespace(timestamp=at_us, q=q, reset_counter=resets)


def reader(**changes: Any) -> TopicReader:
    """One that knows its vehicle."""
    made = TopicReader(20.0)
    made.vehicle_status(status(**changes), 0.0)
    return made


def by_type(messages: list[Any]) -> dict[str, Any]:
    return {message.get_type(): message for message in messages}


def test_nothing_is_passed_on_before_the_vehicle_has_a_name() -> None:
    made = TopicReader(20.0)
    made.vehicle_odometry(odometry(US), 1.0)
    assert made.vehicle_local_position(local(US), 1.0) == []
    found = by_type(made.vehicle_status(status(), 1.0))
    assert {(message.get_srcSystem(), message.get_srcComponent()) for message in found.values()} == {(7, 1)}


@pytest.mark.parametrize(('nav_state', 'mode'), [(14, 0x00060000), (4, 0x03040000), (18, 0x06040000), (5, 0x05040000)])
def test_modes_are_those_of_a_heartbeat(nav_state: int, mode: int) -> None:
    assert by_type(TopicReader(20.0).vehicle_status(status(nav_state=nav_state), 0.0))['HEARTBEAT'].custom_mode == mode


def test_two_modes_without_a_name_are_two() -> None:
    made = TopicReader(20.0)
    modes = [by_type(made.vehicle_status(status(nav_state=number), 0.0))['HEARTBEAT'].custom_mode for number in (23, 24)]
    assert len(set(modes)) == 2 and not set(modes) & set(px4_topics.CUSTOM_MODES.values())


def test_a_failsafe_shows_in_the_state_and_in_the_mode_that_was_wanted() -> None:
    found = by_type(TopicReader(20.0).vehicle_status(status(nav_state=18, nav_state_user_intention=14, failsafe=True), 0.0))
    assert found['HEARTBEAT'].system_status in mav.FAILSAFE_STATES
    assert (found['CURRENT_MODE'].custom_mode, found['CURRENT_MODE'].intended_custom_mode) == (0x06040000, 0x00060000)


def test_it_is_ready_only_while_all_that_a_flight_takes_comes() -> None:
    made = reader()
    made.vehicle_land_detected(SimpleNamespace(landed=True), 1.0)
    made.vehicle_odometry(odometry(US), 1.0)
    assert 'SYS_STATUS' not in by_type(made.vehicle_status(status(), 1.0))
    made.vehicle_local_position(local(US), 1.0)
    for passes, health in ((True, mav.HEALTH_PREARM_CHECK), (False, 0)):
        found = by_type(made.vehicle_status(status(pre_flight_checks_pass=passes), 1.0))
        assert found['SYS_STATUS'].onboard_control_sensors_health == health
    assert 'SYS_STATUS' not in by_type(made.vehicle_status(status(), 8.0))


def test_a_position_comes_with_its_attitude_at_the_rate_that_is_asked_for() -> None:
    made = reader()
    half = math.sqrt(0.5)
    passed = []
    for number in range(1, 51):
        made.vehicle_odometry(odometry(number * 20_000, q=(half, 0.0, 0.0, half)), 1.0)
        passed += [m for m in made.vehicle_local_position(local(number * 20_000), 1.0) if m.get_type() == 'LOCAL_POSITION_NED']
    assert 16 <= len(passed) <= 20
    assert (passed[0].x, passed[0].y, passed[0].z, passed[0].vz) == (1.0, 2.0, -3.0, -0.3)
    found = by_type(made.vehicle_local_position(local(2 * US), 1.0))
    assert 'ATTITUDE' not in found, 'the attitude is old'
    made.vehicle_odometry(odometry(3 * US, q=(half, 0.0, 0.0, half)), 1.0)
    found = by_type(made.vehicle_local_position(local(3 * US), 1.0))
    assert (found['ATTITUDE'].roll, found['ATTITUDE'].yaw) == pytest.approx((0.0, math.pi / 2))


@pytest.mark.parametrize('doubt', [{'xy_valid': False}, {'z_valid': False}, {'v_xy_valid': False}, {'v_z_valid': False}])
def test_what_px4_does_not_stand_by_is_no_position(doubt: dict[str, bool]) -> None:
    made = reader()
    made.vehicle_odometry(odometry(US), 1.0)
    found = by_type(made.vehicle_local_position(local(US, **doubt), 1.0))
    assert 'LOCAL_POSITION_NED' not in found
    assert found['ESTIMATOR_STATUS'].flags != by_type(made.vehicle_local_position(local(2 * US), 1.0))['ESTIMATOR_STATUS'].flags


def test_dead_reckoning_is_a_doubt_and_a_reset_is_passed_on_at_once() -> None:
    made = reader()
    made.vehicle_odometry(odometry(US), 1.0)
    flags = by_type(made.vehicle_local_position(local(US, dead_reckoning=True), 1.0))['ESTIMATOR_STATUS'].flags
    assert not flags & 0x018
    assert made.vehicle_odometry(odometry(US + 1), 1.0) == []
    assert by_type(made.vehicle_odometry(odometry(US + 2, resets=3), 1.0))['ODOMETRY'].reset_counter == 3


@pytest.mark.parametrize(('nav_state', 'landed', 'wanted'), [
    (14, True, mav.ON_GROUND), (14, False, mav.IN_AIR), (17, False, mav.TAKING_OFF), (18, False, mav.LANDING),
])
def test_landed_or_not(nav_state: int, landed: bool, wanted: int) -> None:
    made = reader(nav_state=nav_state)
    assert made.vehicle_land_detected(SimpleNamespace(landed=landed), 1.0)[0].landed_state == wanted


def test_a_battery_that_knows_nothing_says_nothing() -> None:
    made = reader()
    made.vehicle_land_detected(SimpleNamespace(landed=True), 0.0)
    made.vehicle_odometry(odometry(US), 0.0)
    made.vehicle_local_position(local(US), 0.0)
    made.battery_status(SimpleNamespace(connected=True, voltage_v=12.6, current_a=-1.0, remaining=math.nan), 0.0)
    found = by_type(made.vehicle_status(status(), 0.0))['SYS_STATUS']
    assert (found.voltage_battery, found.current_battery, found.battery_remaining) == (12600, -1, -1)


def test_setpoints_leave_out_what_their_mask_leaves_out() -> None:
    velocity = px4_topics.trajectory_setpoint(mav.velocity_setpoint((1, 1), 0, (1.0, 2.0, 3.0), 0.5))
    assert velocity['velocity'] == [2.0, 1.0, -3.0] and velocity['yawspeed'] == -0.5
    assert all(map(math.isnan, [*velocity['position'], *velocity['acceleration'], *velocity['jerk'], velocity['yaw']]))
    place = mav.place_setpoint((1, 1), 0, (None, None, 5.0), (1.0, 2.0, 0.0), 0.0)
    fields = px4_topics.trajectory_setpoint(place)
    assert fields['position'][2] == -5.0 and fields['velocity'][:2] == [2.0, 1.0]
    assert math.isnan(fields['velocity'][2]) and math.isnan(fields['yawspeed'])
    assert px4_topics.offboard_control_mode(place) == {'position': True, 'velocity': True}
    assert px4_topics.offboard_control_mode(mav.velocity_setpoint((1, 1), 0, (0.0, 0.0, 0.0), 0.0))['position'] is False


def test_a_command_names_us_and_px4s_answer_comes_back() -> None:
    fields = px4_topics.vehicle_command(mav.command((7, 1), mav.CMD_SET_MODE, 1, 6), (1, 191))
    assert (fields['command'], fields['param1'], fields['param2'], fields['param7']) == (176, 1.0, 6.0, 0.0)
    assert (fields['target_system'], fields['source_component'], fields['from_external']) == (7, 191, True)
    ack = reader().vehicle_command_ack(
        SimpleNamespace(command=176, result=1, target_system=1, target_component=191), 1.0)[0]
    assert (ack.command, ack.result, ack.target_component) == (176, mav.ACK_TEMPORARILY_REJECTED, 191)


def test_topics_have_the_version_of_their_message_as_px4_names_them() -> None:
    assert px4_topics.topic('vehicle_status', type('VehicleStatus', (), {'MESSAGE_VERSION': 4})) == 'vehicle_status_v4'
    assert px4_topics.topic('vehicle_odometry', type('VehicleOdometry', (), {'MESSAGE_VERSION': 0})) == 'vehicle_odometry'
    assert px4_topics.topic('vehicle_status', type('OfPx4Before116', (), {})) == 'vehicle_status'


@pytest.mark.parametrize(('url', 'prefix'), [
    ('px4_dds:', ''), ('px4_dds:/', ''), ('px4_dds:/px4_1', '/px4_1/'), ('px4_dds:drone1/', 'drone1/'),
])
def test_a_namespace_of_px4(url: str, prefix: str) -> None:
    assert px4_topics.prefix_of(url) == prefix


def test_what_is_no_namespace_is_refused() -> None:
    with pytest.raises(InputError, match=r"url is 'px4_dds:udp:8888'; behind px4_dds: it takes the namespace"):
        px4_topics.prefix_of('px4_dds:udp:8888')
