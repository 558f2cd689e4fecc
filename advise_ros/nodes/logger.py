"""The node /logger."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from advise_ros.config import LoggerConfig
from advise_ros.core.errors import InputError
from advise_ros.recording import platform
from advise_ros.recording.definitions import definition
from advise_ros.recording.writer import BagWriter
from advise_ros.ros import diagnostics, parameters, run, topics
from advise_ros.ros.diagnostics import Diagnostics
from advise_ros.ros.parameter_watch import ParameterWatch
from advise_ros.ros.subscriptions import RawSubscriptions

DISCOVERY_PERIOD_S = 0.5
PARAMETERS_RECORD = 'parameters '
PLATFORM_RECORD = 'platform'


class Logger(Node):
    """Records everything that a session is rebuilt from into one bag (rosbag2 layout, MCAP).

    By default: pose, odom, cmd_vel, vehicle_status, battery_state, demonstration, advise/query,
    advise/policy, advise/advice_log, advise/status, advise/uncertainty, advise/reward, advise/markers,
    policy/status and /diagnostics; or the names and patterns in `topics`, also those that appear later.
    Messages are stored as they came (CDR) with their definitions and the profiles that publishers
    offer; the bag also holds the parameters of every node and the versions of the numeric packages.
    Ctrl-C finishes it. It opens in `ros2 bag`, rosbags, mcap and Foxglove; `replay BAG` checks it.

    Example: ros2 run advise_ros logger --ros-args -p bag:=session1
    """

    def __init__(self) -> None:
        super().__init__('logger')
        self.config = parameters.load(self, LoggerConfig)
        if not self.config.bag:
            raise InputError("parameter 'bag' is empty; name the directory to write, e.g. -p bag:=session1")
        self.exit_code = run.OK
        self._diagnostics = Diagnostics(self)
        self._failed = False
        self._channels: dict[str, int] = {}
        self._topics_written = 0
        self._writer = BagWriter(Path(self.config.bag), self.config.compression, self.config.chunk_kib * 1024)
        self._writer.add_record(PLATFORM_RECORD, platform.describe())
        self._incoming = self._subscribe()
        self._parameter_watch = ParameterWatch(self, self._on_parameters)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DISCOVERY_PERIOD_S, self._discover, clock=steady)
        self.create_timer(self.config.flush_s, self._flush, clock=steady)

    def _subscribe(self) -> RawSubscriptions:
        patterns = [pattern.strip() for pattern in self.config.topics.split(',') if pattern.strip()]
        return RawSubscriptions(self, patterns, {} if patterns else topics.RECORDED, self._on_message)

    def _discover(self) -> None:
        self._incoming.refresh()
        self._parameter_watch.refresh()

    def _on_message(self, topic: str, type_name: str, data: bytes, source_ns: int) -> None:
        if self._failed:
            return
        try:
            channel = self._channels.get(topic) or self._open_channel(topic, type_name)
            self._writer.write(channel, self.get_clock().now().nanoseconds, source_ns, data)
        except OSError as problem:
            self._fail(problem)

    def _open_channel(self, topic: str, type_name: str) -> int:
        channel = self._writer.add_topic(topic, definition(type_name), self._incoming.offers(topic))
        self._channels[topic] = channel
        return channel

    def _on_parameters(self, node_name: str, values: dict[str, Any]) -> None:
        if self._failed:
            return
        try:
            self._writer.add_record(
                PARAMETERS_RECORD + node_name, {name: json.dumps(value) for name, value in values.items()}
            )
        except OSError as problem:
            self._fail(problem)

    def _flush(self) -> None:
        if self._failed:
            return
        try:
            self._writer.flush()
            if len(self._channels) != self._topics_written:
                self._writer.write_metadata_file()
                self._topics_written = len(self._channels)
        except OSError as problem:
            self._fail(problem)
            return
        self._report()

    def _report(self) -> None:
        problems = self._incoming.problems
        values = self._writer.counts
        if problems:
            self._diagnostics.set(diagnostics.WARN, next(iter(problems.values())), values)
        else:
            self._diagnostics.set(diagnostics.OK, f'recording into {self.config.bag}', values)

    def _fail(self, problem: OSError) -> None:
        """Say once that nothing more is recorded; the rest of the graph must not suffer."""
        self._failed = True
        self.exit_code = run.VERDICT_NO
        text = f'recording into {self.config.bag} stopped: {problem.strerror}; free some space and start the logger again'
        self.get_logger().error(text)
        self._diagnostics.set(diagnostics.ERROR, text)

    def close(self) -> None:
        """Finish the bag; the ROS context may be gone."""
        try:
            self._writer.close()
        except OSError as problem:
            self.exit_code = run.VERDICT_NO
            if not self._failed:
                run.fail(f'bag {self.config.bag} could not be finished: {problem.strerror}; free some space')


def main() -> None:
    # A KeyboardInterrupt in the middle of a write would break the file: rclpy's own handler ends the spinning.
    signal.signal(signal.SIGINT, lambda *_: None)
    sys.exit(run.run_node(Logger, LoggerConfig))
