"""What nodes have in common through which velocity commands pass: limits, the guard with its memory, stop and release."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from advise_ros.config import ChecksConfig
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.guard import rules
from advise_ros.core.guard.fence import Fence, corners_from_text, fence_around
from advise_ros.core.guard.monitor import GuardMonitor, MonitorSettings
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros.convert import stamp_to_ns
from advise_ros.ros.managed import ManagedNode

FENCE_OFF = 'the fence is off (fence:=off)'
ASKED = 'somebody asked for it'


def load_grid_of(config: ChecksConfig) -> Grid | None:
    """The grid, if one is named.

    Raises:
        InputError: the grid file is wrong.
    """
    return load_grid(config.grid_file) if config.grid_file else None


def limits_of(config: ChecksConfig, grid: Grid | None) -> rules.Limits:
    """What commands must keep to.

    Raises:
        InputError: there is no fence and `fence` is not off, it is no polygon, or its altitude is unknown.
    """
    return rules.Limits(
        max_speed_m_s=config.max_speed_m_s, max_climb_m_s=config.max_climb_m_s,
        max_yaw_rate_rad_s=config.max_yaw_rate_rad_s, braking_m_s2=config.braking_m_s2,
        command_timeout_s=config.command_timeout_s, pose_timeout_s=config.pose_timeout_s,
        reaction_s=reaction_of(config),
        fence=_fence_of(config, grid),
    )


def _fence_of(config: ChecksConfig, grid: Grid | None) -> Fence | None:
    if config.fence == 'off':
        return None
    if grid is None and not config.fence_polygon:
        raise InputError("there is no fence; name one by 'grid_file' or 'fence_polygon', or fly without by fence:=off")
    around = None if grid is None else fence_around(grid, config.fence_margin_m, config.altitude_band_m)
    if config.fence_low_m < config.fence_high_m and around is not None:
        around = around._replace(low_m=config.fence_low_m, high_m=config.fence_high_m)
    if not config.fence_polygon:
        return around
    corners = corners_from_text(config.fence_polygon)
    if around is not None:
        return around._replace(corners_enu_m=corners)
    if config.fence_low_m >= config.fence_high_m:
        raise InputError("fence_polygon has no altitudes; set 'fence_low_m' and 'fence_high_m', or 'grid_file'")
    return Fence(corners, config.fence_low_m, config.fence_high_m)


def monitor_of(config: ChecksConfig, limits: rules.Limits, *, lifts: bool = False) -> LiveMonitor:
    """The guard with its memory; `lifts`: it only commands a vehicle that is in the air."""
    return LiveMonitor(limits, MonitorSettings(
        config.max_acceleration_m_s2, config.jump_m, config.latch, config.vehicle_delay_s, config.return_inside, lifts,
    ))


class LiveMonitor(GuardMonitor):
    """A guard whose limits may change in flight; what it has received and doubts stays."""

    def keep_to(self, limits: rules.Limits, max_acceleration_m_s2: float) -> None:
        """Other limits from the next verdict on.

        Args:
            limits: with the fence as it was.
            max_acceleration_m_s2: how fast a commanded velocity may grow.
        """
        self._given = limits
        self._settings = replace(self._settings, max_acceleration_m_s2=max_acceleration_m_s2)


def with_speeds(limits: rules.Limits, config: ChecksConfig) -> rules.Limits:
    """The limits with what may be set in flight as the parameters have it now; the fence stays."""
    return replace(
        limits, max_speed_m_s=config.max_speed_m_s, max_climb_m_s=config.max_climb_m_s,
        max_yaw_rate_rad_s=config.max_yaw_rate_rad_s, reaction_s=reaction_of(config),
    )


def reaction_of(config: ChecksConfig) -> float:
    """What was made from a pose flies on until that is too old, and a tick and the vehicle's delay longer; twice that [s]."""
    return 2.0 * (config.pose_timeout_s + 1.0 / config.rate_hz + config.vehicle_delay_s)


def set_rate(timer: Timer, rate_hz: float) -> None:
    """Call a timer so often from now on.

    Args:
        timer: of steady time.
        rate_hz: calls a second.
    """
    timer.timer_period_ns = round(1e9 / rate_hz)


def put_command(monitor: GuardMonitor, message: TwistStamped, now_s: float, now_ns: int) -> None:
    """Pass a command that arrives now to the guard.

    Args:
        monitor: the guard.
        message: the command.
        now_s: steady time.
        now_ns: the node's clock.
    """
    linear = message.twist.linear
    command = rules.Command((linear.x, linear.y, linear.z), message.header.frame_id, 0.0, message.twist.angular.z)
    monitor.command(command, now_s, stamp_ns=stamp_to_ns(message.header.stamp), now_ns=now_ns)


def answer_stop(monitor: GuardMonitor, response: Trigger.Response) -> Trigger.Response:
    """Stop until released."""
    monitor.stop(ASKED)
    response.success, response.message = True, f'stopped until released: {monitor.latched}'
    return response


def answer_release(monitor: GuardMonitor, response: Trigger.Response) -> Trigger.Response:
    """End a latched stop."""
    why = monitor.release()
    response.success, response.message = bool(why), f'released; it was stopped: {why}' if why else 'it was not stopped'
    return response


class CheckingNode(ManagedNode):
    """A managed node with a guard, whose limits may be set while it runs.

    Args:
        name: of the node.
        config_class: a ChecksConfig.
        lifts: it only commands a vehicle that is in the air.
    """

    _tick: Timer

    def __init__(self, name: str, config_class: type[Any], *, lifts: bool = False) -> None:
        super().__init__(name)
        self._lifts = lifts
        self.config = self.load(config_class)
        self._limits = rules.Limits()
        self._monitor = monitor_of(self.config, self._limits, lifts=lifts)

    def _renew_guard(self, grid: Grid | None) -> None:
        """As the parameters are now; nothing is received yet, a stop holds on.

        Raises:
            InputError: as limits_of.
        """
        self._limits = limits_of(self.config, grid)
        latched = self._monitor.latched
        self._monitor = monitor_of(self.config, self._limits, lifts=self._lifts)
        self._monitor.latched = latched
        set_rate(self._tick, self.config.rate_hz)

    def changed(self, names: frozenset[str]) -> None:
        self._limits = with_speeds(self._limits, self.config)
        self._monitor.keep_to(self._limits, self.config.max_acceleration_m_s2)
        set_rate(self._tick, self.config.rate_hz)

    @property
    def _stopped(self) -> str:
        return f'stopped until released: {self._monitor.latched}' if self._monitor.latched else ''
