"""What the guard says of itself, with and without commands: nothing in a normal flight, each doubt once."""

from __future__ import annotations

from advise_ros.core.guard.fence import box
from advise_ros.core.guard.monitor import GuardMonitor, MonitorSettings
from advise_ros.core.guard.rules import Command, Limits
from advise_ros.ros.change_log import ChangeLog, GuardLog
from support.log_lines import Lines

DT_S = 0.05
LIMITS = Limits(fence=box((-50.0, -50.0, 0.0), (50.0, 50.0, 20.0)))


class Guarded:
    """A guard whose verdicts are logged twenty times a second.

    Attributes:
        shown: sentences that diagnostics have at WARN, each change.
    """

    def __init__(self) -> None:
        self.monitor, self.lines, self.now_s = GuardMonitor(LIMITS, MonitorSettings()), Lines(), 100.0
        self.log = GuardLog(ChangeLog(self.lines))
        self.shown = ['']

    def tick(self, east_m_s: float | None = None, doubt: str = '', *, positions: bool = True, alarms: bool = True) -> None:
        self.now_s += DT_S
        if positions:
            self.monitor.pose((0.0, 0.0, 5.0), 'map', self.now_s, doubt=doubt)
        reason = ''
        if east_m_s is not None:
            self.monitor.command(Command((east_m_s, 0.0, 0.0), 'map', 0.0), self.now_s)
            verdict = self.monitor.verdict(self.now_s)
            reason = '' if verdict is None else verdict.reason
        else:
            self.monitor.clear()
        said, warns = self.log.look(self.monitor, reason, self.now_s, alarms=alarms)
        worry = said if warns else ''
        if worry != self.shown[-1]:
            self.shown.append(worry)

    def run(self, seconds: float, east_m_s: float | None = None, doubt: str = '', **how: bool) -> None:
        for _ in range(round(seconds / DT_S)):
            self.tick(east_m_s, doubt, **how)


def test_speeding_up_at_each_turn_is_no_warning_however_soon_the_turns_follow() -> None:
    guarded = Guarded()
    for turn in range(60):
        guarded.run(0.5, 2.0 if turn % 2 else -2.0)
    assert guarded.lines.lines == []
    assert guarded.shown == ['']


def test_a_limit_that_lasts_is_one_warning_with_its_words() -> None:
    guarded = Guarded()
    guarded.run(10.0, 8.0)
    guarded.run(3.0, 1.0)
    words = 'speed limited to 3 m/s'
    assert [line.removeprefix('WARN ') for line in guarded.lines.lines[:1]] == [words]
    assert guarded.lines.lines[1].startswith('the limit is over after ')
    assert guarded.shown == ['', words, '']


def test_a_doubt_is_logged_and_shown_though_nobody_commands() -> None:
    guarded = Guarded()
    guarded.run(2.0)
    guarded.run(6.0, doubt='the GPS fix is lost (type 1)')
    guarded.run(3.0)
    began, ended = guarded.lines.lines
    assert began == 'WARN pose refused: the GPS fix is lost (type 1)'
    assert ended.startswith('the doubt is over after ')
    assert guarded.shown == ['', 'pose refused: the GPS fix is lost (type 1)', '']


def test_it_stays_one_doubt_whoever_begins_or_ends_to_command() -> None:
    guarded = Guarded()
    for commanded in (None, 1.0, None, 1.0):
        guarded.run(3.0, commanded, 'no fix')
    guarded.run(3.0, 1.0)
    began, ended = guarded.lines.lines
    assert began == 'WARN pose refused: no fix'
    assert ended.startswith('the doubt is over after ')


def test_late_positions_and_none_any_more_are_doubts_too() -> None:
    guarded = Guarded()
    guarded.run(2.0)
    guarded.run(3.0, positions=False)
    assert guarded.lines.lines == ['WARN pose older than 0.5 s']
    guarded.monitor.pose((0.0, 0.0, 5.0), 'map', guarded.now_s, stamp_ns=10**12)
    guarded.monitor.pose((0.0, 0.0, 5.0), 'map', guarded.now_s + 5.0, stamp_ns=10**12 + 1)
    assert guarded.monitor.position_doubt(guarded.now_s + 5.0).startswith('pose refused: it came 5.0 s late')


def test_a_short_doubt_without_commands_and_a_pose_that_never_came_are_no_news() -> None:
    guarded = Guarded()
    guarded.run(5.0, positions=False)
    guarded.run(1.0)
    guarded.run(0.8, doubt='the position moved oddly')
    guarded.run(5.0)
    assert guarded.lines.lines == []
    assert guarded.shown == ['']


def test_on_the_ground_a_doubt_is_no_alarm_and_in_the_air_it_becomes_one() -> None:
    guarded = Guarded()
    guarded.run(5.0, doubt='no fix', alarms=False)
    assert guarded.lines.lines == ['pose refused: no fix']
    assert guarded.shown == ['']
    guarded.run(5.0, doubt='no fix')
    assert guarded.lines.lines[1:].count('WARN pose refused: no fix') == 1


def test_a_pilot_who_is_silent_while_the_pose_is_doubted_is_not_hidden_by_the_doubt() -> None:
    guarded = Guarded()
    guarded.run(1.0, 1.0)
    for _ in range(60):
        guarded.now_s += DT_S
        guarded.monitor.pose((0.0, 0.0, 5.0), 'map', guarded.now_s, doubt='no fix')
        verdict = guarded.monitor.verdict(guarded.now_s)
        assert verdict is not None
        said = guarded.log.look(guarded.monitor, verdict.reason, guarded.now_s)
    assert said == ('command older than 0.5 s; pose refused: no fix', True)
