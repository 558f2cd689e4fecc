"""The question, its map and the answer as text for a terminal, in colour where it has one and by signs where not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from advise_ros.console import views
from advise_ros.console.board import Section
from advise_ros.console.sitting import Sitting
from advise_ros.ros import calls

FLIES, FLOWN = '▲▶▼◀', '↑→↓←'
ASKED, CHANGED, WALL = 'black on #f5c451', 'black on #7fdcb8', 'on #555555'
KEYS = (
    'arrows (or h j k l): right   Shift+arrows (H J K L): wrong   o: all others wrong   Enter: send   s: skip   u: unsure   '
    'm: these cells differ   Backspace: undo   t: take an earlier answer back   1-9: map   Space: HOLD   f: fly   q: leave'
)
PERCENT = 100.0
# Answers of the log that are shown.
LATEST = 6


def screen(sections: Mapping[str, Section], sitting: Sitting, service: str, namespace: str) -> RenderableType:
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
    if sitting.note:
        parts.append(Text(sitting.note, style='bold'))
    parts.append(Text(KEYS, style='dim'))
    if query['id'] and sitting.help:
        parts.append(Text(calls.how_to_answer(service, namespace, query['id']), style='dim'))
    elif query['id']:
        parts.append(Text(f'?: how to answer by ros2 service call {service}', style='dim'))
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
        out.append(' · enough advice')
    return out


def _map(shown: Mapping[str, Any], sitting: Sitting) -> RenderableType:
    """One map: number of a waypoint, most flown direction, what the drone would fly; asked cells stand on orange."""
    grid, layer = shown['map'], min(sitting.layer, shown['map']['layers'] - 1)
    size = grid['width'] * grid['height']
    asked = {state % size for state in shown.get('query', {}).get('states', []) if state // size == layer}
    preview = sitting.preview if sitting.preview and sitting.preview['ok'] else {'changed': [], 'actions': []}
    changed = {s % size: a for s, a in zip(preview['changed'], preview['actions'], strict=True) if s // size == layer}
    out = Text()
    for y in reversed(range(grid['height'])):
        for cell in range(y * grid['width'], (y + 1) * grid['width']):
            words, style = _cell(shown, layer, cell, asked, changed)
            out.append(words, style=style)
        out.append('\n')
    out.append('# asked  → flown  ▶ would fly\n* would change  X wall  @ drone', style='dim')
    return Panel(out, title=f'on the way to waypoint {layer + 1} of {grid["layers"]}', expand=False)


def _cell(
    shown: Mapping[str, Any], layer: int, cell: int, asked: set[int], changed: Mapping[int, int],
) -> tuple[str, str]:
    grid, size = shown['map'], shown['map']['width'] * shown['map']['height']
    if cell in grid['blocked']:
        return '  X  ', WALL
    state = layer * size + cell
    number = str(grid['waypoints'].index(cell) + 1) if cell in grid['waypoints'] else ' '
    sign = '@' if cell == _drone_cell(shown) else '*' if cell in changed else '#' if cell in asked else ' '
    action = changed.get(cell, int(shown['policy']['greedy'][state]) if 'policy' in shown else -1)
    flies = FLIES[action] if action >= 0 and not (layer == grid['layers'] - 1 and cell == grid['waypoints'][-1]) else ' '
    return f'{sign}{number}{_flown(shown, state)}{flies} ', CHANGED if cell in changed else ASKED if cell in asked else ''


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


def _answer(shown: Mapping[str, Any], sitting: Sitting) -> RenderableType:
    if not shown.get('query', {}).get('id'):
        return Text('Nothing to answer now.')
    out, preview = Text(sitting.sentence + '\n', style='bold'), sitting.preview
    if preview is not None and not preview['ok']:
        out.append(preview['message'] + '\n', style='red')
    elif preview is not None:
        before, after = (PERCENT * share for share in preview['success'])
        out.append(f'{len(preview["changed"])} cells would change; expected success {before:.0f} % -> {after:.0f} %\n')
    for advice in preview.get('contradicts', []) if preview else []:
        said = next((views.in_words(entry) for entry in shown.get('log', []) if entry['id'] == advice), '')
        out.append(f'! contradicts answer {advice} ({said}); t takes it back\n', style='bold red')
    return out


def _log(shown: Mapping[str, Any]) -> Text:
    out = Text()
    for entry in reversed(shown.get('log', [])[-LATEST:]):
        gone = ' (taken back)' if entry['retracted'] else ''
        clash = '! ' if entry['id'] in shown.get('learner', {}).get('contradictions', []) else ''
        words = f'{clash}{entry["id"]}: {views.in_words(entry)}, {entry["by"] or "someone"}{gone}\n'
        out.append(words, style='dim' if gone else '')
    return out
