"""The exact versions beside a full ROS 2 Jazzy; tools/check_locks.py asks the resolver whether they can be installed."""

from __future__ import annotations

from support.paths import ROOT

TEST_TOOLS = {'pytest', 'hypothesis', 'ruff', 'mypy', 'playwright', 'atheris', 'oxlint', 'codespell'}


def versions(name: str) -> dict[str, str]:
    """Package -> its line up to the hashes."""
    lines = (ROOT / 'requirements' / name).read_text().split('\n')
    return {line.split('==')[0]: line.split(' ')[0] for line in lines if line[:1].isalnum()}


def test_what_runs_has_no_test_tools_and_the_same_versions_as_what_is_tested() -> None:
    runs, tested = versions('system-lock.txt'), versions('system-dev-lock.txt')
    assert not TEST_TOOLS & set(runs)
    assert set(tested) >= TEST_TOOLS
    assert {name: version for name, version in runs.items() if name in tested and tested[name] != version} == {}
