"""Bytes -> MAVLink messages, resynchronising after garbage.

pymavlink's own parser trusts the length byte of whatever follows a start byte, so garbage or an unknown
message id swallows the good frames behind it. Here a frame counts only if its id is known, its length can be
that message's and its checksum is right; anything else advances by one byte. Only the messages that the
package speaks are handed on: sixteen bits of checksum alone let one in a few million random bytes through.
"""

from __future__ import annotations

import struct

from advise_ros.mavlink.messages import CURRENT_MODE, MAVError, Message, dialect
from advise_ros.mavlink.signing import SIGNATURE_BYTES, Verifier

START_V1, START_V2 = 0xFE, 0xFD
HEADER_V1, HEADER_V2 = 6, 10
CHECKSUM = 2
SIGNED = 0x01
LONGEST_FRAME = HEADER_V2 + 255 + CHECKSUM + SIGNATURE_BYTES

# Message id -> length of its payload in MAVLink 1, which cuts no zeros off and knows no later fields.
SPOKEN = {int(getattr(dialect, f'MAVLINK_MSG_ID_{name}')): length for name, length in {
    'HEARTBEAT': 9, 'SYS_STATUS': 31, 'SET_MODE': 6, 'PARAM_REQUEST_READ': 20, 'PARAM_REQUEST_LIST': 2, 'PARAM_VALUE': 25,
    'PARAM_SET': 23, 'GPS_RAW_INT': 30, 'ATTITUDE': 28, 'LOCAL_POSITION_NED': 28, 'GLOBAL_POSITION_INT': 28,
    'MANUAL_CONTROL': 11, 'COMMAND_INT': 35, 'COMMAND_LONG': 33, 'COMMAND_ACK': 3, 'SET_POSITION_TARGET_LOCAL_NED': 53,
    'TIMESYNC': 16, 'BATTERY_STATUS': 36, 'AUTOPILOT_VERSION': 60, 'EKF_STATUS_REPORT': 22, 'EXTENDED_SYS_STATE': 2,
    'STATUSTEXT': 51, 'REQUEST_DATA_STREAM': 6, 'SYSTEM_TIME': 12, 'POSITION_TARGET_LOCAL_NED': 51, 'ESTIMATOR_STATUS': 42,
    'ODOMETRY': 230, 'SIM_STATE': 84, 'SIMSTATE': 44, 'HIL_STATE_QUATERNION': 64,
    'MISSION_REQUEST_LIST': 2, 'MISSION_COUNT': 4, 'MISSION_CLEAR_ALL': 2, 'MISSION_ACK': 3, 'MISSION_REQUEST': 4,
    'MISSION_REQUEST_INT': 4, 'MISSION_ITEM_INT': 37,
}.items()} | {CURRENT_MODE: 9}
_LONGEST_PAYLOAD = {number: kind.unpacker.size for number, kind in dialect.mavlink_map.items()}


class Framer:
    """Cuts one stream (or one datagram at a time) into messages.

    Args:
        verifier: with it, frames that are not signed with its key are refused.

    Attributes:
        bad_bytes: what was no sound frame of a known message.
        unproven: signed frames that were taken without a key to prove them by.
    """

    def __init__(self, verifier: Verifier | None = None) -> None:
        self._codec = dialect.MAVLink(None)
        self._verifier = verifier
        self._buffer = bytearray()
        self.bad_bytes = 0
        self.unproven = 0

    @property
    def waiting_bytes(self) -> int:
        """What is kept for the rest of a frame; never more than LONGEST_FRAME."""
        return len(self._buffer)

    def reset(self) -> None:
        """Forget half a frame: the connection broke."""
        self._buffer.clear()

    def datagram(self, data: bytes) -> list[Message]:
        """The messages of one datagram; frames never span two."""
        self._buffer = bytearray(data)
        return self._cut(more_may_come=False)

    def stream(self, data: bytes) -> list[Message]:
        """The messages completed by the next bytes of a stream."""
        self._buffer += data
        return self._cut(more_may_come=True)

    def _cut(self, *, more_may_come: bool) -> list[Message]:
        messages: list[Message] = []
        at = self._next_start(0)
        while at < len(self._buffer):
            length = self._frame_length(at)
            incomplete = length == 0 or at + length > len(self._buffer)
            if incomplete and more_may_come:
                break
            message = None if incomplete or length < 0 else self._decode(self._buffer[at:at + length])
            if message is None:
                self.bad_bytes += 1
                at = self._next_start(at + 1)
            else:
                if self._is_wanted(message, at, length):
                    messages.append(message)
                at = self._next_start(at + length)
        del self._buffer[:at]
        return messages

    def _next_start(self, at: int) -> int:
        found = [i for i in (self._buffer.find(START_V2, at), self._buffer.find(START_V1, at)) if i >= 0]
        start = min(found, default=len(self._buffer))
        self.bad_bytes += start - at
        return start

    def _frame_length(self, at: int) -> int:
        """Length of the frame that starts here: 0 if more bytes are needed to decide, -1 if there can be none."""
        rest = len(self._buffer) - at
        if rest < HEADER_V1:
            return 0
        payload = self._buffer[at + 1]
        if self._buffer[at] == START_V1:
            message_id = self._buffer[at + 5]
            possible = payload == SPOKEN.get(message_id, payload) and payload <= _LONGEST_PAYLOAD.get(message_id, -1)
            return HEADER_V1 + payload + CHECKSUM if possible else -1
        if rest < HEADER_V2:
            return 0
        flags = self._buffer[at + 2]
        message_id = int.from_bytes(self._buffer[at + 7:at + 10], 'little')
        # A newer autopilot may have extended a message: what we do not know of it is cut off in decoding.
        if flags & ~SIGNED or message_id not in _LONGEST_PAYLOAD:
            return -1
        return HEADER_V2 + payload + CHECKSUM + (SIGNATURE_BYTES if flags & SIGNED else 0)

    def _decode(self, frame: bytearray) -> Message | None:
        try:
            return self._codec.decode(frame)
        except (MAVError, struct.error, ValueError):
            return None

    def _is_wanted(self, message: Message, at: int, length: int) -> bool:
        """Of a message that we speak, and signed if that is asked for."""
        if message.get_msgId() not in SPOKEN:
            return False
        signed = self._buffer[at] == START_V2 and bool(self._buffer[at + 2] & SIGNED)
        if self._verifier is None:
            self.unproven += signed
            return True
        if not signed:
            self._verifier.refuse('a frame is not signed, but a key is set')
            return False
        frame = bytes(self._buffer[at:at + length])
        return self._verifier.accepts(frame, (message.get_srcSystem(), message.get_srcComponent()))
