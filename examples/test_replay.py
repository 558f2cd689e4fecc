"""Recorded sessions as tests: pytest examples/test_replay.py --advise-bags DIRECTORY

Where advise_ros is installed, pytest has the fixture `advise_bag`: one session after the other.
"""


def test_the_same_decisions_follow_from_each_session(advise_bag):
    advise_bag.check()


def test_a_faster_flight_asks_the_same_questions(advise_bag):
    report = advise_bag.replay(['policy.speed_m_s:=2.0'])
    assert all(stage.agrees for stage in report.stages if stage.name != 'commands')
