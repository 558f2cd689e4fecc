"""The question, its map and the answer as text for a terminal, in colour where it has one and by signs where not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from advise_ros.console import wording
from advise_ros.console.board import Section
from advise_ros.console.keyboard import KEYS, help_text
from advise_ros.console.language import Translator
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
# Answers of the log that are shown: beside the map, and below it.
LATEST, LATEST_BELOW = 6, 2
# Columns of the terminal for what stands beside the map, and around the map's cells: numbers of the rows, frame.
SIDE, AROUND_MAP = 46, 8
# Lines of the terminal that the map leaves for the rest.
REST = 16
ROWS_LEAST, COLUMNS_LEAST = 4, 3
TERMINAL = (160, 50)


def screen(
    sections: Mapping[str, Section], sitting: TerminalSession, service: str, namespace: str, size: tuple[int, int] = TERMINAL,
) -> RenderableType:
    """Everything that is to be seen now; `size` is the terminal's, in columns and lines."""
    shown, words = {name: section.value for name, section in sections.items()}, sitting.words
    query = shown.get('query', {'id': 0, 'options': []})
    asked = query.get('said', {}).get(words.code, {'short': query.get('question', ''), 'why': []})
    sentence = asked['short'] if query['id'] else _standing(shown, words)
    parts: list[RenderableType] = [_status(shown, words), Text(sentence, style='bold')]
    parts += [Text(line, style='dim') for line in (asked['why'] if query['id'] and sitting.why else ())]
    if 'map' in shown:
        parts += _map_and_answer(shown, sitting, size)
    parts += [Text(f'! {line}', style='bold red' if fault else 'dim') for line, fault in _troubles(shown, words)]
    if sitting.note:
        parts.append(Text(sitting.note, style='bold'))
    if sitting.help:
        options = [option['word'] for option in query['options']]
        how = calls.how_to_answer(service, namespace, query['id'], options) if query['id'] else ''
        parts.append(Text(f'{help_text(words)}\n{how}', style='dim'))
    else:
        parts.append(Text('   '.join(f'{key.shown}: {words.t(key.text)}' for key in KEYS if key.often), style='dim'))
    return Group(*parts)


