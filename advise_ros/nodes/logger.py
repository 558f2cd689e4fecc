"""The node /logger."""

from __future__ import annotations

import json
import signal
import struct
import sys
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType

from advise_ros import exits
from advise_ros.config import LoggerConfig
from advise_ros.core.errors import InputError
from advise_ros.core.units import NS
from advise_ros.recording import platform
from advise_ros.recording.background import MIB, BackgroundWriter, BagEntry, WriteLimits
from advise_ros.recording.bagrecords import RECORDS_TOPIC
from advise_ros.recording.definitions import definition
from advise_ros.recording.platform import LEFT_OUT_RECORD, PARAMETERS_RECORD, PLATFORM_RECORD, READ_AT
from advise_ros.recording.writer import BagWriter
from advise_ros.ros import diagnostics, run, topics
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.diagnostics import Diagnostics
from advise_ros.ros.parameter_watch import ParameterWatch
from advise_ros.ros.subscriptions import CLOCK_TOPIC, Arrival, RawSubscriptions

# Messages wait this long in their queues; 5000 a second are 250, a tenth of what fits.
TAKE_PERIOD_S = 0.05
DISCOVERY_PERIOD_S = 0.5
# builtin_interfaces/Time behind the encapsulation of a message in CDR (little-endian).
CLOCK_CDR = struct.Struct('<4xiI')


