"""What was learnt of a site, as it is kept for other routes over it.

Kept are the flights and answers themselves, route by route: what each says depends on the others, and probabilities cell by
cell do not tell that. Where only such probabilities are there (a map drawn by hand, or of cells of another size), they are
what was known `before` the flights.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

from advise_ros.core.advice.advice import Verdict
from advise_ros.core.advice.state import AdviceState
from advise_ros.core.demonstrations.demonstration import Demonstration

UNKNOWN = -1


class KeptFlight(NamedTuple):
    """The moves of a demonstration, with what it is known again by."""

    demonstration_id: str
    window_ns: tuple[int, int]
    states: tuple[int, ...]
    actions: tuple[int, ...]


class KeptAnswer(NamedTuple):
    """What a person said is right and wrong in some states; both empty where all is right."""

    states: tuple[int, ...]
    preferred: tuple[int, ...]
    avoided: tuple[int, ...]
    expert_id: str = ''
    comment: str = ''


class KeptRoute(NamedTuple):
    """What was flown and answered on one route over the site; states are those of its waypoints."""

    waypoints: tuple[int, ...]
    flights: tuple[KeptFlight, ...]
    answers: tuple[KeptAnswer, ...]


@dataclass(frozen=True)
class SitePrior:
    """What was learnt of a site.

    Attributes:
        before: (cells,) probability in per cent that a cell is to be kept out of, UNKNOWN where nothing is known; () nowhere.
        routes: what was flown and answered since, on the same cells.
    """

    before: tuple[int, ...] = ()
    routes: tuple[KeptRoute, ...] = ()

    def __bool__(self) -> bool:
        """Whether anything is known."""
        return bool(self.before or self.routes)

    @property
    def in_words(self) -> str:
        """How much that is."""
        counts = {
            'route': len(self.routes), 'flight': sum(len(one.flights) for one in self.routes),
            'answer': sum(len(one.answers) for one in self.routes),
        }
        known = sum(share != UNKNOWN for share in self.before)
        cells = f'probabilities of {known} of {len(self.before)} cells' if self.before else ''
        kept = ', '.join(f'{number} {name}{"" if number == 1 else "s"}' for name, number in counts.items()) if self.routes else ''
        return ', '.join(filter(None, (cells, kept))) or 'nothing'

    def without(self, route: KeptRoute) -> SitePrior:
        """Without the flights and answers of a route that are among its own, so that nothing counts twice.

        A learner that is started again has them from its recorder and its session file, and from the site's file.
        """
        flights = {one[:2] for one in route.flights}
        answers = {one[:3] for one in route.answers}
        kept = (
            one._replace(
                flights=tuple(flight for flight in one.flights if flight[:2] not in flights),
                answers=tuple(
                    answer for answer in one.answers if one.waypoints != route.waypoints or answer[:3] not in answers
                ),
            )
            for one in self.routes
        )
        return replace(self, routes=tuple(one for one in kept if one.flights or one.answers))

    def with_route(self, route: KeptRoute) -> SitePrior:
        """With what was flown and answered on one more route; the same route is no second one."""
        if not route.flights and not route.answers:
            return self
        rest = self.without(route).routes
        for one in rest:
            if one.waypoints == route.waypoints:
                whole = KeptRoute(route.waypoints, one.flights + route.flights, one.answers + route.answers)
                return replace(self, routes=tuple(whole if other is one else other for other in rest))
        return replace(self, routes=(*rest, route))


NOTHING = SitePrior()


def kept_route(
    waypoints: tuple[int, ...], demonstrations: Iterable[Demonstration], advice: AdviceState,
) -> KeptRoute:
    """What a session says of its route.

    Args:
        waypoints: of the session's grid.
        demonstrations: that stand.
        advice: what was answered.
    """
    flights = (KeptFlight(one.demonstration_id, one.window_ns, one.states, one.actions) for one in demonstrations)
    return KeptRoute(waypoints, tuple(flights), answers_of(advice))


def answers_of(advice: AdviceState) -> tuple[KeptAnswer, ...]:
    """Those that name directions, and those that say of one state that all are right."""
    return tuple(
        KeptAnswer(record.states, record.preferred, record.avoided, record.expert_id, record.comment)
        for record in advice.active
        if record.verdict is Verdict.ANSWER or (record.verdict is Verdict.MIXED and len(record.states) == 1)
    )
