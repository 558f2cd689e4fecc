"""Messages as CDR bytes, as they travel and as bags keep them."""

from __future__ import annotations

from typing import Any

from rclpy.serialization import serialize_message


def to_cdr(message: Any) -> bytes:
    """Bytes of a message; padding bytes, also up to 8 at the end, may be anything."""
    return bytes(serialize_message(message))
