"""A question in the person's language, from what its message holds; and why a request was refused, by its code."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from advise_ros.console.language import Translator, mark
from advise_ros.core.advice.advice import Code, Meaning
from advise_ros.core.grid.grid import Grid
from advise_ros.core.numerics import Ints
from advise_ros.core.site.wording import ON_PURPOSE, always_avoided, seen

DIRECTIONS = (mark('NORTH'), mark('EAST'), mark('SOUTH'), mark('WEST'))
# A direction of fewer moves than this share is not named.
NAMED_SHARE = 0.1
REFUSALS = {
    Code.UNKNOWN_QUERY: mark('the learner does not know this question'),
    Code.STALE_QUERY: mark('another question is open by now'),
    Code.ALREADY_ANSWERED: mark('this question is answered already'),
    Code.INVALID_ACTION: mark('there is no such direction'),
    Code.OVERLAPPING_SETS: mark('a direction cannot be both right and wrong'),
    Code.EMPTY_SETS: mark('name at least one right and one wrong direction'),
    Code.CONTRADICTION: mark('it contradicts an earlier answer, and the learner is strict: take one of them back'),
    Code.BUDGET_SPENT: mark('all answers that the learner takes are given'),
    Code.NOT_SAVED: mark('the answer could not be written to the session file'),
    Code.INVALID_PART: mark('mark some of the cells asked about, not all'),
}


def names(words: Translator, actions: Iterable[int]) -> str:
    """E.g. 'NORTH, EAST'."""
    return ', '.join(words.t(DIRECTIONS[action]) for action in actions)


def cells(words: Translator, number: int) -> str:
    """E.g. '3 cells'."""
    return words.tn('{n} cell', '{n} cells', number)


def place(words: Translator, grid: Grid, where: Sequence[int]) -> str:
    """Cells as the map's axes have them, counted from 1, e.g. 'columns 2-4, row 1'."""
    columns, rows = [cell % grid.width + 1 for cell in where], [cell // grid.width + 1 for cell in where]
    west, east, south, north = min(columns), max(columns), min(rows), max(rows)
    one = words.t('column {from}', **{'from': west})
    across = one if west == east else words.t('columns {from}-{to}', **{'from': west, 'to': east})
    row = words.t('row {from}', **{'from': south})
    up = row if south == north else words.t('rows {from}-{to}', **{'from': south, 'to': north})
    return f'{across}, {up}'


def times(words: Translator, number: int) -> str:
    """E.g. 'twice'."""
    few = {0: words.t('never'), 1: words.t('once'), 2: words.t('twice')}
    return few.get(number) or words.tn('{n} time', '{n} times', number)


def asked(words: Translator, query: Mapping[str, Any], grid: Grid, taken: Ints) -> dict[str, Any]:
    """The question in at most twelve words, the reasons for it, and head and tail of each answer of one gesture.

    Args:
        words: of the language.
        query: as `views.query_view` has it.
        grid: of the session.
        taken: (states, 4) moves flown.
    """
    if query['options']:
        return _site(words, query, grid, taken)
    layers = sorted({grid.next_waypoint(state) + 1 for state in query['states']})
    to = words.t('waypoint {n}', n=layers[0]) if len(layers) == 1 else words.t('several waypoints')
    ways = words.tn(
        'Flying to {where}: which way in the yellow cell?', 'Flying to {where}: which way in the yellow cells?',
        len(query['states']), where=to,
    )
    where = place(words, grid, [grid.cell_of(state) for state in query['states']])
    why = [words.t('{cells}: {place}.', cells=cells(words, len(query['states'])), place=where), _flown(words, query['taken'])]
    if len(layers) > 1:
        why.insert(1, words.t('On the way to waypoints {list}.', list=', '.join(map(str, layers))))
    likely = [action for action in sorted(range(4), key=lambda a: -query['policy'][a]) if query['policy'][action] >= NAMED_SHARE]
    shares = ', '.join(f'{words.t(DIRECTIONS[a])} {words.percent(query["policy"][a])}' for a in likely)
    return {'short': ways, 'why': [*why, words.t('The drone would fly: {shares}.', shares=shares)], 'options': []}


def _flown(words: Translator, taken: Sequence[int]) -> str:
    """What was counted, e.g. '39 moves there, split four ways: ...'."""
    total = sum(taken)
    if not total:
        return words.t('Nobody flew there yet.')
    ranked = [action for action in sorted(range(4), key=lambda a: -taken[a]) if taken[action] >= NAMED_SHARE * total]
    if len(ranked) == 1:
        way = words.t(DIRECTIONS[ranked[0]])
        return words.tn('{n} move there: {way}.', '{n} moves there, as good as all: {way}.', total, way=way)
    split = words.t('split {ways} ways', ways=(words.t('two'), words.t('three'), words.t('four'))[len(ranked) - 2])
    shares = ', '.join(f'{words.t(DIRECTIONS[action])} {words.percent(taken[action] / total)}' for action in ranked)
    return words.tn(
        '{n} move there, {split}: {shares}.', '{n} moves there, {split}: {shares}.', total, split=split, shares=shares,
    )


def _site(words: Translator, query: Mapping[str, Any], grid: Grid, taken: Ints) -> dict[str, Any]:
    layer, disputed = grid.next_waypoint(query['states'][0]), tuple(query['disputed'])
    moves, number, to = seen(grid, layer, disputed, taken), len(disputed), words.t('waypoint {n}', n=layer + 1)
    on_purpose = query['options'][0]['word'] == ON_PURPOSE[0]
    if on_purpose:
        short = words.tn(
            'Flying to {where}, you always avoided this cell. On purpose?',
            'Flying to {where}, you always avoided these {n} cells. On purpose?', number, where=to,
        )
    else:
        short = words.tn(
            'Flying to {where}: should I keep out of this cell?', 'Flying to {where}: should I keep out of these {n} cells?',
            number, where=to,
        )
    if always_avoided(moves):
        flown = words.tn('{n} move beside them, none into them.', '{n} moves beside them, none into them.', moves.beside)
    elif moves.into:
        into, past = times(words, moves.into), times(words, moves.beside)
        flown = words.t('You flew into them {into} and past them {past}.', into=into, past=past)
    else:
        flown = words.t('You were never near them.')
    heads = (words.t('On purpose'), words.t('By accident')) if on_purpose else (words.t('Yes'), words.t('No'))
    tails = {Meaning.KEEP_OUT: words.t('keep out'), Meaning.FLY_THROUGH: words.t('fly through')}
    labels = [[head, tails[Meaning(option['meaning'])]] for head, option in zip(heads, query['options'], strict=True)]
    where = words.t('{cells}: {place}.', cells=cells(words, number), place=place(words, grid, disputed))
    return {'short': short, 'why': [where, flown], 'options': labels}


def reply_in(words: Translator, reply: Mapping[str, Any]) -> dict[str, Any]:
    """A reply with its message in the person's language, where it has a code of ours or a text of the console's own."""
    text = REFUSALS.get(reply.get('code', Code.OK)) if not reply['ok'] else None
    if text is not None:
        return {**reply, 'message': words.t(text)}
    if 'say' in reply:
        text, given = reply['say']
        return {**reply, 'message': words.t(text, **given)}
    return dict(reply)


def given_in_words(words: Translator, entry: Mapping[str, Any]) -> str:
    """An answer of the log, e.g. 'NORTH, EAST, not SOUTH'."""
    others = (
        '', words.t('skipped'), words.t('unsure'), words.t('these cells differ'),
        words.tn('split off {n} cell', 'split off {n} cells', len(entry['states'])),
    )
    if entry['verdict']:
        return others[entry['verdict']]
    return words.t('{right}, not {wrong}', right=names(words, entry['preferred']), wrong=names(words, entry['avoided']))