class LoggerNode(ConfiguredNode):
    """Records everything that a session is rebuilt from into one bag (rosbag2 layout, MCAP).

    By default: pose, odom, cmd_vel, vehicle_status, battery_state, demonstration, advise/query, advise/policy, advise/advice_log,
    advise/status, advise/uncertainty, advise/reward, advise/site_map, advise/site_prior, advise/markers, advise/route,
    advise/geo_route, advise/map, recorder/path, recorder/track, guard/cmd_vel, guard/pose, policy/status, /parameter_events,
    /diagnostics and what services publish of their calls (service_introspection); or the names and patterns in `topics`, also
    those that appear later.
    Messages are stored as they came (CDR) with their definitions and the profiles that publishers offer; the bag also holds the
    parameters of every node and the versions of the numeric packages, as metadata records and, for who converts it, on
    /bag_records. What others publish and it was not asked for is listed in the bag and at the end.

    What came more than flush_s ago survives the death of this process; `recover BAG` makes a bag whole
    that was cut off. A full disk raises an alarm on /diagnostics and harms nobody else. Ctrl-C finishes
    the bag. It opens in `ros2 bag`, rosbags, mcap and Foxglove; `replay BAG` checks it.

    Example: ros2 run advise_ros logger --ros-args -p bag:=session1
    Next: start the other nodes; after Ctrl-C, `replay session1` checks what was recorded.
    """

    def __init__(self) -> None:
        super().__init__('logger')
        self.config = self.load(LoggerConfig)
        if not self.config.bag:
            raise InputError("parameter 'bag' is empty; name the directory to write, e.g. -p bag:=session1")
        self.exit_code = exits.OK
        self._diagnostics = Diagnostics(self, self._report)
        self._end_reported = False
        self._opened: set[str] = set()
        self._simulated = bool(self.get_parameter('use_sim_time').value)
        self._simulated_ns = 0
        made_on = platform.describe()  # May take a while: nothing may wait to be taken meanwhile.
        self._incoming = self._subscribe()
        self._writer = self._open_bag()
        self._writer.add_record(PLATFORM_RECORD, made_on)
        self._parameter_watch = ParameterWatch(self, self._on_parameters)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(min(TAKE_PERIOD_S, self.config.flush_s / 4), self._take, clock=steady)
        self.create_timer(DISCOVERY_PERIOD_S, self._discover, clock=steady)

    def _subscribe(self) -> RawSubscriptions:
        asked = [pattern.strip() for pattern in self.config.topics.split(',') if pattern.strip()]
        known = {} if asked else topics.RECORDED
        return RawSubscriptions(self, asked or topics.RECORDED_PATTERNS, known, clock=self._simulated)

    def _open_bag(self) -> BackgroundWriter:
        config = self.config
        bag = BagWriter(Path(config.bag), config.compression)
        return BackgroundWriter(
            bag, WriteLimits(config.flush_s, config.split_s, config.split_mib * MIB, config.min_free_mib * MIB),
        )

    def _discover(self) -> None:
        self._incoming.refresh()
        self._parameter_watch.refresh()

    # -- messages ----------------------------------------------------------------------------
    def _take(self) -> None:
        if self._writer.problem is not None:
            self._report_end(self._writer.problem)
            return
        entries = []
        for arrival in self._incoming.take():
            log_time_ns = self._log_time_ns(arrival)
            if arrival.topic in self._opened or self._open(arrival):
                entries.append(BagEntry(arrival.topic, log_time_ns, arrival.source_ns, arrival.data))
        if entries:
            self._writer.write(entries)

    def _log_time_ns(self, arrival: Arrival) -> int:
        """When a message arrived, by the wall clock, or by the last /clock before it."""
        if not self._simulated:
            return arrival.received_ns
        if arrival.topic == CLOCK_TOPIC:
            seconds, nanoseconds = CLOCK_CDR.unpack_from(arrival.data)
            self._simulated_ns = seconds * NS + nanoseconds
        return self._simulated_ns

    def _open(self, arrival: Arrival) -> bool:
        """Begin a topic with its first message, unless it is read for its time only."""
        if arrival.topic == CLOCK_TOPIC and not self._incoming.is_asked_for(CLOCK_TOPIC):
            return False
        if arrival.topic == RECORDS_TOPIC:  # Of a bag that is played; this one has its own.
            return False
        self._opened.add(arrival.topic)
        self._writer.open_topic(arrival.topic, definition(arrival.type_name), self._incoming.offers(arrival.topic))
        return True

    def _on_parameters(self, node_name: str, values: dict[str, Any]) -> None:
        now_ns = self._simulated_ns if self._simulated else self.get_clock().now().nanoseconds
        texts = {name: json.dumps(value) for name, value in {**values, READ_AT: now_ns}.items()}
        self._writer.add_record(PARAMETERS_RECORD + node_name, texts)

    # -- what people read --------------------------------------------------------------------
    def _report(self) -> None:
        problems, counts, dropped = self._incoming.problems, self._writer.counts, self._writer.dropped
        if self._writer.problem is not None:
            self._report_end(self._writer.problem)
        elif dropped:
            self._diagnostics.set(diagnostics.ERROR, f'the disk of {self.config.bag} is too slow: messages are lost', {
                'lost': dropped, **counts,
            })
        elif problems:
            self._diagnostics.set(diagnostics.WARN, next(iter(problems.values())), counts)
        else:
            self._diagnostics.set(diagnostics.OK, f'recording into {self.config.bag}', counts)

    def _report_end(self, problem: str) -> None:
        """Say once that nothing more is recorded; the rest of the graph must not suffer."""
        if self._end_reported:
            return
        self._end_reported = True
        self.exit_code = exits.VERDICT_NO
        text = f'recording into {self.config.bag} stopped: {problem}; free some space and start the logger again'
        self.get_logger().error(text)
        self._diagnostics.set(diagnostics.ERROR, text)

    def close(self) -> None:
        """Finish the bag; the ROS context may be gone."""
        self._take()
        self._take()  # What came during the first.
        self._say_what_was_left_out()
        self._writer.close()
        if self._writer.problem is not None:
            self.exit_code = exits.VERDICT_NO
            if not self._end_reported:
                exits.fail(f'bag {self.config.bag} could not be finished: {self._writer.problem}; free some space')

    def _say_what_was_left_out(self) -> None:
        left_out = dict(sorted(self._incoming.left_out.items()))
        self._writer.add_record(LEFT_OUT_RECORD, left_out)
        if left_out:
            listed = ', '.join(f'{topic} ({kind})' for topic, kind in left_out.items())
            print(f'not recorded, as nobody asked for it by -p topics: {listed}', flush=True)


def main() -> None:
    # A KeyboardInterrupt in the middle of a write would break the file: rclpy's own handler ends the spinning.
    signal.signal(signal.SIGINT, lambda *_: None)
    sys.exit(run.run_node(LoggerNode, LoggerConfig))
