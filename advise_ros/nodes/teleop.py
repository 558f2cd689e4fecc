"""The node by which a person flies in the terminal."""

from __future__ import annotations

import sys
import time

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from sensor_msgs.msg import Joy
from std_srvs.srv import Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros.config import TeleopConfig
from advise_ros.core.flight.hand import DEAD_ZONE, HandStick
from advise_ros.core.flight.keyboard import MOTIONS, Key, Stick, decode
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.grid.cell_tracker import CellTracker
from advise_ros.core.units import ZERO
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros import qos, run
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.diagnostics import OK, WARN, Diagnostics
from advise_ros.ros.flying import (
    NEWEST_POSE,
    PoseGate,
    between_poses_ns,
    velocity_command,
)
from advise_ros.ros.terminal import Terminal

KEYS = """\
  arrow keys   north, west, south, east        t   take off
  w or PgUp    climb                           l   land
  s or PgDn    sink                            r   recording on or off
  space        hold                            q   quit (the vehicle holds)"""
# Zero velocity is sent this long after a key is let go, then nothing: another node may fly.
HOLD_S = 1.0
SHOW_PERIOD_S = 0.2
# What a service replied stands for this long.
SAID_S = 8.0
# Most gamepads have triggers between their two sticks: then axis 4 is the right stick's, else axis 3.
CLIMB_AXIS, MOST_AXES = 4, 5


