"""The question, its map and the answer as text for a terminal, in colour where it has one and by signs where not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from advise_ros.console import views
from advise_ros.console.board import Section
from advise_ros.console.terminal_session import TerminalSession
from advise_ros.console.views import LEVELS
from advise_ros.ros import calls

FLIES, FLOWN = '▲▶▼◀', '↑→↓←'
ASKED, CHANGED, WALL = 'black on #f5c451', 'black on #7fdcb8', 'on #555555'
PART, MOMENT, CURSOR, DISPUTED = 'black on #7cc4ee', 'black on #56b4e9', 'reverse bold', 'bold black on #ff9a6c'
# From sure to unsure, a tenth a step.
HEAT = [f'black on #{255 - 13 * step:02x}{255 - 16 * step:02x}{255 - 6 * step:02x}' for step in range(10)]
# From free to kept out of, likewise.
SITE = ['', *(f'black on #{255 - 3 * step:02x}{240 - 14 * step:02x}{235 - 17 * step:02x}' for step in range(1, 10))]
# The keys of the answers of one gesture.
OPTION_KEYS = 'yn'
KEYS = (
    'arrows: right   Shift+arrows: wrong   Enter: send   s: skip   u: unsure   m: these cells differ   Backspace: undo   '
    'Space: HOLD   ?: all keys   q: leave'
)
OPTION_HELP = 'y, n: answer at once   '

ALL_KEYS = (
    'arrows (or h j k l): right   Shift+arrows (H J K L): wrong   o: all others wrong   Enter: send   s: skip   u: unsure   '
    'm: these cells differ (x marks)   Backspace: undo   t: take an earlier answer back   1-9: map   r: how it was flown   '
    'v: where it is unsure   Space: HOLD   f: fly   T: take off   G: land   R: record   S: stop   D: discard   q: leave'
)
PERCENT = 100.0
# Answers of the log that are shown.
LATEST = 6


def screen(sections: Mapping[str, Section], sitting: TerminalSession, service: str, namespace: str) -> RenderableType:
    """Everything that is to be seen now."""
    shown = {name: section.value for name, section in sections.items()}
    parts: list[RenderableType] = [_status(shown)]
    query = shown.get('query', {'id': 0, 'question': ''})
    parts.append(Text(query['question'] or shown.get('learner', {}).get('message', 'No learner is heard yet.'), style='bold'))
    if 'map' in shown:
        side = Group(_answer(shown, sitting), _log(shown))
        table = Table.grid(padding=(0, 3))
        table.add_row(_map(shown, sitting), side)
        parts.append(table)
    parts += [Text(f'! {line}', style='bold red') for line in _troubles(shown)]
    if sitting.note:
        parts.append(Text(sitting.note, style='bold'))
    gestures = OPTION_HELP if query.get('options') else ''
    parts.append(Text(gestures + (ALL_KEYS if sitting.help else KEYS), style='dim'))
    if query['id']:
        words = [option['word'] for option in query['options']]
        parts.append(Text(calls.how_to_answer(service, namespace, query['id'], words), style='dim'))
    return Group(*parts)


def _status(shown: Mapping[str, Any]) -> Text:
    query, learner, graph = shown.get('query'), shown.get('learner', {}), shown.get('graph', {})
    asks = f'question {query["id"]}' if query and query['id'] else 'no question'
    out = Text(f'advise · {asks} · {learner.get("answers", 0)} answers given', style='reverse')
    if 'battery' in shown:
        out.append(f' · battery {shown["battery"]} %')
    if 'policy' in shown:
        out.append(f' · expected success {PERCENT * shown["policy"]["success"]:.0f} %')
    if learner.get('phase') == 'learning':
        out.append(' · learning …')
    if graph and not graph.get('learner'):
        out.append(' · THE LEARNER IS SILENT, answers are kept', style='bold red')
    if learner.get('enough'):
        out.append(f' · I would fly it now (nothing is worth {learner["least"]:g} {learner["unit"]} any more)')
    return out


def _troubles(shown: Mapping[str, Any]) -> list[str]:
    """What nodes complain of, the guard's reason for a stop included."""
    bad = [node for node in shown.get('nodes', []) if node['level'] in ('error', 'silent') or _is_guard(node)]
    silent = {'silent': 'silent; it said last: '}
    return [f'{node["name"]}: {silent.get(node["level"], "")}{node["message"]}' for node in bad]


def _is_guard(node: Mapping[str, Any]) -> bool:
    return node['level'] == 'warn' and node['name'] in ('guard', 'mavlink_bridge')


