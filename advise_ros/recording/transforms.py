"""Where frames lie in each other: the transforms of a bag (tf2_msgs/msg/TFMessage), and one that a person states."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.units import NS
from advise_ros.recording.columns import ENCAPSULATION, LONGEST_NAME, PLAIN_CDR_LITTLE_ENDIAN

TF_TYPE = 'tf2_msgs/msg/TFMessage'
Floats = npt.NDArray[np.float64]
Stamps = npt.NDArray[np.int64]


class Moved(NamedTuple):
    """One transform as it was recorded.

    Attributes:
        log_ns, place: when, and its message's number in the file.
        translation_m: of the child's origin in the parent.
        rotation_xyzw: of the child's axes.
    """

    stamp_ns: int
    log_ns: int
    place: int
    parent: str
    child: str
    translation_m: tuple[float, float, float]
    rotation_xyzw: tuple[float, float, float, float]


class Edge(NamedTuple):
    """Where a frame lies in its parent, from each stamp on.

    Attributes:
        stamps_ns: (n,) in ascending order.
        translations_m: (n, 3).
        rotations_xyzw: (n, 4).
    """

    parent: str
    stamps_ns: Stamps
    translations_m: Floats
    rotations_xyzw: Floats

    def at(self, stamps_ns: Stamps) -> Placed:
        """At each stamp: the newest up to then, or the first.

        Args:
            stamps_ns: (m,).
        """
        rows = np.clip(np.searchsorted(self.stamps_ns, stamps_ns, side='right') - 1, 0, None)
        return Placed(self.translations_m[rows], self.rotations_xyzw[rows])


class Placed(NamedTuple):
    """Where a frame lies in another: (m, 3) and (m, 4), or one row for all."""

    translations_m: Floats
    rotations_xyzw: Floats

    def turn(self, vectors: Floats) -> Floats:
        """Vectors (m, 3) along the axes of the other frame."""
        axis, real = self.rotations_xyzw[:, :3], self.rotations_xyzw[:, 3:]
        across = 2.0 * np.cross(axis, vectors)
        turned: Floats = vectors + real * across + np.cross(axis, across)
        return turned

    def move(self, positions: Floats) -> Floats:
        """Positions (m, 3) in the other frame."""
        return self.turn(positions) + self.translations_m

    def back(self) -> Placed:
        """Where the other frame lies in this one."""
        inverse = Placed(np.zeros_like(self.translations_m), self.rotations_xyzw * (-1.0, -1.0, -1.0, 1.0))
        return Placed(inverse.turn(-self.translations_m), inverse.rotations_xyzw)

    def of(self, inner: Placed) -> Placed:
        """Where a frame lies that lies so in this one."""
        axis, real = self.rotations_xyzw[:, :3], self.rotations_xyzw[:, 3:]
        inner_axis, inner_real = inner.rotations_xyzw[:, :3], inner.rotations_xyzw[:, 3:]
        rotation = np.hstack([
            real * inner_axis + inner_real * axis + np.cross(axis, inner_axis),
            real * inner_real - (axis * inner_axis).sum(axis=1, keepdims=True),
        ])
        return Placed(self.move(inner.translations_m), rotation)


def stated(east_m: float, north_m: float, up_m: float, yaw_deg: float) -> Placed:
    """A frame whose origin lies there on the grid, its x axis turned from east by the yaw, counter-clockwise."""
    half = math.radians(yaw_deg) / 2
    return Placed(np.array([[east_m, north_m, up_m]]), np.array([[0.0, 0.0, math.sin(half), math.cos(half)]]))


def edges_of(moved: Iterable[Moved]) -> dict[str, Edge]:
    """Child -> where it lies in its parent; of several parents the last."""
    rows: dict[str, list[Moved]] = {}
    for one in moved:
        rows.setdefault(one.child, []).append(one)
    found = {}
    for child, several in rows.items():
        own = sorted((one for one in several if one.parent == several[-1].parent), key=lambda one: one.stamp_ns)
        found[child] = Edge(
            own[-1].parent, np.array([one.stamp_ns for one in own], dtype=np.int64),
            np.array([one.translation_m for one in own]), _unit(np.array([one.rotation_xyzw for one in own])),
        )
    return found


def _unit(rotations_xyzw: Floats) -> Floats:
    """Of length 1; what has none turns nothing."""
    lengths = np.linalg.norm(rotations_xyzw, axis=1, keepdims=True)
    whole: Floats = np.where(lengths > 0, rotations_xyzw / np.where(lengths > 0, lengths, 1.0), (0.0, 0.0, 0.0, 1.0))
    return whole


def placed_in(edges: Mapping[str, Edge], target: str, frame: str, stamps_ns: Stamps) -> Placed | None:
    """Where a frame lies in the target at each stamp; None where the transforms do not connect them.

    Args:
        edges: as edges_of gives them.
        target: a frame.
        frame: another.
        stamps_ns: (m,).
    """
    up, down = _ancestors(edges, frame), _ancestors(edges, target)
    common = next((name for name in up if name in down), None)
    if common is None:
        return None
    above = [_from(edges, chain[: chain.index(common)], stamps_ns) for chain in (up, down)]
    return above[1].back().of(above[0])


def _ancestors(edges: Mapping[str, Edge], frame: str) -> list[str]:
    """The frame, its parent and so on, each once."""
    chain = [frame]
    while chain[-1] in edges and edges[chain[-1]].parent not in chain:
        chain.append(edges[chain[-1]].parent)
    return chain


def _from(edges: Mapping[str, Edge], chain: list[str], stamps_ns: Stamps) -> Placed:
    """Where the first frame of a chain lies in the parent of the last."""
    placed = Placed(np.zeros((len(stamps_ns), 3)), np.tile((0.0, 0.0, 0.0, 1.0), (len(stamps_ns), 1)))
    for name in reversed(chain):
        placed = placed.of(edges[name].at(stamps_ns))
    return placed


# -- bytes -----------------------------------------------------------------------------------------
def parse_transforms(data: bytes, log_ns: int, place: int) -> list[Moved]:
    """The transforms of a CDR message; those before the first byte that does not fit."""
    found: list[Moved] = []
    if len(data) < ENCAPSULATION + 4 or int.from_bytes(data[:2], 'little') != PLAIN_CDR_LITTLE_ENDIAN:
        return found
    body, at = data[ENCAPSULATION:], 4
    try:
        for _ in range(int.from_bytes(body[:4], 'little')):
            seconds, nanoseconds = struct.unpack_from('<iI', body, at)
            parent, at = _string(body, at + 8)
            child, at = _string(body, at)
            at += -at % 8
            numbers = struct.unpack_from('<7d', body, at)
            at += 56
            found.append(Moved(seconds * NS + nanoseconds, log_ns, place, parent, child, numbers[:3], numbers[3:]))
    except (struct.error, ValueError):
        return found
    return found


def _string(body: bytes, at: int) -> tuple[str, int]:
    """A name of a frame without a slash in front, and where the next field begins."""
    (length,) = struct.unpack_from('<I', body, at)
    if length > LONGEST_NAME or at + 4 + length > len(body):
        raise ValueError('no name of a frame')
    text = body[at + 4 : at + 4 + length].rstrip(b'\0').decode('utf-8', 'replace')
    return text.lstrip('/'), at + 4 + length + -(at + 4 + length) % 4