class TeleopNode(ConfiguredNode):
    """Flies by the keys of the terminal: a person demonstrates the route.

    Arrow keys fly north (up), east, south and west while held; w and s or the page keys climb and sink; space holds;
    t takes off and l lands by mavlink_bridge/takeoff and /land, and in the air t takes over what others fly by
    mavlink_bridge/take_over; r starts a demonstration by
    recorder/start and ends it by recorder/stop (recorder with split:=manual); q quits. A key that
    is let go becomes zero velocity after key_timeout_s. Publishes `cmd_vel` (TwistStamped, frame map) while
    vehicle_status.commandable is true; shows `pose`, and with grid_file the cell and the next waypoint.

    Example: ros2 run advise_ros teleop --ros-args -p grid_file:=config/grid_6x6.yaml
    Next: `ask` or `console` shows what the drone wants to know about what you flew.
    """

    def __init__(self) -> None:
        super().__init__('teleop')
        self.config = self.load(TeleopConfig)
        self._grid = load_grid(self.config.grid_file) if self.config.grid_file else None
        self._stick = Stick(self.config.speed_m_s, self.config.climb_m_s, self.config.key_timeout_s)
        self._joy = HandStick(self.config.speed_m_s, self.config.climb_m_s)
        self._joy_held = False
        self._gate = PoseGate()
        self._tracker: CellTracker | None = None
        self._start_route()
        self._pose: Pose | None = None
        self._vehicle: VehicleStatus | None = None
        self._typed = b''
        self._hold_until_s = self._shown_s = 0.0
        self._moving = False
        self._recording = False
        self._said, self._said_until_s = '', 0.0
        self._diagnostics = Diagnostics(self)
        self._make_entities()
        self._terminal = Terminal()
        print(KEYS, flush=True)

    def _make_entities(self) -> None:
        self._commands = self.create_publisher(TwistStamped, 'cmd_vel', qos.COMMAND)
        self._asks = {name: self.create_client(Trigger, name) for name in (
            'mavlink_bridge/takeoff', 'mavlink_bridge/land', 'mavlink_bridge/take_over', 'recorder/start', 'recorder/stop',
        )}
        self.create_subscription(VehicleStatus, 'vehicle_status', self._on_vehicle, qos.latched())
        self.create_subscription(PoseStamped, 'pose', self._on_pose, NEWEST_POSE)
        self.create_subscription(Joy, 'joy', self._on_joy, qos.COMMAND)
        self.create_timer(1.0 / self.config.rate_hz, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """Give the terminal back."""
        self._terminal.restore()

    # -- what comes in -----------------------------------------------------------------------
    def _on_vehicle(self, message: VehicleStatus) -> None:
        if message.commandable and not (self._vehicle and self._vehicle.commandable):
            self._start_route()
        self._vehicle = message

    def _on_pose(self, message: PoseStamped) -> None:
        self._gate.restart()  # Poses are only shown: their order does not matter.
        pose = self._gate.take(message, self.get_clock().now().nanoseconds)
        if pose is not None:
            self._pose = pose
            if self._tracker is not None and self._vehicle is not None and self._vehicle.commandable:
                self._tracker.update(pose.position_enu_m[0], pose.position_enu_m[1], pose.stamp_ns)

    def _on_joy(self, message: Joy) -> None:
        """Axes of joy_node: 0 and 1 the left stick, positive to the left and up, 4 (or 3) the right one."""
        axes = [*map(float, message.axes), *[0.0] * MOST_AXES]
        climb = axes[4] if len(message.axes) > CLIMB_AXIS else axes[3]
        stick, now_s = (-axes[0], axes[1], climb), time.monotonic()
        self._joy_held = self._joy_held and any(abs(value) >= DEAD_ZONE for value in stick)
        if not self._joy_held:
            self._joy.move(stick, now_s, now_s)

    def _start_route(self) -> None:
        if self._grid is not None:
            self._tracker = CellTracker(self._grid, self.config.hysteresis_m)

    def _on_tick(self) -> None:
        typed, now_s = self._terminal.read(), time.monotonic()
        if typed is None:
            rclpy.try_shutdown()
            return
        keys, self._typed = decode(self._typed + typed)
        for key in keys:
            self._press(key, now_s)
        self._fly(now_s)
        self._show(now_s)

    # -- keys --------------------------------------------------------------------------------
    def _press(self, key: Key, now_s: float) -> None:
        self._stick.press(key, now_s)
        if key is Key.HOLD:
            self._joy.let_go()
            self._joy_held = True
        if key in MOTIONS or key is Key.HOLD:
            self._hold_until_s = now_s + HOLD_S
        elif key is Key.QUIT:
            self._publish(ZERO)
            rclpy.try_shutdown()
        elif key is Key.RECORD:
            self._ask('recorder/stop' if self._recording else 'recorder/start')
        elif key is Key.TAKEOFF and self._others_fly:
            self._ask('mavlink_bridge/take_over')
        else:
            self._ask(f'mavlink_bridge/{key.value}')

    @property
    def _others_fly(self) -> bool:
        return self._vehicle is not None and self._vehicle.in_air and self._vehicle.owner == 'others'

    def _ask(self, service: str) -> None:
        client = self._asks[service]
        if not client.service_is_ready():
            self._say(f'{service}: there is no such service')
            return
        self._say(f'{service} ...')
        client.call_async(Trigger.Request()).add_done_callback(lambda future: self._on_reply(service, future))

    def _on_reply(self, service: str, future: Future) -> None:
        reply = future.result()
        self._say(f'{service}: {reply.message or ("done" if reply.success else "refused")}')
        if reply.success and service.startswith('recorder/'):
            self._recording = service == 'recorder/start'
            self._start_route()

    def _say(self, sentence: str) -> None:
        self._said, self._said_until_s = sentence, time.monotonic() + SAID_S

    def _fly(self, now_s: float) -> None:
        """Command while a key is held and a moment longer; motion is followed by zero even if this comes late."""
        velocity_enu_m_s = self._stick.velocity(now_s)
        if velocity_enu_m_s == ZERO:
            velocity_enu_m_s = self._joy.velocity(now_s) or ZERO
        if velocity_enu_m_s != ZERO:
            self._moving, self._hold_until_s = True, now_s + HOLD_S
        commandable = self._vehicle is None or self._vehicle.commandable
        if commandable and (self._moving or now_s < self._hold_until_s):
            self._publish(velocity_enu_m_s)
            self._moving = velocity_enu_m_s != ZERO

    def _publish(self, velocity_enu_m_s: tuple[float, float, float]) -> None:
        self._commands.publish(velocity_command(velocity_enu_m_s, between_poses_ns(self.get_clock().now().nanoseconds)))

    # -- what is shown -----------------------------------------------------------------------
    def _show(self, now_s: float) -> None:
        if now_s - self._shown_s < SHOW_PERIOD_S:
            return
        self._shown_s = now_s
        held = self._stick.held(now_s)
        said = self._said if now_s < self._said_until_s else ''
        recording = 'RECORDING' if self._recording else ''
        parts = [self._vehicle_text(), self._cell_text(), held.value if held else 'hold', recording, said, self._place_text()]
        self._terminal.show(' | '.join(part for part in parts if part))
        self._diagnostics.set(WARN if self._gate.problem else OK, self._gate.problem or self._vehicle_text())

    def _place_text(self) -> str:
        if self._pose is None:
            return self._gate.problem or 'no pose yet'
        east, north, up = self._pose.position_enu_m
        return f'east {east:.1f} north {north:.1f} up {up:.1f} m'

    def _cell_text(self) -> str:
        if self._grid is None or self._tracker is None or self._tracker.state is None:
            return ''
        cell = list(self._grid.xy(self._grid.cell_of(self._tracker.state)))
        if self._tracker.finished:
            return f'cell {cell}, the route is over'
        waypoint = list(self._grid.xy(self._grid.waypoints[self._grid.next_waypoint(self._tracker.state)]))
        return f'cell {cell}, next waypoint {waypoint}'

    def _vehicle_text(self) -> str:
        vehicle = self._vehicle
        if vehicle is None:
            return 'no vehicle_status'
        if vehicle.commandable:
            return 'flying'
        if self._others_fly:
            return f"others fly it, t takes over ({vehicle.waiting_for.removeprefix('mavlink_bridge/take_over: ')})"
        if vehicle.in_air:
            return vehicle.waiting_for or 'in the air, takes no commands'
        return 'ready, t takes off' if vehicle.ready else vehicle.waiting_for or 'not ready'


def main() -> None:
    sys.exit(run.run_node(TeleopNode, TeleopConfig))


if __name__ == '__main__':
    main()
