"""Every node's parameters: one frozen dataclass a node, each field with unit, range and default.

The unit is the suffix of the name (_m, _m_s, _s, _hz, _ns); a field without suffix has none. What `core/` works with has its
default, meaning and range there, and is inherited or named by `same_as` here. `ros/parameters.py` declares all to ROS;
`tools/parameters.py` writes config/advise.yaml and docs/parameters.md from them.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields
from typing import Any, TypeVar

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.errors import InputError
from advise_ros.core.flight.flight_settings import FlightSettings
from advise_ros.core.flight.velocity_law import SeekSettings
from advise_ros.core.grid.cell_tracker import TrackerSettings
from advise_ros.core.guard.monitor import MonitorSettings
from advise_ros.core.guard.rules import Limits
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.parameter import parameter, same_as
from advise_ros.core.people.settings import ExpertSettings, PilotSettings

ConfigT = TypeVar('ConfigT')
Scalar = bool | int | float | str
# A choice that YAML, and so `-p name:=off`, reads as false.
YAML_OFF = 'off'


def range_text(spec: Field[Any]) -> str:
    """The allowed values in words, e.g. '0.1 to 20' or 'sim | px4'."""
    if spec.metadata['choices']:
        return ' | '.join(repr(choice) for choice in spec.metadata['choices'])
    low, high = spec.metadata['low'], spec.metadata['high']
    if low is None and high is None:
        return {bool: 'true | false', str: 'any text'}.get(type(spec.default), 'any number')
    return f'{"-inf" if low is None else f"{low:.10g}"} to {"inf" if high is None else f"{high:.10g}"}'


def check(spec: Field[Any], value: Scalar) -> Scalar:
    """The value in the field's type.

    Raises:
        InputError: wrong type or out of range; names parameter, value and allowed range.
    """
    wanted = type(spec.default)
    if value is False and YAML_OFF in spec.metadata['choices']:
        value = YAML_OFF
    if wanted is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not wanted:
        raise InputError(
            f"parameter '{spec.name}' is {value!r} ({type(value).__name__}); "
            f'it must be a {wanted.__name__}: {range_text(spec)}'
        )
    if spec.metadata['choices'] and value not in spec.metadata['choices']:
        raise InputError(f"parameter '{spec.name}' is {value!r}; allowed: {range_text(spec)}")
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        low, high = spec.metadata['low'], spec.metadata['high']
        inside = math.isfinite(value) and (low is None or value >= low) and (high is None or value <= high)
        if not inside:
            raise InputError(f"parameter '{spec.name}' is {value}; allowed: {range_text(spec)}")
    return value


def build(config_class: type[ConfigT], values: Mapping[str, Scalar]) -> ConfigT:
    """A config from name -> value; what is not named keeps its default.

    Raises:
        InputError: unknown name (with the nearest known one), wrong type or out of range.
    """
    specs = {spec.name: spec for spec in fields(config_class)}  # type: ignore[arg-type]
    for name in values:
        if name not in specs:
            raise InputError(unknown_name(name, tuple(specs)))
    return config_class(**{name: check(specs[name], value) for name, value in values.items()})


def unknown_name(name: str, known: tuple[str, ...]) -> str:
    """One sentence about an unknown parameter."""
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else f'; known: {", ".join(sorted(known))}'
    return f"parameter '{name}' is unknown{hint}"


def defaults(config_class: type[Any]) -> dict[str, Scalar]:
    """Name -> default of every field."""
    return {spec.name: spec.default for spec in fields(config_class) if spec.default is not MISSING}


GRID_DOC = 'YAML file with the grid and its waypoints'
WISH_DOC = 'YAML file with cells that this person keeps out of and no map shows, keep_out: [[x, y], ...]; empty: none'
SIGNING_DOC = 'key of MAVLink 2 signing, readable by its owner only; frames without its signature are refused; empty: none'
AUTOSTART_DOC = 'become active at once; false: wait, unconfigured, for ros2 lifecycle set'


@dataclass(frozen=True)
class OnGrid:
    """The parameter of every node that knows the route."""

    grid_file: str = parameter('', GRID_DOC)


@dataclass(frozen=True)
class OnObstacleMap(OnGrid):
    """The parameters of every node that plans or judges ways: the same for all of them."""

    obstacle_map_file: str = parameter(
        '', 'map of nav2_map_server (YAML) whose obstacles are blocked cells, beside those of grid_file; empty: none',
    )
    obstacle_map_topic: str = parameter(
        '', 'the same from a latched nav_msgs/OccupancyGrid, e.g. map: the first one that comes counts; empty: none',
    )


@dataclass(frozen=True)
class RecorderConfig(DiscretiseSettings, OnObstacleMap):
    """/recorder: samples -> demonstrations."""

    source: str = parameter('topics', 'where samples come from', choices=('topics', 'mavlink', 'tlog'))
    pose_source: str = parameter('pose', 'topic of positions when source is topics', choices=('pose', 'odom'))
    command_type: str = parameter(
        'TwistStamped', 'type of cmd_vel when source is topics; a Twist counts from when it arrives',
        choices=('TwistStamped', 'Twist'),
    )
    frame: str = parameter('map', "frame of the positions whose origin and axes are the grid's")
    mavlink_url: str = parameter('udpin:127.0.0.1:14551', 'pymavlink connection when source is mavlink')
    tlog_file: str = parameter('', 'log to read when source is tlog')
    vehicle: str = parameter('', 'system id of the vehicle in the log when source is tlog; empty: the one that flies')
    split: str = parameter(
        'flights', 'flights: from take-off to the final waypoint or landing; manual: recorder/start and stop',
        choices=('flights', 'manual'),
    )
    policy_flights: bool = parameter(False, 'flights of our own policy are demonstrations, too')

    def discretise_settings(self) -> DiscretiseSettings:
        """The part that decides how samples become moves."""
        return DiscretiseSettings(**{spec.name: getattr(self, spec.name) for spec in fields(DiscretiseSettings)})


@dataclass(frozen=True)
class AdviseConfig(LearnSettings, OnObstacleMap):
    """/advise: demonstrations + advice -> policy and the next question."""

    session_file: str = parameter('', 'JSON lines file that keeps accepted answers over a restart; empty: none')
    demonstrations_min: int = parameter(1, 'demonstrations before the first policy', low=1, high=100_000)
    demonstrations_file: str = parameter('', 'demonstrations to start with (output of discretise); empty: none')
    site_map_file: str = parameter(
        '', 'what is known of the site: what site_map_out wrote, or any map of nav2_map_server (YAML) of cells to keep out of; '
        'with it no demonstration is needed; takes acquisition site; empty: nothing',
    )
    site_map_out: str = parameter(
        '', 'YAML file that keeps what was learnt of the site, with a .pgm and a .json beside it, written with each policy; '
        'the same as site_map_file: goes on in it; empty: none',
    )
    budget: int = parameter(-1, 'answers the person is willing to give, -1: unlimited', low=-1, high=1_000_000)


@dataclass(frozen=True)
class SeekConfig(SeekSettings, OnObstacleMap):
    """Flying from cell centre to cell centre: shared by /policy and /pilot."""

    def seek_settings(self) -> SeekSettings:
        """What the velocity law needs of this."""
        return SeekSettings(**{spec.name: getattr(self, spec.name) for spec in fields(SeekSettings)})


@dataclass(frozen=True)
class PolicyConfig(FlightSettings, SeekConfig):
    """/policy: flies the policy from cell centre to cell centre."""

    pose_timeout_s: float = parameter(0.5, 'no pose for this long: zero velocity (steady time)', low=0.05, high=60.0)
    give_up_s: float = parameter(
        5.0, 'no pose for this long beyond pose_timeout_s ends the flight for good (steady time)', low=0.0, high=3600.0,
    )
    autostart: bool = parameter(True, AUTOSTART_DOC)


@dataclass(frozen=True)
class ChecksConfig(OnGrid):
    """What /guard and the bridge check each command by."""

    max_speed_m_s: float = same_as(Limits, 'max_speed_m_s')
    max_climb_m_s: float = same_as(Limits, 'max_climb_m_s')
    max_yaw_rate_rad_s: float = same_as(Limits, 'max_yaw_rate_rad_s')
    max_acceleration_m_s2: float = same_as(MonitorSettings, 'max_acceleration_m_s2')
    fence: str = parameter(
        'auto', 'auto: stand inside the fence of grid_file or fence_polygon, and refuse to become active without; off: none',
        choices=('auto', 'off'),
    )
    fence_polygon: str = parameter(
        '', "corners of the fence in metres east and north, '-2,-2 12,-2 12,12 -2,12'; empty: the grid with its margin",
    )
    fence_margin_m: float = parameter(1.0, 'how far past the grid the fence stands', low=0.0, high=1000.0)
    altitude_band_m: float = parameter(3.0, 'how far above or below the grid altitude the fence stands', low=0.1, high=1000.0)
    fence_low_m: float = parameter(
        0.0, 'lowest altitude of the fence; with fence_high_m in place of the band', low=-1e3, high=1e4,
    )
    fence_high_m: float = parameter(
        0.0, 'highest altitude of the fence; not above fence_low_m: the band counts', low=-1e3, high=1e4,
    )
    braking_m_s2: float = same_as(Limits, 'braking_m_s2')
    vehicle_delay_s: float = same_as(MonitorSettings, 'vehicle_delay_s')
    command_timeout_s: float = same_as(Limits, 'command_timeout_s')
    pose_timeout_s: float = same_as(Limits, 'pose_timeout_s')
    jump_m: float = same_as(MonitorSettings, 'jump_m')
    return_inside: bool = same_as(MonitorSettings, 'return_inside')
    latch: bool = same_as(MonitorSettings, 'latch')
    rate_hz: float = parameter(20.0, 'rate of checked commands (steady time); PX4 wants more than 2', low=5.0, high=200.0)
    tf_child_frame: str = parameter(
        '', 'publish each pose as the transform from map to this frame on /tf, e.g. base_link; empty: none, so that nothing '
        'fights a tree that is there',
    )
    autostart: bool = parameter(True, AUTOSTART_DOC)


@dataclass(frozen=True)
class GuardConfig(ChecksConfig):
    """/guard, for MAVROS and other bridges."""

    pose_frame: str = parameter('map', "frame that ENU poses say they are in; ArduPilot's DDS says base_link")


@dataclass(frozen=True)
class MavlinkBridgeConfig(ChecksConfig):
    """/mavlink_bridge: MAVLink <-> ROS; the guard's checks hold here too."""

    url: str = parameter(
        'udpin:127.0.0.1:14550', "pymavlink connection string: udpin:, udpout:, tcp:, tcpin:, or a serial device; px4_dds:, or "
        "px4_dds:NAMESPACE: PX4's uXRCE-DDS topics in place of MAVLink (takes the package px4_msgs)",
    )
    baud: int = parameter(115200, 'baud rate of a serial link', low=1200, high=10_000_000)
    system_id: int = parameter(1, 'our MAVLink system id', low=1, high=255)
    component_id: int = parameter(191, 'our MAVLink component id (191: onboard computer)', low=1, high=255)
    signing_key_file: str = parameter('', SIGNING_DOC)
    target_system: int = parameter(0, 'system id of the vehicle; 0: the first multicopter seen', low=0, high=255)
    pose_rate_hz: float = parameter(20.0, 'positions asked of the autopilot', low=1.0, high=200.0)
    clock: str = parameter(
        'ros', "autopilot: publishes the autopilot's time on /clock, for a SITL not in real time; set use_sim_time on all others",
        choices=('ros', 'autopilot'),
    )
    takeoff_altitude_m: float = parameter(0.0, 'take-off altitude; 0: the grid altitude', low=0.0, high=500.0)
    heartbeat_timeout_s: float = parameter(3.0, 'no heartbeat for this long: link lost (steady time)', low=0.5, high=60.0)
    ready_timeout_s: float = parameter(120.0, 'longest wait for readiness before a take-off (steady time)', low=1.0, high=3600.0)


