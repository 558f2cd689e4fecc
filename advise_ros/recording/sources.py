"""One door to every kind of recording: its first bytes say who reads it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.bags import read_bag
from advise_ros.recording.dataflash import read_dataflash
from advise_ros.recording.filekind import BAG_KINDS, ENDINGS, FileKind, is_bag, kind_of, what_it_is
from advise_ros.recording.place import Place
from advise_ros.recording.progress import ProgressCallback
from advise_ros.recording.storage import unpacked
from advise_ros.recording.tlog import read_tlog
from advise_ros.recording.topics import DEFAULT_TOPICS, BagTopics
from advise_ros.recording.ulog import read_ulog

# What reads each kind of file with its path, the topics, the grid's place on the earth and the progress.
Reader = Callable[[Path, BagTopics, Place | None, ProgressCallback | None], Recording]


def _bag(path: Path, topics: BagTopics, place: Place | None, progress: ProgressCallback | None) -> Recording:
    return read_bag(path, topics, progress, place)


def _dataflash(path: Path, topics: BagTopics, place: Place | None, progress: ProgressCallback | None) -> Recording:
    return read_dataflash(path, place, progress)


def _packed(path: Path, topics: BagTopics, place: Place | None, progress: ProgressCallback | None) -> Recording:
    """A file compressed with zstd: of a bag, or a log."""
    with unpacked(path) as (there, problem):
        kind = kind_of(there)
        if kind in BAG_KINDS or kind not in READERS:
            return _bag(path, topics, place, progress)
        try:
            found = READERS[kind](there, topics, place, progress)
        except LogError as trouble:
            raise LogError(str(trouble).replace(str(there), str(path))) from None
        notes = (*found.notes, problem) if problem else found.notes
        return found._replace(source=found.source.replace(str(there), str(path)), notes=notes)


READERS: Mapping[FileKind, Reader] = {
    **dict.fromkeys(BAG_KINDS, _bag),
    FileKind.ZSTD: _packed,
    FileKind.TLOG: lambda path, topics, place, progress: read_tlog(path, progress, topics.vehicle, place),
    FileKind.ULOG: lambda path, topics, place, progress: read_ulog(path, place, progress),
    FileKind.DATAFLASH: _dataflash,
    FileKind.DATAFLASH_TEXT: _dataflash,
}


def find_recordings(path: str | Path) -> list[Path]:
    """The recordings that a path stands for: itself, or all bags and logs in and below a directory that is no bag.

    Files that are named or begin as recordings are among them, also those that cannot be read: whoever reads them says
    why. Side files of macOS (._name) and hidden ones are not.

    Raises:
        LogError: it is a directory without any, or cannot be read.
    """
    directory = Path(path)
    if not directory.is_dir() or is_bag(directory):
        return [directory]
    found = _below(directory)
    if not found:
        raise LogError(
            f'{path} is no bag, and there is no recording in it; name a bag, an .mcap file, a .tlog, a .ulg, a .BIN or a '
            'directory of them'
        )
    return found


def _below(directory: Path) -> list[Path]:
    found: list[Path] = []
    for entry in sorted(directory.iterdir()):
        if entry.name.startswith('.'):
            continue
        if entry.is_dir():
            found += [entry] if is_bag(entry) else _below(entry)
        elif entry.is_file() and (entry.suffix.lower() in ENDINGS or kind_of(entry) in READERS):
            found.append(entry)
    return found


def read_recording(
    path: str | Path, topics: BagTopics = DEFAULT_TOPICS, progress: ProgressCallback | None = None, place: Place | None = None,
) -> Recording:
    """The samples in a bag (a directory or one file of it), a telemetry log or an autopilot's own log.

    Args:
        path: a directory with a bag, or a file.
        topics: of a bag; its `vehicle` also of a telemetry log.
        progress: called now and then with what is read and what there is in all.
        place: of the grid on the earth, where it is known.

    Raises:
        LogError: it cannot be read, or is no recording; as read_bag, read_tlog, read_ulog and read_dataflash.
    """
    file = Path(path)
    if file.is_dir():
        return _bag(file, topics, place, progress)
    kind = kind_of(file)
    if kind not in READERS:
        raise LogError(what_it_is(path, kind))
    return READERS[kind](file, topics, place, progress)
