"""The demo's story: fly rough demonstrations, learn, ask, learn again, fly round the garden, and then another route."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_msgs.action import Fly
from advise_msgs.msg import AdviceQuery, LearnerStatus, Policy
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.errors import AdviseError
from advise_ros.core.people.known_site import Site
from advise_ros.demo import browser
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.graph import LISTENERS, DemoGraph
from advise_ros.demo.options import DemoOptions, DemoSites
from advise_ros.demo.tracks import TrackLog, entered_cells
from advise_ros.report.pictures import FlownTrack
from advise_ros.ros import calls, convert, convert_advice
from advise_ros.ros.graph_client import GraphClient
from advise_ros.ros.maps import FULL
from advise_ros.supervisor import Child, Supervisor

# By the supervisor's clock, which stands still while the machine is too busy for the processes.
STEP_PATIENCE_S = 120.0
FLIGHT_PATIENCE_S = 300.0
SETTLE_PATIENCE_S = 30.0
HUMAN_PATIENCE_S = 86_400.0
ADDRESS = re.compile(r'http://\S+token=\S+')
# The policies that are flown, in words.
KINDS = {'before': 'without advice', 'after': 'with advice', 'other': 'another route, no new lesson'}


@dataclass(frozen=True)
class DemoFlight:
    """One flight of a learnt policy in the simulator.

    Attributes:
        kind: 'before' and 'after' advice, or the 'other' route.
        arrived: all waypoints were reached in order.
        entered: cells that the person wants kept out of and that a position lay in, ascending.
        steps, seconds, message: as the policy node says.
    """

    kind: str
    arrived: bool
    entered: tuple[int, ...]
    steps: int
    seconds: float
    message: str

    @property
    def success(self) -> bool:
        return self.arrived and not self.entered


class DemoPolicy(NamedTuple):
    """What was learnt at some time of the session.

    Attributes:
        greedy: (n,) action of each state.
        keep_out: (cells,) probability that the person wants the cell kept out of; None where the learner has no such belief.
    """

    greedy: npt.NDArray[np.uint8]
    keep_out: npt.NDArray[np.float64] | None


@dataclass
class DemoSession:
    """What the session left in which the drone learnt; `flights` and `learnt` without and with advice."""

    demonstrations: tuple[Demonstration, ...] = ()
    queries: dict[int, AdviceQuery] = field(default_factory=dict)
    policies: dict[int, Policy] = field(default_factory=dict)
    log: tuple[AdviceRecord, ...] = ()
    flights: list[DemoFlight] = field(default_factory=list)
    learnt: list[DemoPolicy] = field(default_factory=list)


class Story:
    """Runs the sessions one after another in one running graph."""

    def __init__(self, options: DemoOptions, sites: DemoSites, supervisor: Supervisor, console: DemoConsole) -> None:
        self._options = options
        self.sites = sites
        self._supervisor = supervisor
        self._console = console
        self._graph = DemoGraph(options, sites.shown.grid, supervisor)
        self._track_log = TrackLog()
        self._address = ''
        self.tracks: list[FlownTrack] = []
        self.client = GraphClient('demo', supervisor.check, supervisor.clock)
        self.client.on_pose = self._track_log.on_pose

    def start(self) -> None:
        """Start the simulated vehicle."""
        flights = 'once' if self._options.flights == 1 else f'{self._options.flights} times'
        self._console.say(f'simulator, bridge, recorder and learner start; a clumsy pilot flies the route {flights}')
        self._graph.start_vehicle()

    def close(self) -> None:
        self.client.close()

    # -- sessions ----------------------------------------------------------------------------
    def flown_session(self, bag: Path) -> DemoSession:
        """Demonstrations, a policy, answers and a better policy, all of it flown and recorded into the bag."""
        session = DemoSession()
        logger, recorder = self._graph.start_recording(bag)
        learning = self._graph.start_learning(self._options.seed, None)
        page = self._open_page() if self._options.expert == 'human' else None
        self._fly_demonstrations(session)
        self._before_and_after(session)
        if page is not None:  # It knows the route that was asked about, not the other one.
            self._supervisor.stop(page)
        if self._supervisor.stop(logger):
            raise AdviseError(f'the logger did not finish its bag {bag} and was killed; its log: {logger.log_path}')
        self._supervisor.stop(recorder, *learning)
        return session

    def other_session(self, site: Site) -> DemoFlight:
        """Another route over the site by the map that was kept of it: no demonstration, no question."""
        self.client.forget_session()
        learning = self._graph.start_other_route()
        self._wait_for_policy(0)
        flight = self._fly_policy('other', site)
        self._supervisor.stop(*learning)
        return flight

    def _fly_demonstrations(self, session: DemoSession) -> None:
        wanted = self._options.flights
        self.client.wait('recorder and logger to hear positions', self._positions_are_heard, STEP_PATIENCE_S)
        pilot = self._graph.start_pilot()
        with self._console.bar('demonstrations', wanted) as bar:
            self.client.wait(
                'the end of the demonstrations',
                lambda: bar.at(len(self.client.demonstrations)) and pilot.process.poll() is not None,
                wanted * FLIGHT_PATIENCE_S,
            )
        self.client.wait(
            f'{wanted} demonstrations of the recorder after as many flights (its log tells what became of them)',
            lambda: len(self.client.demonstrations) >= wanted, SETTLE_PATIENCE_S,
        )
        self._supervisor.check()
        session.demonstrations = tuple(map(convert.demonstration_from_msg, self.client.demonstrations.values()))
        for demonstration in session.demonstrations:
            positions = self._track_log.between(*demonstration.window_ns)
            reached = demonstration.end_reason == EndReason.FINAL_WAYPOINT
            self.tracks.append(FlownTrack('demonstration', positions, reached))
        moves = sum(len(demonstration.states) for demonstration in session.demonstrations)
        self._console.say(f'{wanted} rough demonstrations flown and recorded, {moves} moves')

    def _positions_are_heard(self) -> bool:
        return self.client.is_heard('pose', *LISTENERS)

    def _before_and_after(self, session: DemoSession) -> None:
        self._wait_for_policy(len(session.demonstrations))
        session.flights.append(self._fly_policy('before', self.sites.shown))
        session.learnt.append(self._learnt())
        expert = self._start_expert()
        patience = HUMAN_PATIENCE_S if expert is None else FLIGHT_PATIENCE_S
        self.client.wait('the last answer', lambda: self._phase() == LearnerStatus.DONE, patience)
        self.client.wait('the log of the answers', lambda: len(self._log()) >= self._answers(), SETTLE_PATIENCE_S)
        session.queries, session.policies = dict(self.client.queries), dict(self.client.policies)
        session.log = self._log()
        asked = {0: 'no question was worth asking', 1: 'one question asked and answered'}
        self._console.say(asked.get(self._answers(), f'{self._answers()} questions asked and answered'))
        session.flights.append(self._fly_policy('after', self.sites.shown))
        session.learnt.append(self._learnt())
        if expert is not None:
            self._supervisor.stop(expert)

    # -- learning ----------------------------------------------------------------------------
    def _phase(self) -> int | None:
        return self.client.learner.phase if self.client.learner is not None else None

    def _log(self) -> tuple[AdviceRecord, ...]:
        return tuple(map(convert_advice.advice_from_msg, self.client.advice))

    def _answers(self) -> int:
        return self.client.learner.answers if self.client.learner is not None else 0

    def _wait_for_policy(self, demonstrations: int) -> None:
        def learnt() -> bool:
            status = self.client.learner
            if status is not None and status.phase == LearnerStatus.FAILED:
                raise AdviseError(f'the learner failed: {status.message}')
            return (
                status is not None
                and status.phase in (LearnerStatus.ASKING, LearnerStatus.DONE)
                and status.demonstrations == demonstrations
                and status.policy_version in self.client.policies
            )

        self.client.wait('a policy learnt from all demonstrations', learnt, STEP_PATIENCE_S)

    def _learnt(self) -> DemoPolicy:
        """The newest policy and the map of its time, which came before it was flown."""
        policy = self.client.policies[max(self.client.policies)]
        site_map = self.client.site_maps.get(convert.stamp_to_ns(policy.header.stamp))
        shares = None if site_map is None else np.array(site_map.data, dtype=np.float64).clip(0.0) / FULL
        return DemoPolicy(np.array(policy.greedy, dtype=np.uint8), shares)

    def _start_expert(self) -> Child | None:
        """The simulated expert, or None: a person answers, on the page or by service call."""
        if self._options.expert == 'simulated':
            return self._graph.start_expert(self._options.seed)
        self._console.say(f'[bold]Your turn:[/bold] the drone asks, you answer on the page ({self._address})')
        self._console.say('or in another terminal, by ./advise ask.')
        if self.sites.shown.keep_out.any():
            self._console.say('What you want, and no map says: keep out of your garden (#), however long the way round.')
            for row in site_rows(self.sites.shown):
                self._console.rich.print(f'           {row}', markup=False)
        _HumanPrompt(self.client, self._console).install()
        return None

    def _open_page(self) -> Child:
        """Start the page and tell where it is: its address stands in its log."""
        console = self._graph.start_console()
        found = self.client.wait('the page', lambda: ADDRESS.search(console.log_path.read_text()), STEP_PATIENCE_S)
        self._address = found[0]
        self._console.say(f'[bold]Watch and answer in a browser:[/bold] {self._address}')
        browser.show(self._address)
        return console

    # -- flying ------------------------------------------------------------------------------
    def _fly_policy(self, kind: str, site: Site) -> DemoFlight:
        """Fly the newest policy over a site's route."""
        self.client.take_off(STEP_PATIENCE_S)
        result = self.client.fly(site.grid.waypoints[-1], FLIGHT_PATIENCE_S)
        positions = self._track_log.between(self.client.flying_since_ns, self._track_log.last_stamp_ns())
        self.tracks.append(FlownTrack(kind, positions, bool(result.success)))
        flight = _flight(kind, result, entered_cells(site, positions))
        mark = '[green]reached the end[/green]' if flight.arrived else f'[red]did not reach the end[/red] ({flight.message})'
        garden = ''
        if site.keep_out.any():
            garden = ', [red]through the garden[/red]' if flight.entered else ', [green]round the garden[/green]'
        self._console.say(f'{KINDS[kind]}: {mark}{garden}, {flight.steps} steps')
        self.client.land(STEP_PATIENCE_S)
        return flight