@dataclass(frozen=True)
class SimulatorConfig:
    """/simulator: a quadcopter by RotorPy behind MAVLink 2."""

    autopilot: str = parameter(
        'ardupilot', 'which autopilot it behaves like: ArduCopter in GUIDED or PX4 in OFFBOARD', choices=('ardupilot', 'px4'),
    )
    endpoint: str = parameter('udpout:127.0.0.1:14550', 'udpout:host:port, udpin:host:port or tcpin:host:port')
    second_endpoint: str = parameter('', 'another link with its own message rates, for a ground station or a second companion')
    speedup: float = parameter(1.0, 'simulated seconds a second; 0: as fast as it goes', low=0.0, high=1000.0)
    parked_speedup: float = parameter(
        0.0, 'the same while it stands disarmed and ready to arm; 0: as speedup', low=0.0, high=1000.0,
    )
    publish_clock: bool = parameter(True, 'publish /clock')
    clock_rate_hz: float = parameter(50.0, 'most /clock messages a second (steady time); each wakes nodes', low=1.0, high=1000.0)
    ready_after_s: float = parameter(42.0, 'simulated time until it may be armed', low=0.0, high=600.0)
    step_s: float = parameter(0.025, 'physics step', low=0.001, high=0.05)
    start_east_m: float = parameter(0.0, 'start position, east', low=-1e5, high=1e5)
    start_north_m: float = parameter(0.0, 'start position, north', low=-1e5, high=1e5)
    wind_east_m_s: float = parameter(0.0, 'mean wind towards east', low=-30.0, high=30.0)
    wind_north_m_s: float = parameter(0.0, 'mean wind towards north', low=-30.0, high=30.0)
    gust_m_s: float = parameter(0.0, 'standard deviation of gusts', low=0.0, high=20.0)
    max_speed_m_s: float = parameter(10.0, 'fastest horizontal flight; drag and tilt end it near 11', low=0.1, high=50.0)
    acceleration_m_s2: float = parameter(3.0, 'how fast the autopilot changes velocity', low=0.1, high=30.0)
    jerk_m_s3: float = parameter(5.0, 'how fast the autopilot changes its acceleration', low=0.5, high=100.0)
    battery_s: float = parameter(1200.0, 'flight time of a full battery', low=10.0, high=100_000.0)
    setpoint_lead_s: float = parameter(
        0.0, 'simulated time waits (0.3 s at most) when it is this far ahead of the newest setpoint in motion; 0: never',
        low=0.0, high=60.0,
    )
    offboard_after_landing: bool = parameter(
        True, 'PX4 goes back to OFFBOARD after a landing out of it, as the real one; false: to LOITER once nothing streams',
    )
    drift_m_s: float = parameter(
        0.3, "standard deviation of PX4's velocity estimate, 0.3 on its SITL: it wanders where only velocity is commanded",
        low=0.0, high=5.0,
    )
    guided_timeout_s: float = parameter(3.0, 'setpoints older than this brake the vehicle (simulated time)', low=0.1, high=60.0)
    system_id: int = parameter(1, 'MAVLink system id of the vehicle', low=1, high=255)
    signing_key_file: str = parameter('', SIGNING_DOC)
    seed: int = same_as(LearnSettings, 'seed')