def _map(shown: Mapping[str, Any], sitting: TerminalSession) -> RenderableType:
    """One map: number of a waypoint, most flown direction, what the drone would fly; asked cells stand on orange."""
    grid, layer = shown['map'], min(sitting.layer, shown['map']['layers'] - 1)
    size = grid['width'] * grid['height']
    asked = {state % size for state in shown.get('query', {}).get('states', []) if state // size == layer}
    preview = sitting.preview if sitting.preview and sitting.preview['ok'] else {'changed': [], 'actions': []}
    changed = {s % size: a for s, a in zip(preview['changed'], preview['actions'], strict=True) if s // size == layer}
    look = Look(shown, layer, asked, changed, _moment(shown, sitting, layer), _ways(shown, layer), sitting)
    out = Text()
    for y in reversed(range(grid['height'])):
        for cell in range(y * grid['width'], (y + 1) * grid['width']):
            words, style = _cell(look, cell)
            out.append(words, style=style)
        out.append('\n')
    out.append('# asked  → flown  ▶ would fly\n* would change  X wall  @ drone', style='dim')
    if shown.get('query', {}).get('options'):
        out.append('\n? in dispute  y, n: only the way after that answer', style='dim')
    if sitting.heat:
        out.append('\n0 sure … 9 unsure', style='dim')
    elif shown.get('site'):
        out.append('\n1 … 9 tenths likely to be kept out of (v: where it is unsure)', style='dim')
    if sitting.moment >= 0:
        moments = shown['query']['moments']
        out.append(f'\n1 2 3 … {moments[sitting.moment]["id"]} ({sitting.moment + 1} of {len(moments)})', style='dim')
    return Panel(out, title=f'on the way to waypoint {layer + 1} of {grid["layers"]}', expand=False)


class Look(NamedTuple):
    """What one map shows.

    Attributes:
        asked, changed, moment: cells of the question, cell -> action of the preview, cell -> place in a flown moment.
        ways: cell -> key of the answer after which alone the drone would fly there.
    """

    shown: Mapping[str, Any]
    layer: int
    asked: set[int]
    changed: Mapping[int, int]
    moment: Mapping[int, int]
    ways: Mapping[int, str]
    sitting: TerminalSession


def _moment(shown: Mapping[str, Any], sitting: TerminalSession, layer: int) -> dict[int, int]:
    """Cell -> when it was flown, counted from 1, of the moment that is replayed."""
    moments = shown.get('query', {}).get('moments', [])
    if not 0 <= sitting.moment < len(moments) or moments[sitting.moment]['layer'] != layer:
        return {}
    return {cell: step for step, cell in enumerate(moments[sitting.moment]['cells'], start=1)}


def _ways(shown: Mapping[str, Any], layer: int) -> dict[int, str]:
    """Cell -> key of the answer after which alone the drone would fly there, in one layer."""
    size = shown['map']['width'] * shown['map']['height']
    options = shown.get('query', {}).get('options', [])
    ways = [{state % size for state in option['route'] if state // size == layer} for option in options]
    return {
        cell: key for key, way, others in zip(OPTION_KEYS, ways, reversed(ways), strict=False) for cell in way - others
    }


def _cell(look: Look, cell: int) -> tuple[str, str]:
    """Five characters: mark, waypoint, flown, would fly, how unsure or how likely to be kept out of; and their colours."""
    shown, grid = look.shown, look.shown['map']
    if cell in grid['blocked']:
        return '  X  ', WALL
    state = look.layer * grid['width'] * grid['height'] + cell
    number = str(grid['waypoints'].index(cell) + 1) if cell in grid['waypoints'] else ' '
    action = look.changed.get(cell, int(shown['policy']['greedy'][state]) if 'policy' in shown else -1)
    over = look.layer == grid['layers'] - 1 and cell == grid['waypoints'][-1]
    flies = FLIES[action] if action >= 0 and not over else ' '
    flown = LEVELS[min(look.moment[cell], len(LEVELS) - 1)] if cell in look.moment else _flown(shown, state)
    sign, style = _mark(look, cell, state)
    tenths = _unsure(look, state) or _kept_out(look, cell)
    if tenths and style in ('', ASKED):
        style = (HEAT if look.sitting.heat else SITE)[int(tenths)]
    return f'{sign}{number}{flown}{flies}{tenths or " "}', style


def _mark(look: Look, cell: int, state: int) -> tuple[str, str]:
    """The most important thing about a cell."""
    drawing = look.sitting.drawing
    marks = (
        (drawing is not None and (drawing.layer, drawing.cell) == (look.layer, cell), '+', CURSOR),
        (drawing is not None and state in drawing.part, '%', PART),
        (cell == _drone_cell(look.shown), '@', ''), (cell in look.moment, ' ', MOMENT),
        (cell in look.shown.get('query', {}).get('disputed', ()), '?', DISPUTED), (cell in look.changed, '*', CHANGED),
        (cell in look.ways, look.ways.get(cell, ''), ''), (cell in look.asked, '#', ASKED),
    )
    found = [(sign, style) for holds, sign, style in marks if holds]
    sign = found[0][0] if found else ' '
    return sign, next((style for _, style in found if style), '')


def _unsure(look: Look, state: int) -> str:
    if not look.sitting.heat or 'policy' not in look.shown:
        return ''
    return str(9 * LEVELS.index(look.shown['policy']['unsure'][state]) // (len(LEVELS) - 1))


def _kept_out(look: Look, cell: int) -> str:
    """Tenths of probability, nothing below one."""
    site = look.shown.get('site')
    if look.sitting.heat or not site or site['keepOut'][cell] < 10:
        return ''
    return str(min(site['keepOut'][cell] // 10, 9))


def _flown(shown: Mapping[str, Any], state: int) -> str:
    """The direction that was flown most often."""
    flown = shown.get('flown', {'states': []})
    if state not in flown['states']:
        return ' '
    at = 4 * flown['states'].index(state)
    taken = flown['taken'][at:at + 4]
    return FLOWN[taken.index(max(taken))]


def _drone_cell(shown: Mapping[str, Any]) -> int:
    if 'drone' not in shown:
        return -1
    grid, (east, north, *_) = shown['map'], shown['drone']
    x, y = (int((at - low) // grid['resolution']) for at, low in zip((east, north), grid['origin'], strict=True))
    return y * grid['width'] + x if 0 <= x < grid['width'] and 0 <= y < grid['height'] else -1


def _answer(shown: Mapping[str, Any], sitting: TerminalSession) -> RenderableType:
    if not shown.get('query', {}).get('id'):
        return Text('Nothing to answer now.')
    out, preview = Text(), sitting.preview
    for key, option in zip(OPTION_KEYS, shown['query']['options'], strict=False):
        out.append(f' {key} ', style='reverse bold')
        out.append(f' {option["label"]}\n\n', style='bold')
    if shown['query']['options']:
        out.append(f'The answer is expected to save {shown["query"]["worth"]:.1f} steps.\n\n')
    out.append(sitting.sentence + '\n', style='bold')
    if preview is not None and not preview['ok']:
        out.append(preview['message'] + '\n', style='red')
    elif preview is not None:
        before, after = (PERCENT * share for share in preview['success'])
        out.append(f'{len(preview["changed"])} cells would change; expected success {before:.0f} % -> {after:.0f} %\n')
        if preview.get('keepOut'):
            entered = [len(cells) for cells in preview['entered']]
            out.append(f'cells likely to be kept out of that the route enters: {entered[0]} -> {entered[1]}\n')
    for advice in preview.get('contradicts', []) if preview else []:
        said = next((views.in_words(entry) for entry in shown.get('log', []) if entry['id'] == advice), '')
        out.append(f'! contradicts answer {advice} ({said}); t takes it back\n', style='bold red')
    return out


def _log(shown: Mapping[str, Any]) -> Text:
    out = Text()
    for entry in reversed(shown.get('log', [])[-LATEST:]):
        gone, bought = ' (taken back)' if entry['retracted'] else '', _bought(shown, entry)
        clash = '! ' if entry['id'] in shown.get('learner', {}).get('contradictions', []) else ''
        words = f'{clash}{entry["id"]}: {views.in_words(entry)}, {entry["by"] or "someone"}{gone}\n'
        out.append(words, style='dim' if gone else '')
        out.append(f'   {bought}\n' if bought and not gone else '', style='dim')
    return out


def _bought(shown: Mapping[str, Any], entry: Mapping[str, Any]) -> str:
    """What an answer has changed, together with those that were learnt with it."""
    told = shown.get('gains', {'since': 0, 'gains': []})
    if entry['entry'] <= told['since']:
        return ''
    gain = next((one for one in told['gains'] if one['entry'] >= entry['entry']), None)
    return f'changed {gain["changed"]} cells, then {PERCENT * gain["success"]:.0f} % expected' if gain else ''
