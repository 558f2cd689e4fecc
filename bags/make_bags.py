"""Make the recordings in this directory again from a telemetry log of several flights.

usage: ./advise python bags/make_bags.py LOG.tlog [--to DIRECTORY]

It writes arducopter_flight1.tlog, the bytes of the log from 2 s before the first take-off until the vehicle is disarmed,
and arducopter_five_flights, a bag with all positions, velocity setpoints and states of the log as the
bridge publishes them.
"""

from __future__ import annotations

import argparse
import heapq
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.serialization import serialize_message
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

from advise_msgs.msg import VehicleStatus
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.definitions import definition
from advise_ros.recording.telemetry_frames import Scan, frames_of
from advise_ros.recording.tlog import read_tlog
from advise_ros.recording.writer import BagWriter

NS = 1_000_000_000
BEFORE_NS, AFTER_NS = 2 * NS, NS
Message = tuple[int, str, Any]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('log', type=Path)
    parser.add_argument('--to', type=Path, default=Path(__file__).parent)
    options = parser.parse_args()
    recording = read_tlog(options.log)
    cut_first_flight(options.log, recording, options.to / 'arducopter_flight1.tlog')
    write_bag(recording, options.to / 'arducopter_five_flights')


def cut_first_flight(log: Path, recording: Recording, target: Path) -> None:
    """Copy the frames around the first flight, as they are."""
    up_ns = next((event.stamp_ns for event in recording.events if event.armed and event.in_air), None)
    if up_ns is None:
        raise LogError(f'{log} has no take-off')
    down_ns = next(event.stamp_ns for event in recording.events if event.stamp_ns > up_ns and not event.armed)
    window = range(up_ns - BEFORE_NS, down_ns + AFTER_NS)
    frames = frames_of(log.read_bytes(), Scan())
    target.write_bytes(b''.join(frame.data for frame in frames if frame.stamp_ns in window))


def write_bag(recording: Recording, target: Path) -> None:
    """All samples, in the order of their stamps."""
    writer = BagWriter(target)
    channels = {
        '/pose': writer.add_topic('/pose', definition('geometry_msgs/msg/PoseStamped'), [_qos(5, reliable=False)]),
        '/cmd_vel': writer.add_topic('/cmd_vel', definition('geometry_msgs/msg/TwistStamped'), [_qos(10)]),
        '/vehicle_status': writer.add_topic(
            '/vehicle_status', definition('advise_msgs/msg/VehicleStatus'), [_qos(1, latched=True)]
        ),
    }
    for stamp_ns, topic, message in heapq.merge(
        _poses(recording), _commands(recording), _states(recording), key=lambda entry: entry[0]
    ):
        writer.write(channels[topic], stamp_ns, stamp_ns, serialize_message(message))
    writer.close()


def _qos(depth: int, *, reliable: bool = True, latched: bool = False) -> Qos:
    forever = QosTime(9223372036, 854775807)
    return Qos(
        QosHistory.KEEP_LAST, depth, QosReliability.RELIABLE if reliable else QosReliability.BEST_EFFORT,
        QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        forever, forever, QosLiveliness.AUTOMATIC, forever, False,
    )


def _stamped(message: Any, stamp_ns: int) -> Any:
    message.header.stamp = Time(sec=stamp_ns // NS, nanosec=stamp_ns % NS)
    message.header.frame_id = 'map'
    return message


def _poses(recording: Recording) -> Iterator[Message]:
    for stamp_ns, position in zip(*recording.poses, strict=True):
        message = _stamped(PoseStamped(), int(stamp_ns))
        place = message.pose.position
        place.x, place.y, place.z = position.tolist()
        yield int(stamp_ns), '/pose', message


def _commands(recording: Recording) -> Iterator[Message]:
    for stamp_ns, velocity in zip(*recording.commands, strict=True):
        message = _stamped(TwistStamped(), int(stamp_ns))
        linear = message.twist.linear
        linear.x, linear.y, linear.z = velocity.tolist()
        yield int(stamp_ns), '/cmd_vel', message


def _states(recording: Recording) -> Iterator[Message]:
    for event in recording.events:
        if event.in_air is None:
            continue
        message = _stamped(VehicleStatus(), event.stamp_ns)
        message.autopilot, message.mode, message.connected, message.ready = event.autopilot, event.mode, True, True
        message.armed, message.in_air, message.commandable = event.armed, event.in_air, event.in_air
        yield event.stamp_ns, '/vehicle_status', message


if __name__ == '__main__':
    main()