@dataclass(frozen=True)
class PilotConfig(PilotSettings, SeekConfig):
    """/pilot: a simulated demonstrator who flies through cmd_vel."""

    wish_file: str = parameter('', WISH_DOC)
    flights: int = parameter(1, 'demonstrations to fly', low=0, high=10_000)
    handle_vehicle: bool = parameter(True, 'arm, take off and land by the bridge services')
    heard_by: str = parameter(
        'recorder', 'nodes, by comma, that must count its commands on /diagnostics: until then it holds before its first move',
    )
    heard_timeout_s: float = parameter(
        10.0, 'longest hold for them (steady time); then it flies all the same', low=0.0, high=3600.0,
    )
    vehicle_timeout_s: float = parameter(
        180.0, 'longest wait for readiness, take-off, landing or a pose (steady time)', low=1.0, high=3600.0,
    )
    pose_timeout_s: float = parameter(0.5, 'no pose for this long: zero velocity (steady time)', low=0.05, high=60.0)
    seed: int = same_as(LearnSettings, 'seed')


@dataclass(frozen=True)
class TeleopConfig:
    """/teleop: a person flies by the arrow keys."""

    grid_file: str = parameter('', GRID_DOC + '; empty: no cells are shown')
    hysteresis_m: float = same_as(TrackerSettings, 'hysteresis_m')
    speed_m_s: float = parameter(1.0, 'speed while a key is held', low=0.05, high=20.0)
    climb_m_s: float = parameter(0.5, 'climb rate while a key is held', low=0.05, high=10.0)
    key_timeout_s: float = parameter(0.6, 'no key for this long: zero velocity (steady time)', low=0.05, high=10.0)
    rate_hz: float = parameter(20.0, 'rate of commands (steady time)', low=1.0, high=200.0)


