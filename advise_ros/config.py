"""Every node's parameters: one frozen dataclass a node, each field with unit, range and default.

The unit is the suffix of the name (_m, _m_s, _s, _hz, _ns); a field without suffix has none.
`ros/parameters.py` declares them to ROS with these descriptions; `config/*.yaml` repeats the defaults.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any, TypeVar

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.errors import InputError
from advise_ros.core.flight.start import START_REACH_M
from advise_ros.core.flight.velocity_law import SeekSettings

ConfigT = TypeVar('ConfigT')
Scalar = bool | int | float | str
# A choice that YAML, and so `-p name:=off`, reads as false.
YAML_OFF = 'off'


def param(
    default: Any,
    doc: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field with its range (both ends included) or its choices."""
    metadata = {'doc': doc, 'low': low, 'high': high, 'choices': choices}
    return field(default=default, metadata=metadata)


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
SIGNING_DOC = 'key of MAVLink 2 signing, readable by its owner only; frames without its signature are refused; empty: none'
AUTOSTART_DOC = 'become active at once; false: wait, unconfigured, for ros2 lifecycle set'
SEED_DOC = 'seed of every random choice'


@dataclass(frozen=True)
class RecorderConfig:
    """/recorder: samples -> demonstrations."""

    grid_file: str = param('', GRID_DOC)
    source: str = param('topics', 'where samples come from', choices=('topics', 'mavlink', 'tlog'))
    pose_source: str = param('pose', 'topic of positions when source is topics', choices=('pose', 'odom'))
    mavlink_url: str = param('udpin:127.0.0.1:14551', 'pymavlink connection when source is mavlink')
    tlog_file: str = param('', 'log to read when source is tlog')
    split: str = param(
        'flights', 'flights: from take-off to the final waypoint or landing; manual: recorder/start and stop',
        choices=('flights', 'manual'),
    )
    policy_flights: bool = param(False, 'flights of our own policy are demonstrations, too')
    hysteresis_m: float = param(0.2, 'how far past a border counts as the next cell', low=0.0, high=100.0)
    command_min_speed_m_s: float = param(0.1, 'slower commands have no direction', low=0.0, high=10.0)
    altitude_tolerance_m: float = param(1.0, 'samples further from the grid altitude are not on the route', low=0.1, high=1000.0)
    max_gap_s: float = param(
        2.0, 'a longer gap between samples is noted in the audit, and cells skipped in it are not guessed', low=0.05, high=3600.0,
    )
    command_timeout_s: float = param(0.5, 'an older command says nothing about a move', low=0.05, high=60.0)
    max_skip_cells: int = param(
        3, 'cells skipped between two samples that are filled in along a straight line', low=0, high=1000,
    )

    def discretise_settings(self) -> DiscretiseSettings:
        """The part that decides how samples become moves."""
        return DiscretiseSettings(**{spec.name: getattr(self, spec.name) for spec in fields(DiscretiseSettings)})


