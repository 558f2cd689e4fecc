"""Who has heard what, by counts on /diagnostics."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from advise_ros.ros.receivers import Receivers, counted

TOPIC = '/drone/cmd_vel'


def said(node: str, count: str, topic: str = TOPIC) -> DiagnosticArray:
    return DiagnosticArray(status=[DiagnosticStatus(name=node, values=[KeyValue(key=topic, value=count)])])


def test_counts_are_read_by_the_full_name_of_the_topic() -> None:
    (status,) = said('/drone/recorder', '7').status
    assert counted(status, TOPIC) == 7
    assert counted(status, '/cmd_vel') == 0
    assert counted(said('/drone/recorder', 'never').status[0], TOPIC) == 0


def test_each_node_has_to_count_more_than_before_we_sent_anything() -> None:
    receivers = Receivers(['/drone/recorder', '/drone/logger'], TOPIC)
    receivers.on_diagnostics(said('/drone/recorder', '40'))  # Somebody else's commands.
    receivers.sent()
    receivers.on_diagnostics(said('/drone/recorder', '40'))
    receivers.on_diagnostics(said('/other/recorder', '80'))
    assert receivers.missing == {'/drone/recorder', '/drone/logger'}
    receivers.on_diagnostics(said('/drone/recorder', '41'))
    assert receivers.missing == {'/drone/logger'}


def test_a_node_that_is_first_heard_of_while_we_send_has_to_count_on() -> None:
    receivers = Receivers(['/logger'], TOPIC)
    receivers.sent()
    receivers.on_diagnostics(said('/logger', '5'))
    assert receivers.missing
    receivers.on_diagnostics(said('/logger', '6'))
    assert not receivers.missing
