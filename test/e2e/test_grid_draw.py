"""A grid file is drawn from nothing in a real browser: by mouse, by keys alone and by finger; the product's loader reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, expect

from advise_ros.core.grid.raster import Raster
from advise_ros.recording.gridfile import load_grid, load_place
from advise_ros.recording.mapfile import map_texts
from support.browser import PAGE, start_console
from support.drawing import Draughtsman, served
from support.graph import Graph
from support.paths import ROOT

SIZES = {'notebook': (1280, 720), 'tablet': (820, 1180), 'phone': (390, 844)}
# Nothing sticks out to the right; what is touched is large enough; the map, the sentence and saving are on the first screen.
FITS = """() => {
  const boxed = (one) => [one, one.getBoundingClientRect()];
  const boxes = (names) => [...document.querySelectorAll(names)].map(boxed).filter(([, box]) => box.width);
  const controls = boxes('.console button, .console select, .console input:not([type=checkbox])');
  const small = controls.filter(([, box]) => box.height < 35 || box.width < 30).map(([one]) => one.outerHTML.slice(0, 90));
  const save = boxes('.send').some(([, box]) => box.bottom <= innerHeight);
  const [[, board]] = boxes('.board'), wide = document.documentElement.scrollWidth - innerWidth;
  return { small, save, wide, board: [board.height, Math.round(board.bottom - innerHeight)] };
}"""
SCALE = f'() => {PAGE}.board.view.scale'
# What becomes of a drawing when its area or its cells change.
LAWS = """async () => {
  const draw = await import('/console/draw_grid.js');
  const nothing = { resolution: 2, width: 6, height: 4, origin: [-1, 3], altitude: 3, waypoints: [], blocked: [] };
  const grid = draw.fromValues({ ...nothing, waypoints: [[5, 3], [2, 0]], blocked: [[0, 0], [4, 1]] });
  const empty = draw.fromValues(nothing), plain = (made) => draw.toValues(made);
  return {
    same: plain(grid), west: plain(draw.pulled(grid, [-1, 0], [3.1, 0])), wider: plain(draw.pulled(grid, [1, 1], [20, 0])),
    finer: plain(draw.recelled(grid, 1)), back: plain(draw.recelled(draw.recelled(grid, 1), 2)),
    lattice: plain(draw.between(grid, [12.4, 12], [0.6, 2.4])), free: plain(draw.between(empty, [0.63, 2.4], [9, 9])),
    fence: plain(draw.fenced(grid, [[1, 1], [4, 1], [4, 2], [1, 2]])),
  };
}"""


def middle(x: float, y: float, origin: tuple[float, float] = (10.0, 8.0), cell_m: float = 2.0) -> tuple[float, float]:
    """The middle of a cell [m]."""
    return origin[0] + (x + 0.5) * cell_m, origin[1] + (y + 0.5) * cell_m


def test_a_grid_is_drawn_by_mouse_over_a_picture(browser: Browser, tmp_path: Path) -> None:
    Image.new('RGB', (300, 200), (90, 140, 80)).save(tmp_path / 'ortho.png')
    with served(tmp_path, '--picture', 'ortho.png', '--corners', '0,0 60,40') as address:
        anna = Draughtsman(browser, address)
        anna.says('waypoints is empty; name at least the final position')
        anna.drag((10, 8), (20, 20), (34, 28))
        expect(anna.at('field-width')).to_have_value('12')
        expect(anna.at('field-height')).to_have_value('10')
        anna.at('tool-wall').click()
        anna.drag(middle(5, 0), middle(5, 9))
        anna.at('tool-waypoint').click()
        anna.drag(middle(2, 2))
        anna.drag(middle(9, 2))
        anna.says('there is no way from waypoint [2, 2] to the final position [9, 2]; free some of the 10 blocked cells')
        anna.at('tool-wall').click()
        anna.drag(middle(5, 4))
        anna.says('This grid can be flown.')
        anna.at('tool-waypoint').click()
        anna.drag(middle(9, 2), middle(8, 5), middle(9, 8))
        anna.at('tool-box').click()
        anna.drag(middle(7, 0), middle(8, 1))
        anna.at('undo').click()
        anna.at('redo').click()
        anna.at('tool-fence').click()
        for corner in ((1, 0), (11, 0), (11, 9), (1, 9), (1, 0)):
            anna.drag(middle(*corner))
        anna.says('This grid can be flown.')
        anna.type_into('name', 'garden.yaml')
        anna.shows('saved', f'./advise fly --grid {tmp_path / "garden.yaml"}')
        grid = load_grid(tmp_path / 'garden.yaml')
        assert (grid.origin_enu_m, grid.resolution_m, grid.width, grid.height) == ((10.0, 8.0), 2.0, 12, 10)
        assert [grid.xy(cell) for cell in grid.waypoints] == [(2, 2), (9, 8)]
        walls = {(5, y) for y in range(10) if y != 4} | {(7, 0), (8, 0), (7, 1), (8, 1)} | {(0, y) for y in range(10)}
        assert {grid.xy(cell) for cell in grid.blocked} == walls
        assert not anna.errors


def test_a_grid_is_drawn_by_keys_alone_and_no_file_is_lost(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / 'mine.yaml').write_bytes((ROOT / 'config' / 'grid_6x6.yaml').read_bytes())
    with served(tmp_path, 'mine.yaml') as address:
        anna = Draughtsman(browser, address)
        anna.says('This grid can be flown.')
        anna.at('field-altitude').focus()
        anna.press('Control+a', 'Delete', 'Enter')
        anna.says("key 'altitude' is None; it must be a number")
        anna.press('7', 'Enter', 'Tab')
        anna.says('This grid can be flown.')
        anna.at('board').focus()
        # Three of the four waypoints go, from the lower left corner round; another comes.
        anna.press('Delete', *['ArrowRight'] * 5, 'Delete', *['ArrowUp'] * 5, 'Delete', *['ArrowLeft'] * 3, 'w')
        anna.press('3', 'ArrowDown', 'Enter', 'b', 'b')
        expect(anna.at('cursor')).to_have_text('[2, 4], blocked')
        anna.press('ArrowUp', 'Shift+ArrowLeft', '<')
        expect(anna.at('cursor')).to_have_text('[1, 5], waypoint 1')
        anna.press('Control+z', 'Control+y', '4', 'ArrowDown', 'ArrowDown', 'Enter', 'ArrowDown', 'ArrowLeft', 'Enter')
        anna.press('Control+s')
        anna.shows('exists', 'mine.yaml exists already')
        anna.press('?')
        for scheme in ('light', 'dark'):
            anna.page.emulate_media(color_scheme=scheme)
            assert anna.complaints() == []
        anna.press('Escape')
        anna.at('save-other').press('Enter')
        anna.shows('saved', 'Comments of the file that was opened are not in it.')
        assert (tmp_path / 'mine.yaml').read_bytes() == (ROOT / 'config' / 'grid_6x6.yaml').read_bytes()
        grid = load_grid(tmp_path / 'mine_2.yaml')
        assert grid.altitude_m == 7.0
        assert [grid.xy(cell) for cell in grid.waypoints] == [(1, 5), (0, 5)]
        assert [grid.xy(cell) for cell in grid.blocked] == [(0, 2), (1, 2), (0, 3), (1, 3), (2, 4)]
        anna.page.on('dialog', lambda dialog: dialog.accept())
        anna.page.reload()
        anna.says('This grid can be flown.')
        expect(anna.at('field-altitude')).to_have_value('7')
        assert not anna.errors


def test_a_finger_draws_two_move_and_everything_fits(browser: Browser, tmp_path: Path) -> None:
    text, image = map_texts('house.pgm', Raster(np.eye(8), 1.0, (0.0, 0.0)))
    (tmp_path / 'house.yaml').write_text(text)
    (tmp_path / 'house.pgm').write_bytes(image)
    with served(tmp_path, '--map', 'house.yaml') as address:
        for language in ('en-GB', 'de-DE'):
            anna = Draughtsman(browser, address, language=language)
            for width, height in SIZES.values():
                anna.page.set_viewport_size({'width': width, 'height': height})
                found = anna.page.evaluate(FITS)
                assert (found['small'], found['save'], found['wide']) == ([], True, 0)
                assert found['board'][0] >= 300 and found['board'][1] <= 0
            anna.context.close()
        ben = browser.new_context(viewport={'width': 390, 'height': 844}, has_touch=True, locale='en-GB').new_page()
        ben.goto(address)
        finger = Draughtsman.__new__(Draughtsman)
        finger.page = ben
        finger.says('waypoints is empty')
        ben.locator('[data-test=tool-waypoint]').tap()
        for cell in ((0, 7), (7, 0)):
            ben.touchscreen.tap(*finger.on_screen(*middle(*cell, origin=(0.0, 0.0), cell_m=0.4)))
        ben.locator('[data-test=walls]').tap()
        finger.says('no way from waypoint')
        ben.evaluate('() => scrollTo(0, 0)')
        # Two fingers that part enlarge the map, and draw nothing.
        before, line = ben.evaluate(SCALE), ben.context.new_cdp_session(ben)
        (x, y), spread = finger.on_screen(4.0, 4.0), 20
        for kind, away in (('touchStart', spread), ('touchMove', 2 * spread), ('touchMove', 3 * spread), ('touchEnd', None)):
            points = [] if away is None else [{'x': x - away, 'y': y, 'id': 0}, {'x': x + away, 'y': y, 'id': 1}]
            line.send('Input.dispatchTouchEvent', {'type': kind, 'touchPoints': points})
        assert ben.evaluate(SCALE) > 1.5 * before
        expect(ben.locator('.waypoints li')).to_have_count(2)
        expect(ben.locator('[data-test=field-resolution]')).to_have_value('0.2')


def test_it_lies_on_the_earth(browser: Browser, tmp_path: Path) -> None:
    with served(tmp_path) as address:
        anna = Draughtsman(browser, address)
        anna.press('2', '1', '2')
        anna.at('board').focus()
        anna.press('w', 'ArrowUp', 'ArrowRight', 'w')
        anna.type_into('field-latitude', '47.3977')
        anna.says("key 'origin_wgs84' is None; it must be a number")
        anna.type_into('field-longitude', '8,5456')
        anna.type_into('field-heading', '95°')
        anna.says("key 'heading_deg' is '95°'; it must be a number")
        anna.type_into('field-heading', '95')
        anna.type_into('field-resolution', '0.5')
        anna.says('This grid can be flown.')
        expect(anna.at('field-width')).to_have_value('48')
        Image.new('RGB', (30, 20)).save(tmp_path / 'ortho.png')
        anna.at('picture').set_input_files(tmp_path / 'ortho.png')
        expect(anna.at('corners')).to_have_value('-1,-1 23,15')
        assert anna.complaints() == []
        anna.type_into('corners', '23,15 -1,-1')
        anna.shows('note', 'the first is the lower left one')
        anna.at('on-earth').check()
        anna.type_into('corners', '47.3977,8.5456 47.3978,8.5458')
        anna.page.wait_for_function(f'() => {PAGE}.corners[3][0] === 0 && {PAGE}.corners[1][0] < -10')
        anna.type_into('name', '../out.yaml')
        anna.shows('note', "Not saved: the file's name is '../out.yaml'")
        anna.type_into('name', 'placed.yaml')
        anna.shows('saved', 'placed.yaml')
        place = load_place(tmp_path / 'placed.yaml')
        assert place is not None
        assert (place.latitude_deg, place.longitude_deg, place.heading_deg) == (47.3977, 8.5456, 95.0)
        assert load_grid(tmp_path / 'placed.yaml').n_cells == 48 * 48
        assert not anna.errors


def test_the_session_s_page_leads_to_a_drawing_of_its_grid(graph: Graph, browser: Browser) -> None:
    _, address = start_console(graph, grid_file=str(ROOT / 'config' / 'grid_6x6.yaml'))
    anna = Draughtsman(browser, address, 1440, 900)
    with anna.context.expect_page() as opened:
        anna.at('to-draw').click()
    drawing = opened.value
    expect(drawing.locator('[data-test=verdict]')).to_contain_text('This grid can be flown.')
    expect(drawing.locator('[data-test=name]')).to_have_value('grid_6x6.yaml')
    expect(drawing.get_by_text(f'in {Path.cwd()}')).to_be_visible()
    assert not anna.errors


def test_what_is_drawn_stays_on_the_ground_when_area_and_cells_change(browser: Browser, tmp_path: Path) -> None:
    with served(tmp_path) as address:
        found = Draughtsman(browser, address).page.evaluate(LAWS)
    assert found['same'] == found['back']
    assert (found['west']['origin'], found['west']['width']) == ([3, 3], 4)
    assert (found['west']['waypoints'], found['west']['blocked']) == ([[3, 3], [0, 0]], [[2, 1]])
    assert [found['wider'][key] for key in ('width', 'height', 'origin', 'waypoints')] == [11, 1, [-1, 3], [[5, 3], [2, 0]]]
    assert found['finer']['waypoints'] == [[11, 7], [5, 1]]
    assert sorted(found['finer']['blocked']) == [[0, 0], [0, 1], [1, 0], [1, 1], [8, 2], [8, 3], [9, 2], [9, 3]]
    assert [found['lattice'][key] for key in ('origin', 'width', 'height')] == [[1, 3], 6, 5]
    assert [found['free'][key] for key in ('origin', 'width', 'height')] == [[0.6, 2.4], 4, 3]
    assert len(found['fence']['blocked']) == 6 * 4 - 8 + 1, 'one that was blocked before stays so'