@dataclass(frozen=True)
class ExpertConfig(ExpertSettings, OnObstacleMap):
    """/expert: a simulated person who knows the route and answers queries."""

    wish_file: str = parameter('', WISH_DOC + '; takes grid_file')
    thinking_time_s: float = parameter(0.0, 'pause before an answer', low=0.0, high=3600.0)
    seed: int = same_as(LearnSettings, 'seed')


@dataclass(frozen=True)
class ConsoleConfig:
    """/console: the web page for the person."""

    grid_file: str = parameter('', GRID_DOC + '; empty: the map comes with the first message that has one')
    port: int = parameter(8080, 'TCP port of the page on 127.0.0.1; 0: any that is free', low=0, high=65535)
    token: str = parameter('', 'secret in the address of the page; empty: a random one at each start')
    allowed_hosts: str = parameter('', 'comma-separated host names that a reverse proxy serves the page under (https)')
    rate_hz: float = parameter(20.0, 'updates of the page', low=1.0, high=60.0)
    language: str = parameter(
        '', "language of the page until somebody chooses another on it; empty: the browser's", choices=('', 'en', 'de'),
    )
    speed_m_s: float = parameter(1.0, 'speed at full stick, where a person flies from the page', low=0.05, high=20.0)
    climb_m_s: float = parameter(0.5, 'climb rate at full stick', low=0.05, high=10.0)
    mission_url: str = parameter(
        '', "MAVLink address at which the vehicle takes the route as its mission, not the bridge's; empty: it is not offered",
    )
    silence_s: float = parameter(3.0, 'a node that is silent for this long is shown as gone (steady time)', low=1.5, high=60.0)