def _flight(kind: str, result: Fly.Result, entered: tuple[int, ...]) -> DemoFlight:
    return DemoFlight(kind, bool(result.success), entered, int(result.steps), float(result.seconds), str(result.message))


def site_rows(site: Site) -> list[str]:
    """The site as text, north up: # what is to be kept out of, digits the waypoints, x blocked cells."""
    grid = site.grid
    marks = dict.fromkeys(range(grid.n_cells), '.')
    marks.update(dict.fromkeys(np.flatnonzero(site.keep_out).tolist(), '#'))
    marks.update(dict.fromkeys(grid.blocked, 'x'))
    marks.update({cell: str(number) for number, cell in enumerate(grid.waypoints, start=1)})
    return [' '.join(marks[grid.cell(x, y)] for x in range(grid.width)) for y in reversed(range(grid.height))]


class _HumanPrompt:
    """Prints each new question with the lines that answer it."""

    def __init__(self, client: GraphClient, console: DemoConsole) -> None:
        self._client = client
        self._console = console
        self._shown = 0

    def install(self) -> None:
        self._client.node.create_timer(0.2, self._show)
        self._show()

    def _show(self) -> None:
        query = self._client.query
        if query is None or query.query_id in (0, self._shown):
            return
        self._shown = query.query_id
        self._console.say(f'[bold]Question {query.query_id}:[/bold] {query.question}')
        service, words = self._client.node.resolve_service_name('advise/answer'), [option.word for option in query.options]
        for line in calls.how_to_answer(service, self._client.node.get_namespace(), query.query_id, words).splitlines():
            self._console.rich.print(f'           {line}', markup=False)