@dataclass(frozen=True)
class AdviseConfig:
    """/advise: demonstrations + advice -> policy and the next question."""

    grid_file: str = param('', GRID_DOC)
    session_file: str = param('', 'JSON lines file that keeps accepted answers over a restart; empty: none')
    demonstrations_min: int = param(1, 'demonstrations before the first policy', low=1, high=100_000)
    demonstrations_file: str = param('', 'demonstrations to start with (output of discretise); empty: none')
    learn_when: str = param(
        'demonstration', 'learn after each demonstration, or only when idle for learn_idle_s', choices=('demonstration', 'idle'),
    )
    learn_idle_s: float = param(1.0, 'quiet time before learning when learn_when is idle', low=0.0, high=3600.0)
    budget: int = param(-1, 'answers the person is willing to give, -1: unlimited', low=-1, high=1_000_000)
    reading: str = param(
        'replace', 'what advice does to a*: replace it and drop its demonstration rows, or the literal program',
        choices=('replace', 'literal'),
    )
    lambda_t: float = param(1000.0, 'weight of the demonstrations in equation (1)', low=0.0, high=1e9)
    lambda_a: float = param(500.0, 'weight of the advice in equation (1)', low=0.0, high=1e9)
    r_max: float = param(1.0, 'bound on the absolute value of a reward', low=1e-6, high=1e6)
    delta: float = param(0.1, 'margin that advice must have', low=0.0, high=1e6)
    margin_cap: float = param(0.2, 'cap on xi and zeta; 0: none', low=0.0, high=1e6)
    slack_cost: float = param(1000.0, 'cost of contradictory advice (elastic); 0: strict', low=0.0, high=1e9)
    gamma: float = param(0.95, 'discount', low=0.0, high=0.9999)
    method: str = param(
        'own', 'paper: what asks and learns as printed, whatever the other parameters say (config/paper.yaml)',
        choices=('own', 'paper'),
    )
    clustering: str = param(
        'k_means', 'how states become clusters: k_means as in the paper; connected: only states that a move joins; '
        'evidence: as long as their demonstrations speak for one behaviour', choices=('k_means', 'connected', 'evidence'),
    )
    clusters: int = param(
        6, 'clusters of states; about 1.5 a waypoint; 0: as many as the demonstrations tell apart', low=0, high=10_000,
    )
    cluster_features: float = param(
        1.0, 'weight of position and waypoint beside the action distribution; 0: none, as in the paper', low=0.0, high=100.0,
    )
    laplace: float = param(1.0, 'pseudo-count of each action', low=1e-9, high=1e6)
    temperature: float = param(0.1, 'Boltzmann temperature of the policy', low=1e-6, high=1e6)
    w_p: float = param(0.5, 'weight of F (demonstrations) against G (policy)', low=0.0, high=1.0)
    cluster_score: str = param('mean', 'U_c: mean (definition 4) or sum (algorithm 1)', choices=('mean', 'sum'))
    acquisition: str = param(
        'occupancy', 'what is asked about next: (paper) the highest U_c; where the policy flies and is unsure (occupancy), '
        'is not explained by the reward (unexplained), or demonstrations disagree (disagreement); mixed: occupancy, then '
        'paper; gain: the clusters, finer ones and single states whose answer is expected to put most right, '
        'and as occupancy where moves are fewer than 5 a state; belief: as gain, and the most likely right action is imitated '
        'instead of the most frequent one; site: what the map does not say is learnt, cells to keep out of on the way to all '
        'waypoints, and asked is what saves most steps',
        choices=('paper', 'occupancy', 'unexplained', 'mixed', 'disagreement', 'random', 'gain', 'belief', 'site'),
    )
    confirm: bool = param(
        True, 'ask once more after an answer that hardly any demonstration bears out; what is said most often holds',
    )
    enough: float = param(
        0.0, 'ask no more when the best question is worth less than this much disagreement a visit [nat^2]; with acquisition '
        'gain: this share of the visits; 0: never; with acquisition site: so many steps saved, and 0 means 0.25',
        low=0.0, high=100.0,
    )
    slip: float = param(0.0, 'probability that a move goes elsewhere in the transition model', low=0.0, high=0.9)
    solver: str = param(
        'auto', 'solver of the program: by size (auto), or one; cvxpy is the readable reference',
        choices=('auto', 'highs', 'piqp', 'qoco', 'clarabel', 'interior', 'interior-cholmod', 'cvxpy'),
    )
    seed: int = param(0, SEED_DOC, low=0, high=2**31 - 1)


@dataclass(frozen=True)
class SeekConfig:
    """Flying from cell centre to cell centre: shared by /policy and /pilot."""

    grid_file: str = param('', GRID_DOC)
    speed_m_s: float = param(1.2, 'cruise speed', low=0.05, high=20.0)
    approach_gain_1_s: float = param(
        1.5, 'speed per metre of distance near a centre; lower it where commands act late', low=0.05, high=20.0,
    )
    braking_m_s2: float = param(1.5, 'deceleration planned for before turns and stops', low=0.1, high=20.0)
    altitude_gain_1_s: float = param(0.8, 'climb rate per metre of altitude error', low=0.0, high=20.0)
    climb_m_s: float = param(1.0, 'fastest climb and descent', low=0.0, high=10.0)
    lead_s: float = param(0.5, 'positions are extrapolated by this to make up for delays', low=0.0, high=5.0)
    corner_share: float = param(0.1, 'how far past the centre a turn may swing out, as a share of a cell', low=0.0, high=0.5)
    arrival_radius_m: float = param(0.3, 'closer than this is at the centre', low=0.01, high=100.0)
    hysteresis_m: float = param(0.2, 'how far past a border counts as the next cell', low=0.0, high=100.0)

    def seek_settings(self) -> SeekSettings:
        """What the velocity law needs of this."""
        return SeekSettings(**{spec.name: getattr(self, spec.name) for spec in fields(SeekSettings)})


