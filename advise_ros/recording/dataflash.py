"""ArduPilot's own logs (dataflash: .BIN, and .log as text) -> samples of a flight.

A log tells its own format: FMT messages name the fields of each type. Only the few types with positions, setpoints and
states are looked at, so reading takes a small part of what a general parser needs.
Format: https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html, messages:
https://ardupilot.org/copter/docs/logmessages.html.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import Arrivals, CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.errors import LogError
from advise_ros.mavlink.ardupilot import MODES
from advise_ros.mavlink.frames import enu_rows_from_ned
from advise_ros.recording.autopilot_log import NO_PLACE, NS_PER_US, Change, events_of
from advise_ros.recording.columns import Growing
from advise_ros.recording.place import Place
from advise_ros.recording.progress import ProgressCallback

MARK = b'\xa3\x95'
HEADER, FORMAT, LONGEST = 3, 128, 256
# Name and fields of the messages that are looked at; a log may lack some.
WANTED = {
    'XKF1': ('C', 'PN', 'PE', 'PD'), 'NKF1': ('C', 'PN', 'PE', 'PD'), 'XKF4': ('PI',), 'NKF4': ('PI',),
    'POS': ('Lat', 'Lng', 'RelHomeAlt', 'RelOriginAlt'), 'ORGN': ('Type', 'Lat', 'Lng'),
    'GPS': ('I', 'Status', 'Lat', 'Lng', 'Alt'),
    'GUIP': ('Type', 'vX', 'vY', 'vZ', 'aX'), 'GUID': ('Type', 'vX', 'vY', 'vZ', 'aX'),
    'MODE': ('Mode', 'ModeNum'), 'ARM': ('ArmState',), 'EV': ('Id',), 'FMTU': ('FmtType', 'MultIds'), 'MULT': ('Id', 'Mult'),
}  # fmt: skip
KINDS = {
    'a': 'S64', 'b': 'i1', 'B': 'u1', 'h': '<i2', 'H': '<u2', 'i': '<i4', 'I': '<u4', 'f': '<f4', 'd': '<f8', 'g': '<f2',
    'n': 'S4', 'N': 'S16', 'Z': 'S64', 'c': '<i2', 'C': '<u2', 'e': '<i4', 'E': '<u4', 'L': '<i4', 'M': 'u1', 'q': '<i8',
    'Q': '<u8',
}  # fmt: skip
SCALES = {'c': 0.01, 'C': 0.01, 'e': 0.01, 'E': 0.01, 'L': 1e-7}
TIMES = {'TimeUS': NS_PER_US, 'TimeMS': 1_000_000}
# Numbers of events: https://ardupilot.org/copter/docs/logmessages.html#ev
ARMED, DISARMED, LAND_COMPLETE, NOT_LANDED = 10, 11, 18, 28
EVENTS: dict[int, dict[str, bool]] = {
    ARMED: {'armed': True}, DISARMED: {'armed': False}, LAND_COMPLETE: {'in_air': False}, NOT_LANDED: {'in_air': True},
}
# Types of GUIP and GUID with a velocity, in logs with an acceleration (since 4.1) and before.
VELOCITIES, OLDER_VELOCITIES = (3, 4), (2, 3)
EKF_ORIGIN = 0
FIX_3D = 3
# Read so much at a time.
WINDOW = 8 * 1024 * 1024

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
# Stamps, places in the log, and positions.
_Positions = tuple[Integers, Integers, Floats]


class MessageFormat(NamedTuple):
    """A type of message as FMT describes it."""

    number: int
    size: int
    name: str
    kinds: str
    fields: tuple[str, ...]

    @property
    def dtype(self) -> np.dtype[Any]:
        """Its bytes, the header included."""
        kinds = [(field, KINDS[kind]) for field, kind in zip(self.fields, self.kinds, strict=False) if kind in KINDS]
        return np.dtype([('header', 'S3'), *kinds])


class Table:
    """The messages of one type: their stamps, their places in the log, and the wanted fields as float64."""

    def __init__(self, format_of: MessageFormat) -> None:
        self.number, dtype = format_of.number, format_of.dtype
        self._time = next((name for name in TIMES if name in format_of.fields), '')
        self._texts = dict(zip(format_of.fields, format_of.kinds, strict=False))
        self._dtype = dtype if dtype.itemsize <= format_of.size and self._time else None
        self._stamps_ns, self._places = Growing(np.int64), Growing(np.int64)
        self._values = {
            name: Growing(dtype[name] if self._texts[name] in 'NZn' else np.float64)
            for name in WANTED[format_of.name] if self._dtype is not None and name in (dtype.names or ())
        }

    def take(self, data: bytes, offsets: list[int], first: int) -> None:
        """Messages at offsets of a window that begins at `first` in the log."""
        if self._dtype is None:
            return
        at = np.array(offsets, dtype=np.int64)
        rows = np.ndarray((len(data) - self._dtype.itemsize + 1,), self._dtype, data, strides=(1,))[at]
        self.add(rows[self._time].astype(np.int64) * TIMES[self._time], first + at, {
            name: rows[name] * SCALES[self._texts[name]] if self._texts[name] in SCALES else rows[name] for name in self._values
        })

    def add(self, stamps_ns: Integers, places: Integers, values: dict[str, Any]) -> None:
        """Rows with stamps, places and fields."""
        self._stamps_ns.add(stamps_ns)
        self._places.add(places)
        for name, growing in self._values.items():
            growing.add(values[name])

    @property
    def stamps_ns(self) -> Integers:
        """(n,) since the autopilot began."""
        return self._stamps_ns.whole()

    @property
    def places(self) -> Integers:
        """(n,) where they lie in the log."""
        return self._places.whole()

    def index_of(self, field: str) -> int:
        """Which of the message's fields it is."""
        return list(self._texts).index(field)

    def has(self, *names: str) -> bool:
        """Whether there are messages with these fields."""
        return len(self.stamps_ns) > 0 and all(name in self._values for name in names)

    def __getitem__(self, name: str) -> Any:
        """(n,) values of a field, in the units of the log's documentation; zeros where the log has no such field."""
        return self._values[name].whole() if name in self._values else np.zeros(len(self.stamps_ns))

    def rows(self, *names: str) -> Floats:
        """(n, len(names)) fields side by side."""
        return np.column_stack([self[name] for name in names])


