"""Parameters that were set while nodes ran are made again by replay, each from when on it counted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from advise_ros.commands.replay import run
from advise_ros.core.errors import InputError
from advise_ros.core.flight.policy_flight import FlightPlan, PolicyFlight
from advise_ros.recording.savedsession import LiveSession
from advise_ros.replay.live import Live
from advise_ros.replay.session import read_session
from advise_ros.settings import learn_settings
from support.session_bag import GRID, SessionBag

SECOND_NS = 1_000_000_000


def changed_session() -> SessionBag:
    """A budget that is spent and then raised, and two flights at two speeds."""
    bag = SessionBag()
    bag.advise = replace(bag.advise, budget=1)
    bag.restarts += [(node, bag.parameters(node), bag.now_ns) for node in bag.nodes]
    bag.nodes = ()
    session = LiveSession(GRID, learn_settings(bag.advise), bag.advise.budget)
    for wrong_turns in ((), range(GRID.n_states)):
        session.add(bag.demonstrate(wrong_turns))
        learned = bag.learn(session)
    assert learned.query is not None
    bag.set('advise', budget=0)
    session.change(learn_settings(bag.advise), bag.advise.budget)
    learned = bag.learn(session)
    assert learned.query is None
    bag.set('advise', enough=0.5, budget=3)
    session.change(learn_settings(bag.advise), bag.advise.budget)
    learned = bag.learn(session)
    assert learned.query is not None and learned.version == 4
    for speed_m_s in (0.7, 2.5):
        bag.set('policy', speed_m_s=speed_m_s)
        plan = FlightPlan(GRID, tuple(int(action) for action in learned.greedy))
        bag.fly(PolicyFlight(plan, bag.policy.seek_settings()), learned.version)
        bag.now_ns += 20 * SECOND_NS
    bag.set('policy', speed_m_s=1.0)
    return bag


pytestmark = pytest.mark.usefixtures('learn_once')


@pytest.fixture(name='bag', scope='module')
def made_bag() -> SessionBag:
    return changed_session()


def test_what_was_set_in_flight_replays_to_the_byte(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([str(bag.write(tmp_path / 'bag'))]) == 0, capsys.readouterr().out


@pytest.mark.parametrize(('lost', 'stage'), [(0, 'queries'), (1, 'policies'), (2, 'commands'), (3, 'commands')])
def test_a_change_that_the_bag_lacks_is_missed(
    bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str], lost: int, stage: str,
) -> None:
    less = replace(bag, entries=list(bag.entries))
    del less.entries[less.where('/parameter_events')[lost]]
    assert run([str(less.write(tmp_path / 'bag'))]) == 1
    assert stage in capsys.readouterr().out


def test_the_real_nodes_do_not_live_through_it_again(bag: SessionBag, tmp_path: Path) -> None:
    session = read_session(bag.write(tmp_path / 'bag'))
    with pytest.raises(InputError, match='parameters of advise, policy were set while it ran'):
        Live(session, speed=1.0, domain=0)
