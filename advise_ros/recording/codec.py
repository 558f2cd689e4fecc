"""CDR messages <-> objects, by the definitions that a bag itself holds: no message package need be installed."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from advise_ros.core.errors import LogError

# Longest padding that a serialiser may leave behind a message.
MAX_PADDING = 8


@cache
def parsed(type_name: str, encoding: str, text: str) -> Typesdict:
    """Fields by type; parsing takes ten milliseconds a type."""
    return get_types_from_msg(text, type_name) if encoding == 'ros2msg' else get_types_from_idl(text)


class Codec:
    """Decodes and encodes messages by text definitions."""

    def __init__(self) -> None:
        self.store: Typestore = get_typestore(Stores.EMPTY)

    def learn(self, type_name: str, encoding: str, text: str) -> None:
        """Take up a definition: encoding 'ros2msg' or 'ros2idl'."""
        if type_name not in self.store.fielddefs:
            types = parsed(type_name, encoding, text)
            self.store.register({name: fields for name, fields in types.items() if name not in self.store.fielddefs})

    def knows(self, type_name: str) -> bool:
        return type_name in self.store.fielddefs

    def decode(self, data: bytes, type_name: str) -> Any:
        """The message as an object with the definition's fields.

        Raises:
            LogError: the bytes do not fit the definition.
        """
        for padding in range(0, MAX_PADDING + 1, 4):
            try:
                return self.store.deserialize_cdr(data[: len(data) - padding], type_name)
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
        return bytes(self.store.serialize_cdr(value, type_name))
