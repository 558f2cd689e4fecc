"""PX4's own logs (ULog, .ulg), parsed by pyulog -> samples of a flight.

Messages: https://docs.px4.io/main/en/msg_docs/. Format: https://docs.px4.io/main/en/dev_log/ulog_file_format.html.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from io import BufferedReader, FileIO
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import NO_COMMANDS, CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.errors import LogError
from advise_ros.mavlink.frames import enu_rows_from_ned
from advise_ros.recording.autopilot_log import NO_PLACE, NS_PER_US, Change, events_of
from advise_ros.recording.place import Place
from advise_ros.recording.progress import ProgressCallback
from advise_ros.recording.states import PX4_ARMED, PX4_MODES

POSITION, STATUS, LANDED, SETPOINT = (
    'vehicle_local_position', 'vehicle_status', 'vehicle_land_detected', 'trajectory_setpoint',
)
# The velocity in a setpoint, in today's logs and in those before PX4 1.14.
VELOCITIES = (('velocity[0]', 'velocity[1]', 'velocity[2]'), ('vx', 'vy', 'vz'))

# pyulog reads a few bytes at a time.
BUFFER = 1024 * 1024
# Before all messages, and before each.
FILE_HEAD_BYTES, HEAD_BYTES = 16, 3

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
# Field -> (n,) values of a topic.
Columns = Mapping[str, npt.NDArray[Any]]


class _WatchedFile(FileIO):
    """A log that says how far it was read; a buffer in front of it asks for BUFFER bytes at a time."""

    def __init__(self, path: Path, progress: ProgressCallback | None) -> None:
        super().__init__(path)
        self._progress, self._size, self._read = progress, path.stat().st_size, 0

    def readinto(self, buffer: Any, /) -> int | None:
        count = super().readinto(buffer)
        self._read += count or 0
        if self._progress is not None and count:
            self._progress(self._read, self._size)
        return count


def _is_cut(path: Path) -> bool:
    """Whether the last message is shorter than its head says; heads of two bytes of length and one of type follow each other."""
    with path.open('rb') as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
        at, size = FILE_HEAD_BYTES, len(data)
        while at + HEAD_BYTES <= size:
            at += HEAD_BYTES + data[at] + 256 * data[at + 1]
    return at != size


def read_ulog(path: str | Path, place: Place | None = None, progress: ProgressCallback | None = None) -> Recording:
    """Positions, velocity setpoints and state of the vehicle in a PX4 log, stamped since its start.

    Positions are those of vehicle_local_position, where they are valid; setpoints are the velocities that
    trajectory_setpoint has.

    Args:
        path: the log.
        place: of the grid on the earth; None: PX4's local origin is that of the grid.
        progress: called now and then with bytes read and bytes in all.

    Raises:
        LogError: the file cannot be read, is no such log, or has no positions.
    """
    from pyulog import ULog  # noqa: PLC0415  few need it

    try:
        with BufferedReader(_WatchedFile(Path(path), progress), BUFFER) as file:
            log: Any = ULog(file, [POSITION, STATUS, LANDED, SETPOINT], disable_str_exceptions=True)
        cut = not log.file_corruption and _is_cut(Path(path))
    except OSError as problem:
        raise LogError(f'{path} cannot be read ({problem.strerror}); name another recording') from None
    except Exception as problem:  # pyulog lets many types through for damaged files
        raise LogError(f'{path} is not a whole PX4 log ({str(problem) or type(problem).__name__}); copy it again') from problem
    topics = {data.name: data.data for data in reversed(log.data_list) if len(data.data['timestamp'])}
    if POSITION not in topics:
        raise LogError(f'{path} has no {POSITION}; log it (SDLOG_PROFILE) and fly again')
    try:
        return _recording(path, topics, place, _damages(log, cut=cut))
    except LogError as problem:
        raise LogError(f'{path}: {problem}') from None


def _damages(log: Any, *, cut: bool) -> list[str]:
    lost_ms = sum(dropout.duration for dropout in log.dropouts)
    said = [f'the autopilot lost {lost_ms / 1000:.2f} s of its log ({len(log.dropouts)} dropouts)'] if log.dropouts else []
    said += ['the last message is cut off'] * cut
    return said + ['it is damaged; what is whole was read'] * bool(log.file_corruption)


def _recording(path: str | Path, topics: Mapping[str, Columns], place: Place | None, said: list[str]) -> Recording:
    position = topics[POSITION]
    positions = enu_rows_from_ned(_rows(position, ('x', 'y', 'z')))
    for valid, columns in (('xy_valid', [0, 1]), ('z_valid', [2])):
        if valid in position:
            positions[np.ix_(position[valid] == 0, columns)] = np.nan
    if place is not None:
        positions = _on_earth(position, positions, place, said)
    commands = _commands(topics.get(SETPOINT), place, said)
    events, _ = events_of(_changes(topics), VehicleEvent(0, STATUS not in topics, None, autopilot='px4'))
    return Recording(PoseSamples(_stamps_ns(position), positions), commands, events, source=str(path), notes=tuple(said))


def _on_earth(position: Columns, positions: Floats, place: Place, said: list[str]) -> Floats:
    """From the reference of each position."""
    if 'ref_lat' not in position or not (known := position['ref_lat'] != 0).any():
        said.append(NO_PLACE)
        return positions
    positions[~(known & (position.get('xy_global', known) != 0))] = np.nan
    return place.moved(positions, np.asarray(position['ref_lat'], np.float64), np.asarray(position['ref_lon'], np.float64))


def _commands(setpoint: Columns | None, place: Place | None, said: list[str]) -> CommandSamples:
    fields = next((names for names in VELOCITIES if setpoint is not None and names[0] in setpoint), None)
    if setpoint is None or fields is None:
        return NO_COMMANDS
    velocities = enu_rows_from_ned(_rows(setpoint, fields))
    rows: npt.NDArray[np.bool_] = np.isfinite(velocities[:, :2].sum(axis=1))
    if not rows.all():
        said.append(f'{len(rows) - int(rows.sum())} setpoints without a velocity ({SETPOINT}) were not used')
    velocities = np.nan_to_num(velocities[rows])
    return CommandSamples(_stamps_ns(setpoint)[rows], velocities if place is None else place.turned(velocities))


def _changes(topics: Mapping[str, Columns]) -> Iterator[Change]:
    """In the order of their stamps."""
    status, landed = topics.get(STATUS), topics.get(LANDED)
    if status is not None:
        for stamp_ns, arming, mode in zip(
            _stamps_ns(status).tolist(), status['arming_state'].tolist(), status['nav_state'].tolist(), strict=True,
        ):
            yield stamp_ns, stamp_ns, {'armed': arming == PX4_ARMED, 'mode': PX4_MODES.get(mode, f'mode {mode}')}
    if landed is not None:
        for stamp_ns, on_ground in zip(_stamps_ns(landed).tolist(), landed['landed'].tolist(), strict=True):
            yield stamp_ns, stamp_ns, {'in_air': not on_ground}


def _stamps_ns(columns: Columns) -> Integers:
    return columns['timestamp'].astype(np.int64) * NS_PER_US


def _rows(columns: Columns, names: tuple[str, ...]) -> Floats:
    return np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names])
