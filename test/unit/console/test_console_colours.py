"""The page's colours can be read, in the light and in the dark: contrasts as WCAG 2.2 counts them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from advise_ros.console.serving import STATIC

TEXT, MARK = 4.5, 3.0  # Success criteria 1.4.3 and 1.4.11.
# What is written on what, and what is drawn on what.
WRITTEN = (
    *((ink, ground) for ink in ('ink', 'soft', 'good', 'bad', 'accent') for ground in ('paper', 'card')),
    ('ink', 'right-paper'), ('ink', 'wrong-paper'), ('right', 'right-paper'), ('wrong', 'wrong-paper'), ('wrong', 'card'),
    ('paper', 'ink'), ('paper', 'bad'),
)
DRAWN = (
    *((mark, ground) for mark in ('flown', 'policy', 'drone', 'route', 'change', 'clash') for ground in ('paper', 'askedFill')),
    ('asked', 'paper'), ('asked', 'askedFill'), ('part', 'askedFill'), ('wall', 'paper'),
    *((mark, 'changeFill') for mark in ('flown', 'change', 'clash')),
    *((mark, 'paper') for mark in ('keepOut', 'disputed', 'keep', 'through')),
)


CARD_MARKS = ('asked', 'flown', 'drone', 'right', 'keep', 'through', 'site', 'disputed')


def palette(text: str, pattern: str, which: int) -> dict[str, tuple[float, ...]]:
    """Name -> (r, g, b) from 0 to 1 of the light (0) or the dark (1) block that a pattern finds."""
    block = re.findall(pattern, text, re.DOTALL)[which]
    found = re.findall(r"([\w-]+): '?#([0-9a-fA-F]{6})", block)
    return {name.lstrip('-'): tuple(int(code[at:at + 2], 16) / 255 for at in (0, 2, 4)) for name, code in found}


def contrast(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """The ratio of their relative luminances, 1 to 21."""
    low, high = sorted(map(luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


def luminance(colour: tuple[float, ...]) -> float:
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in colour]
    return float(sum(weight * share for weight, share in zip((0.2126, 0.7152, 0.0722), linear, strict=True)))


def too_weak(colours: dict[str, tuple[float, ...]], pairs: tuple[tuple[str, str], ...], least: float) -> list[str]:
    found = {pair: contrast(colours[pair[0]], colours[pair[1]]) for pair in pairs}
    return [f'{one} on {other}: {ratio:.2f}' for (one, other), ratio in found.items() if ratio < least]


def read(name: str) -> str:
    return Path(STATIC, name).read_text(encoding='utf-8')


@pytest.mark.parametrize('which', [0, 1], ids=['light', 'dark'])
def test_what_is_written_can_be_read(which: int) -> None:
    colours = palette(read('console.css'), r'\.console(?:\.dark)? \{\s*(--paper.*?)\}', which)
    assert not too_weak(colours, WRITTEN, TEXT)
    assert not too_weak(colours, tuple((mark, 'card') for mark in CARD_MARKS), MARK)


@pytest.mark.parametrize('which', [0, 1], ids=['light', 'dark'])
def test_what_is_drawn_can_be_seen(which: int) -> None:
    colours = palette(read('painter.js'), r'const (?:LIGHT|DARK) = \{(.*?)\};', which)
    assert not too_weak(colours, DRAWN, MARK)


def test_what_holds_the_drone_can_be_read() -> None:
    red = re.search(r'\.hold \{[^}]*background: #([0-9a-f]{6}); color: #fff', read('console.css'))
    assert red is not None
    assert contrast(tuple(int(red[1][at:at + 2], 16) / 255 for at in (0, 2, 4)), (1.0, 1.0, 1.0)) >= TEXT


def test_black_on_white_is_twenty_one_to_one() -> None:
    assert contrast((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)) == pytest.approx(21.0)