@dataclass(frozen=True)
class PolicyConfig(SeekConfig):
    """/policy: flies the policy from cell centre to cell centre."""

    step_budget_factor: float = param(2.0, 'steps before the battery is spent, times the shortest route', low=1.0, high=100.0)
    stop_on_loop: bool = param(True, 'end a flight as soon as a state comes back, not when its budget is spent')
    centre_first: bool = param(True, 'fly slowly to the centre of the cell before the route begins')
    start_reach_m: float = param(START_REACH_M, 'how far off the grid a flight may begin', low=0.0, high=100.0)
    pose_timeout_s: float = param(0.5, 'no pose for this long: zero velocity (steady time)', low=0.05, high=60.0)
    give_up_s: float = param(
        5.0, 'no pose for this long beyond pose_timeout_s ends the flight for good (steady time)', low=0.0, high=3600.0,
    )
    watchdog_rate_hz: float = param(50.0, 'rate of zero velocity while it holds (steady time)', low=1.0, high=200.0)
    autostart: bool = param(True, AUTOSTART_DOC)


@dataclass(frozen=True)
class ChecksConfig:
    """What /guard and the bridge check each command by."""

    grid_file: str = param('', GRID_DOC)
    max_speed_m_s: float = param(3.0, 'horizontal speed limit', low=0.05, high=50.0)
    max_climb_m_s: float = param(1.5, 'vertical speed limit', low=0.05, high=20.0)
    max_yaw_rate_rad_s: float = param(1.0, 'yaw rate limit', low=0.0, high=10.0)
    max_acceleration_m_s2: float = param(
        10.0, 'how fast a commanded velocity may grow (steady time); raise it where a simulation runs faster',
        low=0.1, high=10_000.0,
    )
    fence: str = param(
        'auto', 'auto: stand inside the fence of grid_file or fence_polygon, and refuse to become active without; off: none',
        choices=('auto', 'off'),
    )
    fence_polygon: str = param(
        '', "corners of the fence in metres east and north, '-2,-2 12,-2 12,12 -2,12'; empty: the grid with its margin",
    )
    fence_margin_m: float = param(1.0, 'how far past the grid the fence stands', low=0.0, high=1000.0)
    altitude_band_m: float = param(3.0, 'how far above or below the grid altitude the fence stands', low=0.1, high=1000.0)
    fence_low_m: float = param(0.0, 'lowest altitude of the fence; with fence_high_m in place of the band', low=-1000.0, high=1e4)
    fence_high_m: float = param(0.0, 'highest altitude of the fence; not above fence_low_m: the band counts', low=-1e3, high=1e4)
    braking_m_s2: float = param(2.0, 'deceleration assumed when stopping before the fence', low=0.1, high=50.0)
    vehicle_delay_s: float = param(
        0.2, 'delay of a position on its way here and of a command to its effect together, for the fence; of a slow link: '
        'its round trip', low=0.0, high=5.0,
    )
    command_timeout_s: float = param(0.5, 'an older command becomes zero velocity (steady time)', low=0.05, high=60.0)
    pose_timeout_s: float = param(0.5, 'an older pose makes zero velocity (steady time)', low=0.05, high=60.0)
    jump_m: float = param(2.0, 'a position that jumps further than this and flying explain is doubted; 0: no', low=0.0, high=1e4)
    return_inside: bool = param(
        True, 'bring a vehicle that is outside the fence back in (0.5 m/s, the shortest way), also when nobody commands; '
        'false: zero velocity',
    )
    latch: bool = param(False, 'a doubt about pose or command stops the vehicle until its release service is called')
    rate_hz: float = param(20.0, 'rate of checked commands (steady time); PX4 wants more than 2', low=5.0, high=200.0)
    autostart: bool = param(True, AUTOSTART_DOC)


@dataclass(frozen=True)
class GuardConfig(ChecksConfig):
    """/guard, for MAVROS and other bridges."""

    pose_frame: str = param('map', "frame that ENU poses say they are in; ArduPilot's DDS says base_link")


