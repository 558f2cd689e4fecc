"""Cut one window after the other out of a long recording without looking at all of it each time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.samples import NEVER_NS, CommandSamples, PoseSamples, Recording


class Cutter:
    """Cuts in O(log n); samples may have arrived in any order."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._poses = _Index(recording.poses.stamps_ns)
        self._commands = _Index(recording.commands.stamps_ns)
        stamped = recording.commands.stamps_ns[recording.commands.stamps_ns > 0]
        self._commanded_ns = int(stamped.min()) if stamped.size else NEVER_NS

    def cut(self, window_ns: tuple[int, int]) -> Recording:
        """All samples with a stamp in the window, both ends included, and what arrived between them.

        From the first arrival that is not older than the window to the last that is not newer; the views
        share the recording's memory.
        """
        poses, commands = self._poses.between(window_ns), self._commands.between(window_ns)
        whole = self._recording
        return whole._replace(
            commanded_ns=min(whole.commanded_ns, self._commanded_ns),
            poses=PoseSamples(whole.poses.stamps_ns[poses], whole.poses.positions_enu_m[poses]),
            commands=CommandSamples(whole.commands.stamps_ns[commands], whole.commands.velocities_enu_m_s[commands]),
        )


class _Index:
    """The newest stamp up to each arrival and the oldest one from it on: both ascend."""

    def __init__(self, stamps_ns: npt.NDArray[np.int64]) -> None:
        self._newest = np.maximum.accumulate(stamps_ns)
        stamped = np.where(stamps_ns <= 0, NEVER_NS, stamps_ns)
        self._oldest = np.minimum.accumulate(stamped[::-1])[::-1]

    def between(self, window_ns: tuple[int, int]) -> slice:
        first = int(np.searchsorted(self._newest, window_ns[0], side='left'))
        after = int(np.searchsorted(self._oldest, min(window_ns[1], NEVER_NS - 1), side='right'))
        return slice(first, max(first, after))
