"""The recorded sessions that ship replay, by the fixture that others use for theirs; and the fixture itself."""

from pathlib import Path

import pytest

from advise_ros.replay.pytest_plugin import AdviseBag
from support.session_bag import session_bag

ROOT = Path(__file__).parents[2]
pytest_plugins = ('pytester',)


def test_replay(advise_bag: AdviseBag) -> None:
    report = advise_bag.check()
    checked = {stage.name: stage.checked for stage in report.stages}
    assert min(checked[name] for name in ('demonstrations', 'policies', 'queries')) >= 1


def test_the_sessions_that_ship_are_these() -> None:
    names = ('simulated_session', 'arducopter_session', 'interrupted_session', 'contradictory_answers')
    readme = (ROOT / 'bags' / 'README.md').read_text()
    for name in names:
        assert (ROOT / 'bags' / name / 'metadata.yaml').is_file() and f'`{name}`' in readme
    assert sum(file.stat().st_size for file in (ROOT / 'bags').rglob('*') if file.is_file()) < 2e6


def notes(name: str) -> list[str]:
    return [note for stage in AdviseBag(ROOT / 'bags' / name).replay().stages for note in stage.notes]


def test_each_is_what_its_name_says() -> None:
    assert any('the recording was not finished' in note for note in notes('interrupted_session'))
    undecided = AdviseBag(ROOT / 'bags' / 'contradictory_answers').replay().session.on('advise/advice_log')
    said = [(list(one.value.preferred), list(one.value.avoided), set(one.value.states.tolist())) for one in undecided]
    assert any(a[0] == b[1] and a[2] & b[2] for a in said for b in said)
    assert AdviseBag(ROOT / 'bags' / 'simulated_session').replay().stages[-1].checked > 10


TEST = 'def test_session(advise_bag):\n    advise_bag.check()\n'


def test_each_bag_of_a_directory_is_a_test_case(pytester: pytest.Pytester) -> None:
    good, bad = session_bag(), session_bag()
    bad.entries[bad.where('/cmd_vel')[-6]][2].twist.linear.x += 1e-3
    good.write(pytester.path / 'recordings' / 'good')
    bad.write(pytester.path / 'recordings' / 'bad')
    pytester.makepyfile(TEST)
    arguments = ('-p', 'advise_ros.replay.pytest_plugin') if 'advise_ros' not in _entry_points() else ()
    result = pytester.runpytest_subprocess(*arguments, '-p', 'no:cacheprovider', '--advise-bags', 'recordings', '-v')
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(['*test_session?bad?*', '*does NOT follow*', 'commands: /cmd_vel at *expected*'])


def _entry_points() -> set[str]:
    from importlib.metadata import entry_points

    return {found.name for found in entry_points(group='pytest11')}


def test_a_directory_without_sessions_is_told(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(TEST)
    arguments = ('-p', 'advise_ros.replay.pytest_plugin') if 'advise_ros' not in _entry_points() else ()
    result = pytester.runpytest_subprocess(*arguments, '-p', 'no:cacheprovider')
    assert result.ret != 0
    result.stdout.fnmatch_lines(['*holds no recorded session; name another by --advise-bags*'])