@dataclass(frozen=True)
class MavlinkBridgeConfig(ChecksConfig):
    """/mavlink_bridge: MAVLink <-> ROS; the guard's checks hold here too."""

    url: str = param('udpin:127.0.0.1:14550', 'pymavlink connection string: udpin:, udpout:, tcp:, tcpin:, or a serial device')
    baud: int = param(115200, 'baud rate of a serial link', low=1200, high=10_000_000)
    system_id: int = param(1, 'our MAVLink system id', low=1, high=255)
    component_id: int = param(191, 'our MAVLink component id (191: onboard computer)', low=1, high=255)
    signing_key_file: str = param('', SIGNING_DOC)
    target_system: int = param(0, 'system id of the vehicle; 0: the first multicopter that is heard', low=0, high=255)
    pose_rate_hz: float = param(20.0, 'positions asked of the autopilot', low=1.0, high=200.0)
    clock: str = param(
        'ros', "autopilot: publishes the autopilot's time on /clock, for a SITL not in real time; set use_sim_time on all others",
        choices=('ros', 'autopilot'),
    )
    takeoff_altitude_m: float = param(0.0, 'take-off altitude; 0: the grid altitude', low=0.0, high=500.0)
    heartbeat_timeout_s: float = param(3.0, 'no heartbeat for this long: link lost (steady time)', low=0.5, high=60.0)
    ready_timeout_s: float = param(120.0, 'longest wait for readiness before a take-off (steady time)', low=1.0, high=3600.0)


@dataclass(frozen=True)
class SimulatorConfig:
    """/simulator: a quadcopter by RotorPy behind MAVLink 2."""

    autopilot: str = param(
        'ardupilot', 'whose manners it has: ArduCopter in GUIDED or PX4 in OFFBOARD', choices=('ardupilot', 'px4'),
    )
    endpoint: str = param('udpout:127.0.0.1:14550', 'udpout:host:port, udpin:host:port or tcpin:host:port')
    second_endpoint: str = param('', 'another link with its own message rates, for a ground station or a second companion')
    speedup: float = param(1.0, 'simulated seconds a second; 0: as fast as it goes', low=0.0, high=1000.0)
    publish_clock: bool = param(True, 'publish /clock')
    clock_rate_hz: float = param(100.0, 'most /clock messages a second (steady time)', low=1.0, high=1000.0)
    ready_after_s: float = param(42.0, 'simulated time until it may be armed', low=0.0, high=600.0)
    step_s: float = param(0.025, 'physics step', low=0.001, high=0.05)
    start_east_m: float = param(0.0, 'start position, east', low=-1e5, high=1e5)
    start_north_m: float = param(0.0, 'start position, north', low=-1e5, high=1e5)
    wind_east_m_s: float = param(0.0, 'mean wind towards east', low=-30.0, high=30.0)
    wind_north_m_s: float = param(0.0, 'mean wind towards north', low=-30.0, high=30.0)
    gust_m_s: float = param(0.0, 'standard deviation of gusts', low=0.0, high=20.0)
    max_speed_m_s: float = param(10.0, 'fastest horizontal flight; drag and tilt end it near 11', low=0.1, high=50.0)
    acceleration_m_s2: float = param(3.0, 'how fast the autopilot changes velocity', low=0.1, high=30.0)
    battery_s: float = param(1200.0, 'flight time of a full battery', low=10.0, high=100_000.0)
    setpoint_lead_s: float = param(
        0.0, 'simulated time waits (0.1 s at most) when it is this far ahead of the newest setpoint in motion; 0: never',
        low=0.0, high=60.0,
    )
    offboard_after_landing: bool = param(
        True, 'PX4 goes back to OFFBOARD after a landing out of it, as the real one; false: to LOITER once nothing streams',
    )
    drift_m_s: float = param(
        0.3, "standard deviation of PX4's velocity estimate, 0.3 on its SITL: it wanders where only velocity is commanded",
        low=0.0, high=5.0,
    )
    guided_timeout_s: float = param(3.0, 'setpoints older than this brake the vehicle (simulated time)', low=0.1, high=60.0)
    system_id: int = param(1, 'MAVLink system id of the vehicle', low=1, high=255)
    signing_key_file: str = param('', SIGNING_DOC)
    seed: int = param(0, SEED_DOC, low=0, high=2**31 - 1)


