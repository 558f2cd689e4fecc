"""Messages of older versions, in the form that today's nodes read: a reader of DDS refuses bytes that end too soon."""

from __future__ import annotations

from typing import Any

from advise_ros.recording.codec import Codec
from advise_ros.ros.cdr import to_cdr


def in_installed_form(data: bytes, type_name: str, kind: type[Any], codec: Codec) -> bytes:
    """Bytes of a recorded message as today's definition of its type has them; fields that it lacks keep their defaults.

    Args:
        data: CDR bytes by the definition that `codec` knows.
        kind: the installed message class.

    Raises:
        LogError: the bytes do not fit their own definition.
    """
    recorded = codec.decode(data, type_name)
    message = kind()
    _fill(message, recorded)
    return to_cdr(message)


def _fill(message: Any, recorded: Any) -> None:
    """Take over each plain field by its name, and those of nested messages likewise."""
    for name in message.get_fields_and_field_types():
        value = getattr(recorded, name, None)
        if value is None:
            continue
        if hasattr(getattr(message, name), 'get_fields_and_field_types'):
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
