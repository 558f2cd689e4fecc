"""What reads bytes and numbers of others, as functions of bytes: fuzzed by run.py, replayed by test_corpus.py.

Each raises nothing but AssertionError, when a promise is broken.
"""

from __future__ import annotations

import functools
import math
import struct

import numpy as np

from advise_ros.core.advice.advice import Answer, Verdict
from advise_ros.core.demonstrations.demonstration import EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.samples import CommandSamples, PoseSamples, Recording
from advise_ros.core.learning.session import Session
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.companion import Companion, Settings
from advise_ros.mavlink.framing import LONGEST_FRAME, SPOKEN, Framer
from advise_ros.mavlink.signing import SigningClock, Verifier
from support.learning import ROUND_TRIP, ready

KEY = bytes(range(32))
SAMPLE = struct.Struct('<hddd')
FURTHEST_M = mav.FURTHEST_M


def framing(data: bytes) -> None:
    """Bytes of a link: only sound messages come out, memory is bounded, no wild number reaches the vehicle's facts."""
    framer, companion = Framer(), Companion(Settings())
    now_s = 0.0
    for at in range(0, len(data), 48):
        for message in framer.stream(data[at:at + 48]):
            assert message.get_msgId() in SPOKEN
            companion.observe(message, now_s)
        companion.step(now_s)
        assert framer.waiting_bytes <= LONGEST_FRAME
        now_s += 0.05
        _facts_are_sane(companion, now_s)
    whole = Framer().datagram(data)
    assert all(message.get_msgId() in SPOKEN for message in whole)
    assert Framer(Verifier(KEY, SigningClock(0))).datagram(data) == []


def _facts_are_sane(companion: Companion, now_s: float) -> None:
    motion, attitude = companion.vehicle.motion, companion.vehicle.attitude
    assert motion is None or all(abs(value) <= FURTHEST_M for value in (*motion.position_enu_m, *motion.velocity_enu_m_s))
    assert attitude is None or all(math.isfinite(value) for value in attitude)
    text = companion.status(now_s).text
    assert len(text) <= 400
    assert text.isprintable()


def discretising(data: bytes) -> None:
    """Samples of a flight, any number in them: states and actions exist, each sample is accounted for."""
    samples = [SAMPLE.unpack_from(data, at) for at in range(0, len(data) - SAMPLE.size + 1, SAMPLE.size)]
    half = len(samples) // 2
    poses = PoseSamples(*_arrays(samples[:half]))
    recording = Recording(poses, CommandSamples(*_arrays(samples[half:])))
    flown = discretise(ROUND_TRIP, recording, (0, 2**62), DiscretiseSettings(), 'fuzz', EndReason.STOPPED)
    assert len(flown.states) == len(flown.actions) == len(flown.stamps_ns)
    assert all(0 <= state < ROUND_TRIP.n_states for state in flown.states)
    assert all(0 <= action < 4 for action in flown.actions)
    assert list(flown.stamps_ns) == sorted(flown.stamps_ns)
    assert flown.audit.samples <= len(poses.stamps_ns)


def _arrays(samples: list[tuple[float, ...]]) -> tuple[np.ndarray, np.ndarray]:
    """Stamps from differences in units of 10 ms, so that a fuzzer finds flights; vectors as they come."""
    stamps = np.cumsum([1_000_000_000, *[int(s[0]) * 10_000_000 for s in samples]])[1:] if samples else np.empty(0)
    return np.asarray(stamps, dtype=np.int64), np.array([s[1:] for s in samples], dtype=np.float64).reshape(-1, 3)


@functools.cache
def _session() -> Session:
    return ready(0)


def answering(data: bytes) -> None:
    """Any answer: what is accepted is sound, what is refused changes nothing, and always there are words."""
    session = _session()
    answer = _answer(data)
    before = (session.log, session.query)
    outcome = session.check(answer)
    assert (session.log, session.query) == before
    assert outcome.message
    assert outcome.accepted == (outcome.record is not None) == (outcome.code == 0)
    if outcome.accepted and answer.verdict == Verdict.ANSWER:
        assert answer.preferred and answer.avoided
        assert not set(answer.preferred) & set(answer.avoided)
        assert set(answer.preferred) | set(answer.avoided) <= {0, 1, 2, 3}


def _answer(data: bytes) -> Answer:
    """Small numbers first, so that a fuzzer soon asks about the open query."""
    padded = data + bytes(8)
    n_preferred, n_avoided, n_part = padded[2] % 6, padded[3] % 6, padded[4] % 6
    rest = list(data[5:])
    preferred, rest = rest[:n_preferred], rest[n_preferred:]
    avoided, rest = rest[:n_avoided], rest[n_avoided:]
    query = _session().query
    asked = query.query_id if query is not None and padded[0] < 128 else int.from_bytes(padded[:2], 'little') - 64
    words = bytes(rest[n_part:]).decode('utf-8', 'replace')
    return Answer(asked, padded[1], tuple(preferred), tuple(avoided), 'fuzz', words, tuple(rest[:n_part]))


TARGETS = {'framing': framing, 'discretising': discretising, 'answering': answering}