@dataclass(frozen=True)
class PilotConfig(SeekConfig):
    """/pilot: a simulated demonstrator who flies through cmd_vel."""

    flights: int = param(1, 'demonstrations to fly', low=0, high=10_000)
    noise_rate: float = param(0.4, 'share of moves that are not the right one', low=0.0, high=0.95)
    mistake_share: float = param(0.2, 'share of states in which the same mistake is made again and again', low=0.0, high=1.0)
    max_moves: int = param(400, 'moves before a flight is given up', low=1, high=1_000_000)
    handle_vehicle: bool = param(True, 'arm, take off and land by the bridge services')
    heard_by: str = param(
        'recorder', 'nodes, by comma, that must count its commands on /diagnostics: until then it holds before its first move',
    )
    heard_timeout_s: float = param(10.0, 'longest hold for them (steady time); then it flies all the same', low=0.0, high=3600.0)
    vehicle_timeout_s: float = param(
        180.0, 'longest wait for readiness, take-off, landing or a pose (steady time)', low=1.0, high=3600.0,
    )
    pose_timeout_s: float = param(0.5, 'no pose for this long: zero velocity (steady time)', low=0.05, high=60.0)
    watchdog_rate_hz: float = param(20.0, 'rate of the watchdog (steady time)', low=1.0, high=200.0)
    seed: int = param(0, SEED_DOC, low=0, high=2**31 - 1)


@dataclass(frozen=True)
class TeleopConfig:
    """/teleop: a person flies by the arrow keys."""

    grid_file: str = param('', GRID_DOC + '; empty: no cells are shown')
    hysteresis_m: float = param(0.2, 'how far past a border counts as the next cell', low=0.0, high=100.0)
    speed_m_s: float = param(1.0, 'speed while a key is held', low=0.05, high=20.0)
    climb_m_s: float = param(0.5, 'climb rate while a key is held', low=0.05, high=10.0)
    key_timeout_s: float = param(0.6, 'no key for this long: zero velocity (steady time)', low=0.05, high=10.0)
    rate_hz: float = param(20.0, 'rate of commands (steady time)', low=1.0, high=200.0)


@dataclass(frozen=True)
class ExpertConfig:
    """/expert: a simulated person who knows the route and answers queries."""

    grid_file: str = param('', GRID_DOC)
    expert_id: str = param('simulated-expert', 'name in the log of answers')
    error_rate: float = param(0.0, 'share of answers that are wrong', low=0.0, high=1.0)
    skip_rate: float = param(0.0, 'share of queries that are skipped', low=0.0, high=1.0)
    prefer: str = param(
        'majority', 'preferred actions: optimal in most states (plurality), or also those optimal in at least half of them',
        choices=('majority', 'plurality'),
    )
    avoid: str = param(
        'never_optimal', 'avoided actions: never optimal in the cluster, or all that are not preferred',
        choices=('never_optimal', 'all_others'),
    )
    thinking_time_s: float = param(0.0, 'pause before an answer', low=0.0, high=3600.0)
    seed: int = param(0, SEED_DOC, low=0, high=2**31 - 1)


@dataclass(frozen=True)
class ConsoleConfig:
    """/console: the web page for the person."""

    grid_file: str = param('', GRID_DOC + '; empty: the map comes with the first message that has one')
    port: int = param(8080, 'TCP port of the page on 127.0.0.1; 0: any that is free', low=0, high=65535)
    token: str = param('', 'secret in the address of the page; empty: a random one at each start')
    allowed_hosts: str = param('', 'comma-separated host names that a reverse proxy serves the page under (https)')
    rate_hz: float = param(20.0, 'updates of the page', low=1.0, high=60.0)
    silence_s: float = param(3.0, 'a node that says nothing for this long is shown as gone (steady time)', low=1.5, high=60.0)


@dataclass(frozen=True)
class LoggerConfig:
    """/logger: everything into one rosbag2-layout MCAP bag."""

    bag: str = param('', 'directory of the bag to write; it must not exist')
    topics: str = param('', 'comma-separated topic names or patterns (fnmatch); empty: everything that replay needs')
    compression: str = param('zstd', 'chunk compression', choices=('zstd', 'lz4', 'none'))
    chunk_kib: int = param(768, 'chunk size', low=1, high=1_048_576)
    flush_s: float = param(1.0, 'longest time that a message stays unwritten (steady time)', low=0.05, high=60.0)
    split_s: float = param(0.0, 'begin a new file of the bag after this much recorded time; 0: never', low=0.0, high=1e6)
    split_mib: int = param(0, 'begin a new file of the bag when one is this large; 0: never', low=0, high=1_048_576)
    min_free_mib: int = param(
        50, 'with less than this free on its disk the bag is finished and an alarm raised; 0: go on until the disk is full',
        low=0, high=1_048_576,
    )
