"""The wanted messages of a telemetry log as columns: a log of 100 MB has half a million positions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from advise_ros.mavlink.messages import EXTENDED_SYS_STATE, HEARTBEAT, LOCAL_POSITION_NED, Message
from advise_ros.recording.columns import Growing
from advise_ros.recording.telemetry_frames import GLOBAL_POSITION_INT, SET_POSITION_TARGET_LOCAL_NED, Frame

# So many messages are put into the columns at once.
BATCH = 4096
# Number of a message -> its fields that are wanted, after row, stamp, system and component.
FIELDS = {
    LOCAL_POSITION_NED: ('time_boot_ms', 'x', 'y', 'z'),
    GLOBAL_POSITION_INT: ('time_boot_ms', 'lat', 'lon', 'relative_alt'),
    SET_POSITION_TARGET_LOCAL_NED: ('target_system', 'coordinate_frame', 'type_mask', 'vx', 'vy', 'vz'),
    HEARTBEAT: ('base_mode', 'custom_mode', 'autopilot'),
    EXTENDED_SYS_STATE: ('landed_state',),
}


class Columns:
    """The messages of one kind, in the order of the log.

    Attributes:
        rows: (n,) their places among the wanted messages.
        stamps_ns: (n,) when they were logged.
        senders: (n, 2) system and component.
        values: (n, fields) as FIELDS says.
    """

    def __init__(self, kind: int) -> None:
        self.kind, self._fields = kind, FIELDS[kind]
        self._waiting: list[tuple[Any, ...]] = []
        self._rows, self._stamps_ns, self._senders = Growing(np.int64), Growing(np.int64), Growing(np.uint8, 2)
        self._values = Growing(np.float64, len(self._fields))

    def take(self, row: int, stamp_ns: int, message: Message) -> None:
        """Add a message."""
        values = [getattr(message, name) for name in self._fields]
        self._waiting.append((row, stamp_ns, message.get_srcSystem(), message.get_srcComponent(), values))
        if len(self._waiting) == BATCH:
            self._flush()

    def _flush(self) -> None:
        waiting, self._waiting = self._waiting, []
        self._rows.add(np.array([one[0] for one in waiting], dtype=np.int64))
        self._stamps_ns.add(np.array([one[1] for one in waiting], dtype=np.int64))
        self._senders.add(np.array([one[2:4] for one in waiting], dtype=np.uint8).reshape(-1, 2))
        self._values.add(np.array([one[4] for one in waiting], dtype=np.float64).reshape(-1, len(self._fields)))

    def finish(self) -> Columns:
        """Take no more."""
        self._flush()
        self.rows, self.stamps_ns, self.senders = self._rows.whole(), self._stamps_ns.whole(), self._senders.whole()
        self.values: npt.NDArray[np.float64] = self._values.whole()
        return self


def columns_of(frames: Iterable[Frame], *, on_earth: bool) -> dict[int, Columns]:
    """The wanted messages by their kinds.

    Args:
        frames: of a log.
        on_earth: places on the earth are wanted; else the first one is enough to know that there are some.
    """
    columns = {kind: Columns(kind) for kind in FIELDS}
    row, first = 0, True
    for stamp_ns, _, message in frames:
        if message is not None:
            one = columns[message.get_msgId()]
            if on_earth or one is not columns[GLOBAL_POSITION_INT] or first:
                one.take(row, stamp_ns, message)
                first = first and one is not columns[GLOBAL_POSITION_INT]
            row += 1
    return {kind: one.finish() for kind, one in columns.items()}
