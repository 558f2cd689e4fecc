"""Message definitions as text, with the hash of their type: what a bag embeds so that anyone can read it."""

from __future__ import annotations

import json
import os
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

from rosbags.typesys import Stores, get_typestore

from advise_ros.core.errors import InputError

SEPARATOR = '=' * 80
# 'geometry_msgs/Pose[] poses', 'Pose pose', 'uint8 X=1': the type is the first word.
FIRST_WORD = re.compile(r'^\s*([A-Za-z][\w/]*)')
# A service's own type is not a message; those that rosidl makes of it have these endings.
EVENT, REQUEST, RESPONSE = '_Event', '_Request', '_Response'
# Info, then request and response, as far as there are any.
EVENT_TEXT = 'service_msgs/ServiceEventInfo info\n{0}_Request[<=1] request\n{0}_Response[<=1] response\n'
PRIMITIVES = frozenset((
    'bool', 'byte', 'char', 'float32', 'float64', 'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32',
    'int64', 'uint64', 'string', 'wstring',
))

# Types of packages that are rarely installed where bags are read.
OF_OTHERS = {
    'mavros_msgs/msg/State': (
        'std_msgs/Header header\nbool connected\nbool armed\nbool guided\nbool manual_input\nstring mode\nuint8 system_status\n'
        f'{SEPARATOR}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n'
        f'{SEPARATOR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n'
    ),
}


class Definition(NamedTuple):
    """A message type as a bag stores it.

    Attributes:
        type_name: 'pkg/msg/Type', or 'pkg/srv/Type_Event' for what a service publishes of its calls.
        text: ros2msg: the type's own text, then each type it needs after a line of 80 '='.
        type_hash: REP-2016 hash, 'RIHS01_...'.
    """

    type_name: str
    text: str
    type_hash: str


@cache
def definition(type_name: str) -> Definition:
    """The definition from the installed interface packages, else from the Jazzy types that rosbags ships.

    Raises:
        InputError: neither knows the type.
    """
    return _installed(type_name) or _shipped(type_name)


def known_definition(type_name: str) -> tuple[str, str]:
    """Encoding and text of a type that a bag does not define, as its package defines it; '' and '' for unknown types."""
    if type_name in OF_OTHERS:
        return 'ros2msg', OF_OTHERS[type_name]
    try:
        return 'ros2msg', definition(type_name).text
    except InputError:
        return '', ''


def _share(package: str) -> Path | None:
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        share = Path(prefix) / 'share' / package
        if prefix and share.is_dir():
            return share
    return None


def _source(type_name: str, ending: str) -> str | None:
    """Text of the installed file of a type, None when there is none."""
    package, _, name = type_name.partition('/')
    share = _share(package)
    path = share / f'{name}.{ending}' if share else None
    return path.read_text(encoding='utf-8') if path and path.is_file() else None


def _text(type_name: str) -> str | None:
    """Text of an installed type, of a service's parts too; None when it is not there."""
    package, _, name = type_name.split('/')
    text = _source(type_name, 'msg')
    if text is not None:
        return text
    if name.endswith(EVENT):
        service = f'{package}/{name.removesuffix(EVENT)}'
        return EVENT_TEXT.format(service) if _source(f'{package}/srv/{name.removesuffix(EVENT)}', 'srv') is not None else None
    for part, ending in enumerate((REQUEST, RESPONSE)):
        whole = _source(f'{package}/srv/{name.removesuffix(ending)}', 'srv') if name.endswith(ending) else None
        if whole is not None:
            return re.split(r'^---\s*$', whole, maxsplit=1, flags=re.MULTILINE)[part].strip() + '\n'
    return None


def _installed(type_name: str) -> Definition | None:
    description = _source(type_name.removesuffix(EVENT), 'json')
    texts = _with_dependencies(type_name)
    if description is None or texts is None:
        return None
    hashes = {entry['type_name']: entry['hash_string'] for entry in json.loads(description)['type_hashes']}
    parts = [texts.pop(type_name)]
    for dependency, text in texts.items():
        package, _, name = dependency.split('/')
        parts.append(f'{SEPARATOR}\nMSG: {package}/{name}\n{text}')
    return Definition(type_name, '\n'.join(parts), hashes[type_name])


def _with_dependencies(type_name: str) -> dict[str, str] | None:
    """Type -> text of a type and of all that it needs, itself first; None when one is not installed."""
    texts: dict[str, str] = {}
    waiting = [type_name]
    while waiting:
        current = waiting.pop(0)
        if current in texts:
            continue
        text = _text(current)
        if text is None:
            return None
        texts[current] = text
        waiting.extend(_needed(text, current.split('/')[0]))
    return texts


def _needed(text: str, package: str) -> list[str]:
    """Full names of the message types that a definition names."""
    found = []
    for line in text.splitlines():
        match = FIRST_WORD.match(line)
        if not match or match.group(1) in PRIMITIVES:
            continue
        parts = match.group(1).split('/')
        found.append(f'{parts[0] if len(parts) > 1 else package}/msg/{parts[-1]}')
    return found


def _shipped(type_name: str) -> Definition:
    store = get_typestore(Stores.ROS2_JAZZY)
    if type_name not in store.fielddefs:
        raise InputError(
            f'message type {type_name!r} is not installed (no share/{type_name}.msg below AMENT_PREFIX_PATH); '
            'source the workspace that holds its package'
        )
    text, _ = store.generate_msgdef(type_name, ros_version=2)
    return Definition(type_name, text, store.hash_rihs01(type_name))
