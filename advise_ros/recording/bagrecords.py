"""What belongs to a bag as a whole (parameters of the nodes, what it was made on), also as messages on a topic of its own.

An MCAP file keeps these as metadata records, which `ros2 bag convert` leaves out and sqlite3 has no place for. Messages
are kept by everything, so each record is there a second time, as a std_msgs/String on RECORDS_TOPIC:

    {"name": "parameters /policy", "values": {"speed": "1.5", ...}}
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from advise_ros.core.errors import LogError

RECORDS_TOPIC, RECORDS_TYPE = '/bag_records', 'std_msgs/msg/String'
NO_LIMIT = QosTime(0, 0)
# Latched: who plays the bag and who looks later still get all of it.
RECORDS_QOS = Qos(
    QosHistory.KEEP_ALL, 0, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, NO_LIMIT, NO_LIMIT,
    QosLiveliness.AUTOMATIC, NO_LIMIT, avoid_ros_namespace_conventions=False,
)


class Record(NamedTuple):
    """An MCAP metadata record."""

    name: str
    values: dict[str, str]


def record_to_cdr(name: str, values: Mapping[str, str]) -> bytes:
    """The message of a record, as CDR bytes."""
    types = get_typestore(Stores.EMPTY)
    types.register(get_types_from_msg('string data', RECORDS_TYPE))
    text = types.types[RECORDS_TYPE](data=json.dumps({'name': name, 'values': dict(values)}))
    return bytes(types.serialize_cdr(text, RECORDS_TYPE))


def record_of(text: str) -> Record:
    """The record in a message's text.

    Raises:
        LogError: the text is no record.
    """
    try:
        values = json.loads(text)
        return Record(str(values['name']), {str(key): str(value) for key, value in values['values'].items()})
    except (ValueError, KeyError, TypeError, AttributeError):
        raise LogError(f'a message on {RECORDS_TOPIC} is no record of a bag ({text[:40]!r}); was it edited?') from None


def all_records(records: Iterable[Record], texts: Iterable[str]) -> list[Record]:
    """The metadata records of a bag, and those that stand in messages alone since somebody converted it.

    Args:
        records: of the bag's files.
        texts: of the messages on RECORDS_TOPIC, in order.

    Raises:
        LogError: a text is no record.
    """
    kept = list(records)
    return kept + [one for one in map(record_of, texts) if one not in kept]
