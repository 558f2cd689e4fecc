"""The sites of a demo: its own, or a person's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from advise_ros.commands import demo
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.known_site import site_of
from advise_ros.demo.options import load_sites, share
from advise_ros.demo.story import site_rows
from advise_ros.demo.tracks import entered_cells
from advise_ros.recording.gridfile import load_grid

SITE = site_of(load_grid(share('grid_demo.yaml')), (77, 78))


def test_a_grid_of_ones_own_has_no_garden_and_no_other_route_but_those_that_are_named(tmp_path: Path) -> None:
    own = ['--out', str(tmp_path / 'out'), '--grid', str(share('grid_6x6.yaml'))]
    plain = load_sites(demo.parse(own))
    assert plain.other is None and not plain.shown.keep_out.any()
    (tmp_path / 'wish.yaml').write_text('keep_out: [[2, 0]]')
    with_wish = load_sites(demo.parse([*own, '--wish', str(tmp_path / 'wish.yaml'), '--other-grid', str(share('grid_6x6.yaml'))]))
    assert with_wish.other is not None
    assert with_wish.shown.keep_out.sum() == with_wish.other.keep_out.sum() == 1


def test_another_route_is_over_the_same_site(tmp_path: Path) -> None:
    options = demo.parse(['--out', str(tmp_path / 'out'), '--other-grid', str(share('grid_6x6.yaml'))])
    with pytest.raises(InputError, match=r'grid_6x6\.yaml is of another site than .*grid_demo\.yaml; only its waypoints may'):
        load_sites(options)


def test_a_track_enters_the_cells_that_its_positions_lie_in() -> None:
    inside, beside = SITE.grid.centre_enu_m(77), SITE.grid.centre_enu_m(76)
    assert entered_cells(SITE, np.array([beside, inside, inside])) == (77,)
    assert entered_cells(SITE, np.array([beside, (-500.0, 0.0)])) == ()
    assert entered_cells(SITE, np.zeros((0, 2))) == ()


def test_a_person_sees_where_the_garden_is() -> None:
    grid = Grid(1.0, 3, 2, (0.0, 0.0), 2.0, (2, 0), (4,))
    assert site_rows(site_of(grid, (1,))) == ['. x .', '2 # 1']
