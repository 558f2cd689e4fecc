"""One door to every kind of recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.bags import read_bag
from advise_ros.recording.storage import METADATA_FILE
from advise_ros.recording.tlog import read_tlog
from advise_ros.recording.topics import DEFAULT_TOPICS, BagTopics

BAG_FILES = ('.mcap',)
LOG_FILES = ('.tlog',)
ProgressCallback = Callable[[int, int], None]


def find_recordings(path: str | Path) -> list[Path]:
    """The recordings that a path stands for: itself, or all bags and logs in and below a directory that is no bag.

    Raises:
        LogError: it is a directory without any.
    """
    directory = Path(path)
    if not directory.is_dir() or _is_bag(directory):
        return [directory]
    found = _below(directory)
    if not found:
        raise LogError(f'{path} is no bag, and there is none in it; name a .tlog, a bag, an .mcap file or a directory of them')
    return found


def _below(directory: Path) -> list[Path]:
    found: list[Path] = []
    for entry in sorted(directory.iterdir()):
        if entry.is_dir() and not entry.name.startswith('.'):
            found += [entry] if _is_bag(entry) else _below(entry)
        elif entry.suffix in BAG_FILES + LOG_FILES:
            found.append(entry)
    return found


def _is_bag(directory: Path) -> bool:
    """It has a metadata.yaml, or lost it but has files that are named as those of a bag."""
    if (directory / METADATA_FILE).is_file():
        return True
    names = (file.stem for file in directory.glob('*.mcap'))
    return any(directory.name in (name, name.rsplit('_', 1)[0]) for name in names)


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