def _map_and_answer(shown: Mapping[str, Any], sitting: TerminalSession, size: tuple[int, int]) -> list[RenderableType]:
    """Beside each other where there is room for the whole map, else the map at full width above the answer."""
    grid, (columns, lines) = shown['map'], size
    rows = max(ROWS_LEAST, min(grid['height'], lines - REST))
    legend = Text('   '.join(_legend(shown, sitting)), style='dim')
    if columns >= AROUND_MAP + _cell_width(grid) * grid['width'] + SIDE:
        table = Table.grid(padding=(0, 3))
        rows = max(rows, min(grid['height'], lines - REST + 6))
        side = Group(_answer(shown, sitting), legend, _log(shown, sitting.words, LATEST))
        table.add_row(_map(shown, sitting, grid['width'], rows), side)
        return [table]
    across = max(COLUMNS_LEAST, min(grid['width'], (columns - AROUND_MAP) // _cell_width(grid)))
    return [_map(shown, sitting, across, rows), legend, _answer(shown, sitting), _log(shown, sitting.words, LATEST_BELOW)]


def _cell_width(grid: Mapping[str, Any]) -> int:
    return 5 if len(grid['waypoints']) < 10 else 6


def _status(shown: Mapping[str, Any], words: Translator) -> Text:
    query, learner, graph = shown.get('query'), shown.get('learner', {}), shown.get('graph', {})
    parts = ['advise', words.t('question {id}', id=query['id']) if query and query['id'] else words.t('no question')]
    parts.append(words.tn('{n} answer given', '{n} answers given', learner.get('answers', 0)))
    if 'battery' in shown:
        parts.append(words.t('battery {share}', share=words.percent(shown['battery'] / 100)))
    if 'policy' in shown:
        reached = shown['policy'].get('waypoints', 0)
        parts.append(words.t('{n} of {all} waypoints reached', n=reached, all=len(shown.get('map', {}).get('waypoints', ()))))
    if learner.get('phase') == 'learning':
        parts.append(words.t('learning …'))
    out = Text(' · '.join(parts), style='reverse')
    if graph and not graph.get('learner'):
        out.append(' · ' + words.t('THE LEARNER IS SILENT, answers are kept'), style='bold red')
    return out


def _standing(shown: Mapping[str, Any], words: Translator) -> str:
    """Where the learner stands while it asks nothing, and what to do next."""
    learner = shown.get('learner')
    if learner is None:
        return words.t('No learner is heard yet.')
    if learner['phase'] == 'learning':
        return words.t('The drone is learning …')
    if learner['enough']:
        return words.t('I know enough: I would fly it now. Next: T takes off, f flies the policy.')
    if learner['phase'] == 'waiting':
        return words.t('Waiting for flights. Fly the route once or twice; each flight is a demonstration.')
    if learner['phase'] == 'done':
        return words.t('No question is left. Next: T takes off, f flies the policy.')
    return str(learner['message'])


def _troubles(shown: Mapping[str, Any], words: Translator) -> list[tuple[str, bool]]:
    """What nodes complain of, and whether it is a fault: what the guard says is one in a flight, not to a drone that hovers."""
    flies = shown.get('flight', {}).get('phase') in ('flying', 'to start')
    bad = [node for node in shown.get('nodes', []) if node['level'] in ('error', 'silent') or _is_guard(node)]
    return [
        (f'{node["name"]}: {_last_words(node, words)}', flies or node['level'] != 'warn') for node in bad
    ]


def _last_words(node: Mapping[str, Any], words: Translator) -> str:
    silent = node['level'] == 'silent'
    return words.t('silent; it said last: {text}', text=node['message']) if silent else str(node['message'])


def _is_guard(node: Mapping[str, Any]) -> bool:
    return node['level'] == 'warn' and node['name'] in ('guard', 'mavlink_bridge')


def _map(shown: Mapping[str, Any], sitting: TerminalSession, columns: int, rows: int) -> RenderableType:
    """A section of one map: number of a waypoint, most flown direction, what the drone would fly; asked cells stand on orange."""
    grid, layer, words = shown['map'], min(sitting.layer, shown['map']['layers'] - 1), sitting.words
    size = grid['width'] * grid['height']
    asked = {state % size for state in shown.get('query', {}).get('states', []) if state // size == layer}
    preview = sitting.preview if sitting.preview and sitting.preview['ok'] else {'changed': [], 'actions': []}
    changed = {s % size: a for s, a in zip(preview['changed'], preview['actions'], strict=True) if s // size == layer}
    look = Look(shown, layer, asked, changed, _moment(shown, sitting, layer), _ways(shown, layer), sitting)
    west, south = _corner(look, columns, rows)
    width, out = _cell_width(grid), Text()
    for y in reversed(range(south, south + rows)):
        out.append(f'{y + 1:>3} ', style='dim')
        for cell in range(y * grid['width'] + west, y * grid['width'] + west + columns):
            text, style = _cell(look, cell)
            out.append(f'{text:<{width}}', style=style)
        out.append('\n')
    out.append('    ' + ''.join(f'{x + 1:^{width}}' for x in range(west, west + columns)), style='dim')
    title = words.t('To waypoint {n}', n=f'{layer + 1} / {grid["layers"]}')
    if columns < grid['width'] or rows < grid['height']:
        title += ' · ' + words.t('a section; Ctrl+arrows move it')
    return Panel(out, title=title, expand=False)


def _corner(look: Look, columns: int, rows: int) -> tuple[int, int]:
    """The south-western cell of the section around what is asked, as far as the person has not moved it."""
    grid, pan = look.shown['map'], look.sitting.pan
    drawing = look.sitting.drawing
    about = {drawing.cell} if drawing is not None else look.asked or {grid['waypoints'][look.layer]}
    columns_rows = zip(*((cell % grid['width'], cell // grid['width']) for cell in about), strict=True)
    middle = [sorted(at)[len(about) // 2] for at in columns_rows]
    low = [
        max(0, min(most - seen, at - seen // 2 + moved))
        for at, moved, seen, most in zip(middle, pan, (columns, rows), (grid['width'], grid['height']), strict=True)
    ]
    return low[0], low[1]


def _legend(shown: Mapping[str, Any], sitting: TerminalSession) -> list[str]:
    words = sitting.words
    signs = [('#', words.t('asked about')), ('→', words.t('flown')), ('▶', words.t('drone would fly'))]
    signs += [('X', words.t('wall')), ('@', words.t('drone'))]
    if sitting.preview is not None:
        signs.append(('*', words.t('would change')))
    if shown.get('query', {}).get('options'):
        signs += [('?', words.t('in dispute')), ('y, n', words.t('only the way after that answer'))]
    if sitting.heat:
        signs.append(('0 … 9', words.t('sure … unsure')))
    elif shown.get('site'):
        signs.append(('1 … 9', words.t('tenths likely to be kept out of')))
    if sitting.moment >= 0:
        moments = shown['query']['moments']
        signs.append(('1 2 3 …', f'{moments[sitting.moment]["id"]} ({sitting.moment + 1} / {len(moments)})'))
    return [f'{sign} {text}' for sign, text in signs]


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
    """Five or six characters: mark, waypoint, flown, would fly, how unsure or how likely to be kept out of; and their colours."""
    shown, grid = look.shown, look.shown['map']
    if cell in grid['blocked']:
        return '  X  ', WALL
    state = look.layer * grid['width'] * grid['height'] + cell
    number = str(grid['waypoints'].index(cell) + 1) if cell in grid['waypoints'] else ''
    number = f'{number:>{_cell_width(grid) - 4}}'
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
    words, query = sitting.words, shown.get('query', {})
    if not query.get('id'):
        return Text(words.t('Nothing to answer now.'))
    out, labels = Text(), query.get('said', {}).get(words.code, {}).get('options', [])
    for key, (head, tail) in zip(OPTION_KEYS, labels, strict=False):
        out.append(f' {key} ', style='reverse bold')
        out.append(f' {head}: {tail}\n', style='bold')
    if labels and sitting.why:
        saved = words.number(query['worth'], 1)
        out.append(words.t('The answer is expected to save {n} steps.', n=saved) + '\n')
    out.append(sitting.sentence + '\n', style='bold')
    if sitting.preview is not None:
        _append_preview(out, shown, sitting)
    return out


def _append_preview(out: Text, shown: Mapping[str, Any], sitting: TerminalSession) -> None:
    """The progress that the answer makes first, then what changes."""
    words, preview, grid = sitting.words, sitting.preview or {}, shown['map']
    if not preview['ok']:
        out.append(preview['message'] + '\n', style='red')
        return
    before, after = (
        _reached(preview[when], grid, reaches)
        for when, reaches in zip(('before', 'after'), preview['reaches'], strict=True)
    )
    gains = [words.t('waypoints reached {before} → {after} of {all}', before=before, after=after, all=grid['layers'])]
    if preview.get('keepOut'):
        entered = [len(cells) for cells in preview['entered']]
        gains.insert(0, words.t('keep-out cells crossed {before} → {after}', before=entered[0], after=entered[1]))
    out.append(', '.join(gains) + '\n', style='bold')
    out.append(words.tn('▲ {n} cell would change', '▲ {n} cells would change', len(preview['changed'])) + '\n')
    for advice in preview.get('contradicts', []):
        said = next((wording.given_in_words(words, entry) for entry in shown.get('log', []) if entry['id'] == advice), '')
        against = words.t('! contradicts answer {id} ({said}); t takes it back', id=advice, said=said)
        out.append(against + '\n', style='bold red')


def _reached(route: Sequence[int], grid: Mapping[str, Any], reaches: bool) -> int:
    """How many waypoints a route of states reaches, the final one included."""
    if reaches or not route:
        return int(grid['layers']) if reaches else 0
    return int(route[-1] // (grid['width'] * grid['height']))


def _log(shown: Mapping[str, Any], words: Translator, latest: int) -> Text:
    out = Text()
    for entry in reversed(shown.get('log', [])[-latest:]):
        gone, bought = f' ({words.t("taken back")})' if entry['retracted'] else '', _bought(shown, entry, words)
        clash = '! ' if entry['id'] in shown.get('learner', {}).get('contradictions', []) else ''
        said, by = wording.given_in_words(words, entry), entry['by'] or words.t('someone')
        out.append(f'{clash}{entry["id"]}: {said}, {by}{_when(shown, entry, words)}{gone}\n', style='dim' if gone else '')
        out.append(f'   {bought}\n' if bought and not gone else '', style='dim')
    return out


def _when(shown: Mapping[str, Any], entry: Mapping[str, Any], words: Translator) -> str:
    """The wall's time of an answer, where it is known."""
    early = entry['entry'] <= shown.get('gains', {'since': 0})['since']
    return f', {words.clock(entry["at"])}' if 'at' in entry and not (early and entry.get('simulated')) else ''


def _bought(shown: Mapping[str, Any], entry: Mapping[str, Any], words: Translator) -> str:
    """What an answer has changed, together with those that were learnt with it."""
    told = shown.get('gains', {'since': 0, 'gains': []})
    if entry['entry'] <= told['since']:
        return ''
    gain = next((one for one in told['gains'] if one['entry'] >= entry['entry']), None)
    if gain is None:
        return ''
    share = words.percent(gain['success'])
    one, many = 'changed {n} cell, then {share} expected', 'changed {n} cells, then {share} expected'
    return words.tn(one, many, gain['changed'], share=share)
