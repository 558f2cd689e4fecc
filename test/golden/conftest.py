"""A recorded session for the tests of replay."""

import copy
from functools import cache

import pytest

from advise_ros.replay import learning
from support.session_bag import SessionBag, session_bag

learn_cached = cache(learning.learn)


@pytest.fixture(scope='session')
def good() -> SessionBag:
    """It replays; not to be changed."""
    return session_bag()


@pytest.fixture
def bag(good: SessionBag) -> SessionBag:
    """A copy to be tampered with."""
    return copy.deepcopy(good)


@pytest.fixture
def learn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same policy is learnt in each test: a pure function's result may be kept."""
    monkeypatch.setattr(learning, 'learn', learn_cached)