@dataclass(frozen=True)
class LoggerConfig:
    """/logger: everything into one rosbag2-layout MCAP bag."""

    bag: str = parameter('', 'directory of the bag to write; it must not exist')
    topics: str = parameter('', 'comma-separated topic names or patterns (fnmatch); empty: everything that replay needs')
    compression: str = parameter('zstd', 'chunk compression', choices=('zstd', 'lz4', 'none'))
    flush_s: float = parameter(1.0, 'longest time that a message stays unwritten (steady time)', low=0.05, high=60.0)
    split_s: float = parameter(0.0, 'begin a new file of the bag after this much recorded time; 0: never', low=0.0, high=1e6)
    split_mib: int = parameter(0, 'begin a new file of the bag when one is this large; 0: never', low=0, high=1_048_576)
    min_free_mib: int = parameter(
        50, 'with less than this free on its disk the bag is finished and an alarm raised; 0: go on until the disk is full',
        low=0, high=1_048_576,
    )


NODES: Mapping[str, type[Any]] = {
    'recorder': RecorderConfig, 'advise': AdviseConfig, 'policy': PolicyConfig, 'mavlink_bridge': MavlinkBridgeConfig,
    'guard': GuardConfig, 'simulator': SimulatorConfig, 'pilot': PilotConfig, 'teleop': TeleopConfig, 'expert': ExpertConfig,
    'logger': LoggerConfig, 'console': ConsoleConfig,
}

# -- parameters that may be set while a node runs --------------------------------------------
AT_ONCE, NEXT_FLIGHT, NEXT_QUESTION = 'at once', 'from the next flight on', 'at once, with the next question'
_CHECKS = dict.fromkeys(('max_speed_m_s', 'max_climb_m_s', 'max_yaw_rate_rad_s', 'max_acceleration_m_s2', 'rate_hz'), AT_ONCE)
# Node -> parameter -> from when on a new value counts.
LIVE: Mapping[str, Mapping[str, str]] = {
    'policy': {
        'speed_m_s': NEXT_FLIGHT, 'climb_m_s': NEXT_FLIGHT, 'step_budget_factor': NEXT_FLIGHT, 'stop_on_loop': NEXT_FLIGHT,
        'start_reach_m': NEXT_FLIGHT, 'give_up_s': AT_ONCE,
    },
    'advise': {'enough': NEXT_QUESTION, 'budget': NEXT_QUESTION, 'demonstrations_min': AT_ONCE},
    'mavlink_bridge': _CHECKS,
    'guard': _CHECKS,
}
# Nodes with a life cycle take all others while they are unconfigured, but for what they need before.
MANAGED = ('policy', 'guard', 'mavlink_bridge')
BEFORE_CONFIGURE = ('autostart', 'clock', 'tf_child_frame')


def live(config_class: type[Any]) -> Mapping[str, str]:
    """Parameters that may be set while the node runs -> from when on a new value counts."""
    return LIVE.get(_node_of(config_class), {})


def counts_from(config_class: type[Any], name: str) -> str:
    """From when on a new value of a parameter counts, for people."""
    when = live(config_class).get(name)
    if when is not None:
        return when
    return 'read at configure' if at_configure(config_class, name) else 'read at the start'


def at_configure(config_class: type[Any], name: str) -> bool:
    """Whether a parameter is read when its node is configured, and so may be set before."""
    return _node_of(config_class) in MANAGED and name not in BEFORE_CONFIGURE


def _node_of(config_class: type[Any]) -> str:
    return next((name for name, owner in NODES.items() if owner is config_class), '')
