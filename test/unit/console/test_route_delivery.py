"""The learnt route as the page gives it to other tools."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from advise_ros.console.board import Board
from advise_ros.console.route_delivery import RouteDelivery
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid, optimal_actions
from advise_ros.missions.files import WRITERS, read_mission
from advise_ros.missions.from_grid import cells_flown, mission_of
from advise_ros.recording.place import Place

GRID = Grid(2.0, 4, 2, (-1.0, -1.0), 2.0, waypoints=(3, 4))
PLACE = Place(47.3977, 8.5456, 0.0)


def listener(greedy: list[int] | None) -> Any:
    """What the delivery reads of the listener."""
    policy = None if greedy is None else SimpleNamespace(greedy=greedy)
    return SimpleNamespace(board=Board(), grid=GRID, policy=policy)


def right() -> list[int]:
    return [max(optimal_actions(GRID, state), default=0) for state in range(GRID.n_states)]


@pytest.mark.parametrize('form', WRITERS)
def test_a_file_of_each_form_has_the_waypoints(tmp_path: Path, form: str) -> None:
    reply = RouteDelivery(listener(right()), PLACE, '').file(form)
    assert reply['ok'] and reply['name'] == f'route{form}'
    (tmp_path / reply['name']).write_text(reply['text'])
    read = read_mission(tmp_path / reply['name'])
    flown = mission_of(GRID, PLACE, cells_flown(GRID, right()))
    assert [(round(one.latitude_deg, 6), round(one.longitude_deg, 6)) for one in read.waypoints] == [
        (round(one.latitude_deg, 6), round(one.longitude_deg, 6)) for one in flown.waypoints
    ]


@pytest.mark.parametrize(('greedy', 'place', 'form', 'words'), [
    (None, PLACE, '.plan', 'nothing is learnt yet'),
    ([1] * GRID.n_states, PLACE, '.plan', 'does not come to the end'),
    ('right', None, '.plan', 'add origin_wgs84'),
    ('right', PLACE, '.exe', "'.exe' is no form of a route"),
])  # fmt: skip
def test_what_stands_against_it_is_said(greedy: Any, place: Place | None, form: str, words: str) -> None:
    delivery = RouteDelivery(listener(right() if greedy == 'right' else greedy), place, '')
    with pytest.raises(InputError, match=words):
        delivery.file(form)


def test_the_page_knows_what_there_is() -> None:
    heard = listener(None)
    RouteDelivery(heard, None, '')
    assert heard.board.sections['delivery'].value == {'forms': list(WRITERS), 'placed': False, 'vehicle': False}