class Log:
    """The wanted messages of a log, by the names of their types.

    Attributes:
        n_messages: of any type.
        skipped_bytes, cut_bytes: what no message could be made of, within and at the end.
    """

    def __init__(self) -> None:
        self.n_messages = self.skipped_bytes = self.cut_bytes = 0
        self._tables: dict[str, Table] = {}
        self.sizes = [0] * LONGEST
        self.sizes[FORMAT] = 89
        self.wanted: dict[int, Table] = {}

    def define(self, form: MessageFormat) -> None:
        """Take up the format of a type."""
        self.sizes[form.number] = form.size if form.size >= HEADER else 0
        if form.name in WANTED and form.name not in self._tables and set(form.kinds) <= KINDS.keys():
            self.wanted[form.number] = self._tables[form.name] = Table(form)

    def __getitem__(self, name: str) -> Table:
        """The messages of a type; none where the log has none."""
        return self._tables.get(name) or Table(MessageFormat(0, LONGEST, name, '', ()))


def read_dataflash(path: str | Path, place: Place | None = None, progress: ProgressCallback | None = None) -> Recording:
    """Positions, velocity setpoints and state of the vehicle in an ArduPilot log, stamped since its start.

    Positions are the estimator's (XKF1 or NKF1 of the primary core), else POS, else GPS. Setpoints are the velocities
    of GUIDED (GUIP). What is damaged or cut off is stepped over and noted.

    Args:
        path: a .BIN, or a .log as text.
        place: of the grid on the earth; None: the estimator's origin is that of the grid.
        progress: called now and then with bytes read and bytes in all.

    Raises:
        LogError: the file cannot be read, is no such log, or has no positions.
    """
    log = Log()
    try:
        with Path(path).open('rb') as file:
            text = file.read(4) == b'FMT,'
            size = file.seek(0, 2)
            file.seek(0)
            _read_text(file, log) if text else _read_binary(file, size, log, progress)
    except OSError as problem:
        raise LogError(f'{path} cannot be read ({problem.strerror}); name another recording') from None
    if log.n_messages < 2:
        raise LogError(f'{path} is not an ArduPilot log: no message in {size} bytes; name a .BIN as the autopilot writes it')
    try:
        return _recording(path, log, place)
    except LogError as problem:
        raise LogError(f'{path}: {problem}') from None


