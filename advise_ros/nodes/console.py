"""The node that serves the person's page."""

from __future__ import annotations

from importlib.util import find_spec

import rclpy
from rclpy.clock import Clock, ClockType

from advise_ros import exits
from advise_ros.config import ConsoleConfig
from advise_ros.console.first_visit import FirstVisit, Server
from advise_ros.console.hand import HandFlight
from advise_ros.console.listener import GraphListener
from advise_ros.console.port import HOST, bind
from advise_ros.console.protection import Gate
from advise_ros.console.requests import RequestDispatcher
from advise_ros.console.route_delivery import RouteDelivery
from advise_ros.recording.gridfile import load_grid, load_place
from advise_ros.ros import diagnostics, run
from advise_ros.ros.configured import ConfiguredNode

WATCH_S = 0.5


class ConsoleNode(ConfiguredNode):
    """Serves a web page that shows the drone's question as a picture and takes the answer in one gesture.

    It prints an address with a random token; open it in a browser on this machine (from elsewhere:
    ssh -L 8080:127.0.0.1:8080 HOST). The page shows the map with the question lit, what was flown there against
    what the drone would fly, where the learner is unsure, the drone's position and track, what an answer would
    change before it is given, the earlier answers, and the state of every node; it holds, flies and lands the
    drone, lets a person fly it (`cmd_vel`) and starts and ends demonstrations; it gives the
    learnt route to other tools as a file, and to the vehicle as its mission. It works by mouse, finger or keyboard alone.

    Listens to all topics of the learner, `pose`, `vehicle_status`, `battery_state`, `policy/status` and
    `/diagnostics`; calls `advise/answer`, `advise/preview`, `advise/undo`, `advise/retract`, `policy/stop`,
    `policy/fly`, `recorder/start`, `recorder/stop`, `recorder/discard`, `recorder/take_back`, `mavlink_bridge/takeoff`,
    `mavlink_bridge/land` and `mavlink_bridge/take_over`.

    Example: ros2 run advise_ros console --ros-args -p port:=8080
    Next: open the address that it prints; when the questions are answered, take off and fly on the page.
    """

    def __init__(self) -> None:
        super().__init__('console')
        self.config = self.load(ConsoleConfig)
        self._diagnostics = diagnostics.Diagnostics(self)
        grid = load_grid(self.config.grid_file) if self.config.grid_file else None
        bound = bind(self.config.port)
        port = bound.getsockname()[1]
        gate = Gate(port, filter(None, map(str.strip, self.config.allowed_hosts.split(','))), self.config.token)
        listener = GraphListener(self, self.config.silence_s, grid)
        hand = HandFlight(self, listener.board, self.config.speed_m_s, self.config.climb_m_s)
        place = load_place(self.config.grid_file) if self.config.grid_file else None
        delivery = RouteDelivery(listener, place, self.config.mission_url)
        dispatcher = RequestDispatcher(self, listener, hand, delivery)

        def page_server() -> Server:
            from advise_ros.console.server import PageServer  # noqa: PLC0415  slow to import

            return PageServer(listener, dispatcher, gate, bound, self.config)

        self._server = FirstVisit(bound, page_server)
        self._address = f'http://{HOST}:{port}/?token={gate.token}'
        # The server starts once the node spins, so that a page never waits for a node that does not come up.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._start = self.create_timer(0.0, self._on_start, clock=steady)
        self.create_timer(WATCH_S, self._watch, clock=steady)
        self.exit_code = exits.OK

    def _on_start(self) -> None:
        self._start.cancel()
        self._server.start()
        print(f'Open {self._address}', flush=True)
        self._diagnostics.set(diagnostics.OK, f'serving the page on port {self._address.split(":")[2].split("/")[0]}')

    def _watch(self) -> None:
        if self._server.failure:
            self.get_logger().error(self._server.failure)
            self.exit_code = exits.VERDICT_NO
            rclpy.try_shutdown()

    def close(self) -> None:
        self._server.stop()


def main() -> None:
    if find_spec('nicegui') is None:  # Else it would be missed at the first visit only.
        raise ModuleNotFoundError('no nicegui', name='nicegui')
    # The server's event loop may still hold a connection; it must not meet an interpreter that is being taken down.
    run.exit_now(run.run_node(ConsoleNode, ConsoleConfig))
