"""The session file and the session that rests on it."""

import json
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from advise_ros.core.advice.advice import AdviceRecord, Answer, Code, Verdict
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.recording.savedsession import LiveSession, SavedSession
from advise_ros.recording.sessionfile import SessionFile
from support.learning import BY_CLUSTERS
from support.walks import GRID_4X4, walk

RECORDS = (
    AdviceRecord(1, 1, (4, 5, 63), (1,), (0, 2, 3), Verdict.ANSWER, 'anna', 'über die "Wiese"\nzurück'),
    AdviceRecord(2, 2, (7,), (), (), Verdict.SKIP),
    AdviceRecord(2, 2, (7,), (), (), Verdict.SKIP, retracted=True),
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A session file with three records, query 3 asked last."""
    file = SessionFile(tmp_path / 'session.jsonl', GRID_4X4)
    for number, record in enumerate(RECORDS):
        file.append_asked(number + 1)
        file.append_advice(record, 100 + number)
    file.close()
    return file.path


def test_what_was_appended_is_read_back(path: Path) -> None:
    file = SessionFile(path, GRID_4X4)
    assert tuple(entry.record for entry in file.loaded.entries) == RECORDS
    assert [entry.stamp_ns for entry in file.loaded.entries] == [100, 101, 102]
    assert file.loaded.last_query_id == 3
    assert file.loaded.dropped == ()
    file.close()


def test_a_file_cut_anywhere_keeps_every_whole_line_and_goes_on(path: Path) -> None:
    content = path.read_bytes()
    ends = [at for at, byte in enumerate(content) if byte == ord('\n')]
    cuts = {*range(0, len(content), 41), *range(25), *(at + step for at in ends for step in (-1, 0, 1))}
    for cut in sorted(cuts - {len(content)}):
        path.write_bytes(content[:cut])
        whole = content[:cut].count(b'\n') + (content[cut : cut + 1] == b'\n')
        torn = cut > 0 and content[cut - 1 : cut] != b'\n' and content[cut : cut + 1] != b'\n'
        file = SessionFile(path, GRID_4X4)
        kept = tuple(entry.record for entry in file.loaded.entries)
        assert kept == RECORDS[: max(0, whole - 1) // 2]
        assert bool(file.loaded.dropped) == torn
        file.append_advice(RECORDS[0], 7)
        file.close()
        again = SessionFile(path, GRID_4X4)
        assert tuple(entry.record for entry in again.loaded.entries) == (*kept, RECORDS[0])
        assert again.loaded.dropped == ()
        again.close()


def test_what_was_cut_off_is_set_aside(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:-9])
    torn = content[:-9].rpartition(b'\n')[2]
    file = SessionFile(path, GRID_4X4)
    file.close()
    assert f'({len(torn)} bytes, kept in session.jsonl.damaged)' in file.loaded.dropped[0]
    assert path.with_name('session.jsonl.damaged').read_bytes() == torn + b'\n'


@pytest.mark.parametrize('line', [
    '{"advice": {"advice_id": 1}, "stamp_ns": 5}',
    '{"asked": -1}',
    '{"asked": true}',
    '[1, 2]',
    'null',
    '\x00\x00\x00',
    json.dumps({'advice': {'advice_id': 9, 'query_id': 9, 'states': [64], 'preferred': [1], 'avoided': [0],
                           'verdict': 'ANSWER', 'expert_id': '', 'comment': '', 'retracted': False}, 'stamp_ns': 1}),
    json.dumps({'advice': {'advice_id': 9, 'query_id': 9, 'states': [3], 'preferred': [4], 'avoided': [0],
                           'verdict': 'ANSWER', 'expert_id': '', 'comment': '', 'retracted': False}, 'stamp_ns': 1}),
])  # fmt: skip
def test_a_damaged_line_is_named_and_the_others_are_kept(path: Path, line: str) -> None:
    lines = path.read_text().splitlines()
    path.write_text('\n'.join([*lines[:3], line, *lines[3:]]) + '\n')
    file = SessionFile(path, GRID_4X4)
    file.close()
    assert tuple(entry.record for entry in file.loaded.entries) == RECORDS
    assert file.loaded.dropped == ('line 4 is damaged',)


def test_a_file_for_another_grid_is_refused_in_words(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(InputError, match=r'belongs to another grid \(4 x 4 cells of 2 m .* this one: 4 x 4 cells of 3 m'):
        SessionFile(path, replace(GRID_4X4, resolution_m=3.0))
    assert path.read_bytes() == before


OTHERS = ('my diary', 'my diary\n', '{"a": 1}\n', '{"advise_session": 1}\n', '[]\n', '{"a": 1}', '\n\n')


@pytest.mark.parametrize('content', OTHERS)
def test_another_file_is_refused_and_left_as_it_is(tmp_path: Path, content: str) -> None:
    path = tmp_path / 'diary.txt'
    path.write_text(content)
    with pytest.raises(InputError, match='it is not a session file'):
        SessionFile(path, GRID_4X4)
    assert path.read_text() == content


def test_a_later_format_is_refused(path: Path) -> None:
    path.write_text(path.read_text().replace('"advise_session": 1', '"advise_session": 2'))
    with pytest.raises(InputError, match='its format is 2, this version reads 1'):
        SessionFile(path, GRID_4X4)


def test_two_learners_do_not_write_one_file(path: Path) -> None:
    first = SessionFile(path, GRID_4X4)
    with pytest.raises(InputError, match='another learner is writing it'):
        SessionFile(path, GRID_4X4)
    first.close()
    SessionFile(path, GRID_4X4).close()


def test_a_file_that_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='cannot be opened'):
        SessionFile(tmp_path / 'nowhere' / 'session.jsonl', GRID_4X4)


# -- the session on it -----------------------------------------------------------------------
@contextmanager
def disk_full_at(n_bytes: int) -> Iterator[None]:
    """Files of this process cannot grow past this size."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def asking(path: Path) -> SavedSession:
    """A session with its first question open."""
    saved = SavedSession(LiveSession(GRID_4X4, BY_CLUSTERS), path)
    saved.session.add(walk(GRID_4X4, 0))
    learn(saved)
    return saved


def learn(saved: SavedSession) -> None:
    saved.session.learn()
    assert saved.session.query is not None
    saved.note_asked(saved.session.query.query_id)


def test_an_answer_that_cannot_be_written_did_not_happen(tmp_path: Path) -> None:
    saved = asking(tmp_path / 'session.jsonl')
    before = (tmp_path / 'session.jsonl').read_bytes()
    answer = Answer(1, Verdict.ANSWER, (0,), (1,))
    with disk_full_at(len(before) + 20):
        outcome = saved.commit(lambda session: session.submit(answer), 5)
    assert (outcome.accepted, outcome.code, outcome.record) == (False, Code.NOT_SAVED, None)
    assert 'cannot be written' in outcome.message
    assert (tmp_path / 'session.jsonl').read_bytes() == before
    assert saved.session.log == ()
    assert saved.commit(lambda session: session.submit(answer), 6).accepted
    saved.close()


def test_a_query_id_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    saved = asking(tmp_path / 'session.jsonl')
    with disk_full_at((tmp_path / 'session.jsonl').stat().st_size), pytest.raises(AdviseError, match='cannot be written'):
        saved.note_asked(2)
    saved.close()


def test_a_restored_session_learns_the_same_and_uses_no_query_id_again(tmp_path: Path) -> None:
    first = asking(tmp_path / 'session.jsonl')
    first.commit(lambda session: session.submit(Answer(1, Verdict.ANSWER, (0,), (1,))), 5)
    learn(first)
    first.close()
    second = asking(tmp_path / 'session.jsonl')
    assert first.session.learned is not None and second.session.learned is not None
    assert second.session.learned.digest == first.session.learned.digest
    assert second.session.query is not None and second.session.query.query_id == 3
    assert second.session.check(Answer(2, Verdict.SKIP)).code == Code.STALE_QUERY
    assert second.session.check(Answer(1, Verdict.SKIP)).code == Code.ALREADY_ANSWERED
    second.close()


def test_without_a_file_nothing_is_kept() -> None:
    saved = SavedSession(LiveSession(GRID_4X4, BY_CLUSTERS), '')
    saved.session.add(walk(GRID_4X4, 0))
    learn(saved)
    assert saved.commit(lambda session: session.submit(Answer(1, Verdict.SKIP)), 5).accepted
    assert saved.loaded.entries == ()
    saved.close()
