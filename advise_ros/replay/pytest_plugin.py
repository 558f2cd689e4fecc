"""Recorded sessions as test cases: the fixture `advise_bag` runs a test once for each bag in a directory.

    def test_replay(advise_bag):
        advise_bag.check()

The directory is `bags` beside pytest's ini file, or `--advise-bags DIRECTORY`, or `advise_bags = DIRECTORY` in the
ini file. Bags without a session (nothing but flights, say) are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from advise_ros.replay.report import ReplayReport

# Everything else is imported when it is needed: pytest loads this module in every run.
DEFAULT_DIRECTORY = 'bags'


class AdviseBag:
    """One recorded session.

    Attributes:
        path: the bag.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def replay(self, overrides: Sequence[str] = (), against: str | Path | None = None) -> ReplayReport:
        """The report of `replay`: overrides as `advise.clusters:=8`, against as a bag or a file by `replay --json`.

        Raises:
            InputError: the bag, an override or the baseline is no good.
        """
        from dataclasses import replace  # noqa: PLC0415

        from advise_ros.replay import against as beside  # noqa: PLC0415
        from advise_ros.replay.check import check  # noqa: PLC0415
        from advise_ros.replay.overrides import parse  # noqa: PLC0415

        report = check(self.path, overrides=parse(overrides))
        if against is None:
            return report
        baseline = beside.load_baseline(against)
        return replace(report, baseline=baseline.name, beside=beside.against(report, baseline))

    def check(self, against: str | Path | None = None) -> ReplayReport:
        """Fail the test, with the first difference of each stage, unless the session follows from its bag."""
        from advise_ros.core.errors import AdviseError  # noqa: PLC0415

        __tracebackhide__ = True
        try:
            report = self.replay(against=against)
        except AdviseError as problem:
            pytest.fail(str(problem), pytrace=False)
        if not report.agrees:
            lines = [f'{stage.name}: {stage.difference}' for stage in report.asked_stages if stage.difference]
            pytest.fail('\n'.join((f'{self.path}: {report.verdict}', *lines, report.asked)), pytrace=False)
        return report


def pytest_addoption(parser: pytest.Parser) -> None:
    help_text = f'directory of recorded sessions for the fixture advise_bag (default: {DEFAULT_DIRECTORY})'
    parser.getgroup('advise_ros').addoption('--advise-bags', metavar='DIRECTORY', help=help_text)
    parser.addini('advise_bags', help_text, default=DEFAULT_DIRECTORY)


def pytest_generate_tests(metafunc: Any) -> None:
    if 'advise_bag' not in metafunc.fixturenames:
        return
    directory = _directory(metafunc.config)
    sessions = list(_sessions(directory))
    if not sessions:
        raise pytest.UsageError(f'{directory} holds no recorded session; name another by --advise-bags or advise_bags')
    metafunc.parametrize('advise_bag', sessions, ids=[path.name for path in sessions], indirect=True)


@pytest.fixture
def advise_bag(request: pytest.FixtureRequest) -> AdviseBag:
    """One of the recorded sessions; see advise_ros.replay.pytest_plugin."""
    return AdviseBag(request.param)


def _directory(config: pytest.Config) -> Path:
    named = config.getoption('--advise-bags')
    return Path(named) if named else config.rootpath / str(config.getini('advise_bags'))


def _sessions(directory: Path) -> Iterator[Path]:
    from advise_ros.core.errors import LogError  # noqa: PLC0415
    from advise_ros.recording.sources import find_recordings  # noqa: PLC0415
    from advise_ros.replay.session import holds_session  # noqa: PLC0415

    if not directory.is_dir():
        return
    try:
        found = find_recordings(directory)
    except LogError:  # An empty one.
        return
    yield from (path for path in found if path.suffix != '.tlog' and holds_session(path))
