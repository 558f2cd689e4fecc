"""One door to every kind of recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from advise_ros.core.errors import LogError
from advise_ros.core.samples import Recording
from advise_ros.recording.bags import DEFAULT_TOPICS, BagTopics, read_bag
from advise_ros.recording.tlog import read_tlog

BAG_FILES = ('.mcap',)
ProgressCallback = Callable[[int, int], None]


def read_recording(
    path: str | Path, topics: BagTopics = DEFAULT_TOPICS, progress: ProgressCallback | None = None,
) -> Recording:
    """The samples in a bag (a directory or .mcap) or in a telemetry log (any other file).

    Raises:
        LogError: as read_bag and read_tlog; or the file is a part of a bag.
    """
    file = Path(path)
    if file.suffix == '.db3':
        raise LogError(f'{path} is a part of a bag; name the directory with its metadata.yaml: {file.parent}')
    if not file.exists():
        raise LogError(f'{path}: there is no such file; name a .tlog, a bag directory or an .mcap file')
    if file.is_dir() or file.suffix in BAG_FILES:
        return read_bag(path, topics, progress)
    return read_tlog(path, progress)