# -- messages --------------------------------------------------------------------------------------
def _read_binary(file: Any, size: int, log: Log, progress: ProgressCallback | None) -> None:
    data, first = b'', 0
    while more := file.read(WINDOW):
        data += more
        used = _take_window(data, first, log, last=first + len(data) >= size)
        data, first = data[used:], first + used
        if progress is not None:
            progress(first, size)
    log.cut_bytes = len(data)


def _take_window(data: bytes, first: int, log: Log, *, last: bool) -> int:
    """Take the messages of a window; returns how many bytes of it are done with.

    What no other message follows is not believed: it may be a part of what is damaged.
    """
    offsets: dict[int, list[int]] = {number: [] for number in log.wanted}
    sizes, end = log.sizes, len(data) - HEADER
    at, before = 0, -1
    while at <= end:
        kind = data[at + 2]
        length = sizes[kind]
        if data[at] == 0xA3 and data[at + 1] == 0x95 and length:
            if at + length > len(data):
                break
            if kind in offsets:
                offsets[kind].append(at)
            elif kind == FORMAT and (form := _format(data, at)) is not None:
                log.define(form)
                if form.number in log.wanted:
                    offsets.setdefault(form.number, [])
            log.n_messages += 1
            before, at = at, at + length
            continue
        if before >= 0:
            log.n_messages -= 1
            rows = offsets.get(data[before + 2])
            if rows and rows[-1] == before:
                rows.pop()
            log.skipped_bytes += at - before
            before = -1
        after = data.find(MARK, at + 1)
        after = after if after >= 0 else (len(data) if last else end)
        log.skipped_bytes += after - at
        at = after
    for number, found in offsets.items():
        log.wanted[number].take(data, found, first)
    return min(at, len(data))


def _format(data: bytes, at: int) -> MessageFormat | None:
    number, size = data[at + 3], data[at + 4]
    cuts = (data[at + begin : at + end].split(b'\0', 1)[0] for begin, end in ((5, 9), (9, 25), (25, 89)))
    name, kinds, fields = (cut.decode('ascii', 'replace') for cut in cuts)
    return MessageFormat(number, size, name, kinds, tuple(fields.split(','))) if name else None


def _read_text(file: Iterable[bytes], log: Log) -> None:
    """A log that was converted to text: one message a line, with commas, in the units of the documentation."""
    by_name: dict[str, tuple[MessageFormat, list[tuple[int, list[str]]]]] = {}
    for number, line in enumerate(file):
        name, *words = line.decode('utf-8', 'replace').strip().split(', ')
        if name == 'FMT' and len(words) >= 5 and words[0].isdecimal() and words[1].isdecimal():
            fields = tuple(field.strip() for field in ','.join(words[4:]).split(','))
            form = MessageFormat(int(words[0]), int(words[1]), words[2], words[3], fields)
            log.define(form)
            if form.name in WANTED:
                by_name.setdefault(form.name, (form, []))
        elif name in by_name and len(words) == len(by_name[name][0].fields):
            by_name[name][1].append((number, words))
        log.n_messages += 1
    for name, (form, rows) in by_name.items():
        _take_rows(log[name], form, rows)


