"""CDR messages <-> objects, by the definitions that a bag itself holds: no message package need be installed."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from advise_ros.core.errors import LogError

# Longest padding that a serialiser may leave behind a message.
MAX_PADDING = 8


# Definitions that are remembered; damaged bags bring ever new ones.
MOST_DEFINITIONS = 128


@lru_cache(MOST_DEFINITIONS)
def parsed(type_name: str, encoding: str, text: str) -> Typesdict:
    """Fields by type; parsing takes ten milliseconds a type."""
    text = text.replace('\r\n', '\n')
    return get_types_from_msg(text, type_name) if encoding == 'ros2msg' else get_types_from_idl(text)


@lru_cache(MOST_DEFINITIONS)
def _store(type_name: str, encoding: str, text: str) -> Typestore:
    """What decodes messages of one type; its code takes as long to make as the definition to parse."""
    store = get_typestore(Stores.EMPTY)
    store.register(parsed(type_name, encoding, text))
    return store


class Codec:
    """Decodes and encodes messages by text definitions."""

    def __init__(self) -> None:
        self._stores: dict[str, Typestore] = {}

    def learn(self, type_name: str, encoding: str, text: str) -> None:
        """Take up a definition: encoding 'ros2msg' or 'ros2idl'."""
        if type_name not in self._stores:
            self._stores[type_name] = _store(type_name, encoding, text)

    def knows(self, type_name: str) -> bool:
        return type_name in self._stores

    def fields(self) -> dict[str, tuple[str, ...]]:
        """The types learnt and those that they are made of, with the names of their fields."""
        return {
            name: tuple(field for field, _ in fields)
            for store in self._stores.values() for name, (_, fields) in store.fielddefs.items()
        }

    def decode(self, data: bytes, type_name: str) -> Any:
        """The message as an object with the definition's fields.

        Raises:
            LogError: the bytes do not fit the definition.
        """
        for padding in range(0, MAX_PADDING + 1, 4):
            try:
                return self._stores[type_name].deserialize_cdr(data[: len(data) - padding], type_name)
            except Exception as problem:  # noqa: BLE001  rosbags lets many types through for damaged bytes
                reason = problem
        raise LogError(f'a message of type {type_name} does not fit its definition ({reason})') from reason

    def try_decode(self, data: bytes, type_name: str) -> Any | None:
        """As decode; None when the bytes do not fit."""
        try:
            return self.decode(data, type_name)
        except LogError:
            return None

    def canonical(self, value: Any, type_name: str) -> bytes:
        """CDR bytes with padding set to zero: equal values give equal bytes."""
        return bytes(self._stores[type_name].serialize_cdr(value, type_name))
