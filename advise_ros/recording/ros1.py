"""The messages of a ROS 1 bag as ROS 2 would have written them (CDR), by rosbags."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from advise_ros.core.errors import LogError
from advise_ros.recording.blocks import Block, Channel, Row, from_rows
from advise_ros.recording.progress import ProgressCallback

BATCH = 4096
HEADER = 'std_msgs/msg/Header'
# Pictures and scans take long to convert, and nobody here looks at them.
PACKAGES = frozenset(('geometry_msgs', 'nav_msgs', 'std_msgs', 'tf', 'tf2_msgs', 'mavros_msgs', 'px4_msgs', 'advise_msgs'))


def ros1_blocks(
    file: Path, topics: dict[str, str], lost: Callable[[str], None], progress: ProgressCallback | None,
) -> Iterator[Block]:
    """The messages of the packages above, in the order of their times.

    Args:
        file: the bag.
        topics: takes up the type of every topic.
        lost: called with what is wrong.
        progress: called now and then with what is read and what there is in all.

    Raises:
        LogError: the bag has no index.
    """
    reader = Reader(file)
    try:
        reader.open()
    except Exception as problem:  # rosbags lets many types through for damaged files
        raise LogError(
            f"{file} is a ROS 1 bag without a sound index ({_sentence(problem)}); ROS 1's own rosbag reindex mends it"
        ) from problem
    try:
        yield from _read(reader, topics, lost, progress)
    finally:
        reader.close()


def _read(
    reader: Reader, topics: dict[str, str], lost: Callable[[str], None], progress: ProgressCallback | None,
) -> Iterator[Block]:
    store = get_typestore(Stores.EMPTY)
    topics.update({connection.topic: connection.msgtype for connection in reader.connections})
    channels = _channels(reader, store, lost)
    wanted = [connection for connection in reader.connections if connection.id in channels]
    total, done, unfit = sum(connection.msgcount for connection in wanted), 0, 0
    rows: list[Row] = []
    try:
        for connection, log_ns, raw in reader.messages(wanted) if wanted else ():
            done += 1
            data = _converted(store, raw, connection.msgtype)
            unfit += data is None
            if data is not None:
                rows.append((connection.id, 0, log_ns, log_ns, data))
            if len(rows) == BATCH:
                yield from_rows(rows, channels)
                rows = []
                if progress is not None:
                    progress(done, total)
    except Exception as problem:  # noqa: BLE001  as above
        lost(f'it is damaged after {done} messages ({_sentence(problem)})')
    if rows:
        yield from_rows(rows, channels)
    if unfit:
        lost(f'{unfit} messages do not fit their definition')


def _channels(reader: Reader, store: Typestore, lost: Callable[[str], None]) -> dict[int, Channel]:
    """The topics of the packages that are looked at, with their types as ROS 2 has them."""
    channels: dict[int, Channel] = {}
    for connection in reader.connections:
        kind = connection.msgtype
        if kind.split('/')[0] in PACKAGES:
            try:
                types = get_types_from_msg(connection.msgdef.data, kind)
                if HEADER in types:  # ROS 2 has no `seq`, and rosbags leaves it out by that.
                    constants, fields = types[HEADER]
                    types[HEADER] = constants, [field for field in fields if field[0] != 'seq']
                store.register(types)
                text, _ = store.generate_msgdef(kind, ros_version=2)
            except Exception as problem:  # noqa: BLE001  as above
                lost(f'the definition of {kind} cannot be read ({_sentence(problem)})')
            else:
                channels[connection.id] = Channel(connection.topic, kind, 'ros2msg', text)
    return channels


def _converted(store: Typestore, raw: bytes, kind: str) -> bytes | None:
    try:
        return bytes(store.ros1_to_cdr(raw, kind))
    except Exception:  # noqa: BLE001  as above
        return None


def _sentence(problem: Exception) -> str:
    return str(problem).splitlines()[0].rstrip('.') if str(problem) else type(problem).__name__