def _take_rows(table: Table, form: MessageFormat, rows: list[tuple[int, list[str]]]) -> None:
    time = next((name for name in TIMES if name in form.fields), '')
    if not time or form.name in ('FMTU', 'MULT'):  # Text is in its units already.
        return
    columns = {field: [words[index] for _, words in rows] for index, field in enumerate(form.fields)}
    values = {field: np.array([_number(word) for word in columns[field]]) for field in WANTED[form.name] if field in columns}
    stamps_ns = np.array([round(_number(word) * TIMES[time]) for word in columns[time]], dtype=np.int64)
    table.add(stamps_ns, np.array([number for number, _ in rows], dtype=np.int64), values)


def _number(word: str) -> float:
    """Modes may stand there by their names."""
    try:
        return float(word)
    except ValueError:
        return float(next((number for number, name in MODES.items() if name == word.upper()), np.nan))


# -- samples ---------------------------------------------------------------------------------------
def _recording(path: str | Path, log: Log, place: Place | None) -> Recording:
    said: list[str] = []
    stamps_ns, places, positions = _positions(log, place, said)
    commands, commanded = _commands(log, place, said)
    events, changed = events_of(_changes(log), _begin(log))
    if log.cut_bytes:
        said.append(f'the last message is cut off ({log.cut_bytes} bytes)')
    if log.skipped_bytes:
        said.append(f'{log.skipped_bytes} bytes are no sound messages and were skipped')
    arrived = (np.searchsorted(places, of) for of in (commanded, changed, np.empty(0, dtype=np.int64)))
    return Recording(
        PoseSamples(stamps_ns, positions), commands, events, source=str(path), notes=tuple(said), arrivals=Arrivals(*arrived),
    )


def _positions(log: Log, place: Place | None, said: list[str]) -> _Positions:
    for name, primary in (('XKF1', 'XKF4'), ('NKF1', 'NKF4')):
        if log[name].has('PN', 'PE', 'PD'):
            return _of_estimator(log, log[name], log[primary], place, said)
    pos, origins = log['POS'], log['ORGN']
    if pos.has('Lat', 'Lng'):
        around = place or _origin(origins)
        if around is not None:
            height = 'RelHomeAlt' if place is not None or not pos.has('RelOriginAlt') else 'RelOriginAlt'
            return pos.stamps_ns, pos.places, around.positions(pos['Lat'], pos['Lng'], pos[height])
    gps = log['GPS']
    if gps.has('Lat', 'Lng', 'Alt') and place is not None:
        return _of_gps(gps, place, said)
    if gps.has('Lat') or pos.has('Lat'):
        raise LogError(
            'it has places on the earth only (POS, GPS), none relative to an origin; '
            "add the grid's place to the grid file: origin_wgs84: [latitude, longitude]"
        )
    raise LogError('it has no positions (XKF1, NKF1, POS or GPS); log them (LOG_BITMASK) and fly again')


def _of_estimator(log: Log, table: Table, primary: Table, place: Place | None, said: list[str]) -> _Positions:
    """Of the primary core: its number stands in the messages of the kind `primary`, of the newest before each position."""
    wanted: Any = 0
    if primary.has('PI'):
        wanted = primary['PI'][np.maximum(np.searchsorted(primary.places, table.places) - 1, 0)]
    rows = table['C'] == wanted
    positions = enu_rows_from_ned(table.rows('PN', 'PE', 'PD')[rows])
    stamps_ns, places = table.stamps_ns[rows], table.places[rows]
    origins = log['ORGN']
    mine = origins['Type'] == EKF_ORIGIN
    if place is not None and mine.any():
        at = np.maximum(np.searchsorted(origins.places[mine], places) - 1, 0)
        positions = place.moved(positions, origins['Lat'][mine][at], origins['Lng'][mine][at])
    elif place is not None:
        said.append(NO_PLACE)
    return stamps_ns, places, positions


