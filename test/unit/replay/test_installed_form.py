"""Messages of older versions, in the form that today's nodes read."""

from __future__ import annotations

from rclpy.serialization import deserialize_message

from advise_msgs.msg import VehicleStatus
from advise_ros.recording.codec import Codec
from advise_ros.recording.definitions import definition
from advise_ros.replay.score import in_installed_form
from advise_ros.ros.cdr import to_cdr

STATUS = 'advise_msgs/msg/VehicleStatus'
NEW_FIELDS = ('string owner', 'string failsafe')


def _older_codec() -> Codec:
    """Knows the status as it was before it named an owner."""
    text = definition(STATUS).text
    for field in NEW_FIELDS:
        assert field in text
        text = text.replace(field, '')
    codec = Codec()
    codec.learn(STATUS, 'ros2msg', text)
    return codec


def test_a_status_without_an_owner_is_read_as_one_of_an_unknown_owner() -> None:
    codec, now = _older_codec(), Codec()
    now.learn(STATUS, 'ros2msg', definition(STATUS).text)
    whole = VehicleStatus(autopilot='px4', mode='OFFBOARD', armed=True, waiting_for='GPS', text='ready', owner='ours')
    whole.header.frame_id, whole.header.stamp.sec = 'map', 12
    older = codec.canonical(now.decode(to_cdr(whole), STATUS), STATUS)
    read = deserialize_message(in_installed_form(older, STATUS, VehicleStatus, codec), VehicleStatus)
    assert (read.autopilot, read.mode, read.armed, read.waiting_for, read.text) == ('px4', 'OFFBOARD', True, 'GPS', 'ready')
    assert (read.header.frame_id, read.header.stamp.sec) == ('map', 12)
    assert (read.owner, read.failsafe) == ('', '')


def test_a_status_of_today_stays_as_it_is() -> None:
    codec = Codec()
    codec.learn(STATUS, 'ros2msg', definition(STATUS).text)
    whole = VehicleStatus(mode='RTL', owner='others', failsafe='GCS failsafe')
    assert deserialize_message(in_installed_form(to_cdr(whole), STATUS, VehicleStatus, codec), VehicleStatus) == whole
