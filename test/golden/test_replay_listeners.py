"""A demonstration that differs because the recorder did not hear what the logger heard."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from advise_ros.commands import replay
from support.session_bag import session_bag


@pytest.mark.parametrize(('share', 'said'), [
    (0.5, 'the recorder did not receive them all'), (1.0, ''), (2.0, 'the logger did not receive them all'),
])
def test_it_is_told_which_of_them_heard_less(share: float, said: str, tmp_path: Path) -> None:
    bag = session_bag()
    index = bag.where('/demonstration')[0]
    _, log_time_ns, demonstration = bag.entries[index]
    demonstration.audit.ambiguous_actions += 3
    commands = sum(bag.entries[one][1] <= log_time_ns for one in bag.where('/cmd_vel'))
    values = [KeyValue(key='/cmd_vel', value=str(round(share * commands)))]
    told = DiagnosticArray(status=[DiagnosticStatus(name='/recorder', values=values)])
    bag.entries.insert(index + 1, ('/diagnostics', log_time_ns, told))
    report = tmp_path / 'report.json'
    assert replay.run([str(bag.write(tmp_path / 'bag')), '--json', str(report)]) == 1
    (stage,) = [stage for stage in json.loads(report.read_text())['stages'] if stage['name'] == 'demonstrations']
    assert 'audit.ambiguous_actions is 3, expected 0' in stage['difference']
    assert [said in note for note in stage['notes']] == [True] * bool(said), stage['notes']