def _origin(origins: Table) -> Place | None:
    mine = origins['Type'] == EKF_ORIGIN
    return Place(float(origins['Lat'][mine][0]), float(origins['Lng'][mine][0])) if mine.any() else None


def _of_gps(gps: Table, place: Place, said: list[str]) -> _Positions:
    rows = (gps['I'] == 0) & (gps['Status'] >= FIX_3D)
    heights_m = gps['Alt'][rows]
    said.append('positions are those of its GPS, heights those above its first fix')
    heights_m = heights_m - heights_m[0] if heights_m.size else heights_m
    return gps.stamps_ns[rows], gps.places[rows], place.positions(gps['Lat'][rows], gps['Lng'][rows], heights_m)


def _commands(log: Log, place: Place | None, said: list[str]) -> tuple[CommandSamples, Integers]:
    name = 'GUIP' if log['GUIP'].has('vX') else 'GUID'
    table = log[name]
    kinds = VELOCITIES if table.has('aX') else OLDER_VELOCITIES
    rows = np.isin(table['Type'], kinds)
    others = len(rows) - int(rows.sum())
    if others:
        said.append(f'{others} setpoints without a velocity ({name}) were not used')
    north_east_up = table.rows('vX', 'vY', 'vZ')[rows] * _scale(log, table)
    velocities = north_east_up[:, [1, 0, 2]]
    if place is not None:
        velocities = place.turned(velocities)
    return CommandSamples(table.stamps_ns[rows], velocities), table.places[rows]


def _scale(log: Log, table: Table) -> float:
    """What a velocity is to be multiplied with to be in m/s: older versions log cm/s, and FMTU says so."""
    units, multipliers = log['FMTU'], log['MULT']
    mine = np.flatnonzero(units['FmtType'] == table.number)
    if not mine.size or not multipliers.has('Id', 'Mult'):
        return 1.0
    letters = bytes(units['MultIds'][mine[-1]])
    return _multiplier(letters, table, multipliers)


def _multiplier(letters: bytes, table: Table, multipliers: Table) -> float:
    index = table.index_of('vX')
    known = {int(number): float(value) for number, value in multipliers.rows('Id', 'Mult')}
    return known.get(letters[index], 1.0) or 1.0 if index < len(letters) else 1.0


def _changes(log: Log) -> Iterator[Change]:
    modes, arms, events = log['MODE'], log['ARM'], log['EV']
    numbers = modes['ModeNum'] if modes.has('ModeNum') else modes['Mode']
    for stamp_ns, place, number in zip(modes.stamps_ns.tolist(), modes.places.tolist(), numbers.tolist(), strict=True):
        yield stamp_ns, place, {'mode': MODES.get(int(number), f'mode {int(number):#x}') if np.isfinite(number) else ''}
    for stamp_ns, place, armed in zip(arms.stamps_ns.tolist(), arms.places.tolist(), arms['ArmState'].tolist(), strict=True):
        yield stamp_ns, place, {'armed': bool(armed)}
    for stamp_ns, place, number in zip(events.stamps_ns.tolist(), events.places.tolist(), events['Id'].tolist(), strict=True):
        if int(number) in EVENTS:
            yield stamp_ns, place, EVENTS[int(number)]


def _begin(log: Log) -> VehicleEvent:
    """The state before the first change: the opposite of what changed first. A log without arming began with it."""
    changes = sorted(_changes(log), key=lambda change: change[1])
    armed = next((changed['armed'] for _, _, changed in changes if 'armed' in changed), None)
    in_air = next((changed['in_air'] for _, _, changed in changes if 'in_air' in changed), None)
    return VehicleEvent(0, armed is not True, None if in_air is None else not in_air, autopilot='ardupilot')
