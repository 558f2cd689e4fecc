"""Names that every part of the package shares: nanoseconds, vectors, and the frame of all positions."""

from __future__ import annotations

# Nanoseconds in a second.
NS = 1_000_000_000
# x, y, z; the name of each value says unit and frame.
Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)
# The frame of positions and velocities outside of MAVLink: x east, y north, z up (REP 103, REP 105).
MAP_FRAME = 'map'
