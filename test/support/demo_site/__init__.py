"""A site of 6 x 6 cells with a garden on the direct way: the demo's story in a quarter of its time."""

from __future__ import annotations

from pathlib import Path

_HERE = Path(__file__).parent
SMALL_SITE = (
    '--grid', str(_HERE / 'route.yaml'), '--other-grid', str(_HERE / 'other_route.yaml'), '--wish', str(_HERE / 'garden.yaml'),
)
