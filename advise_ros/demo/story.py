"""The demo's story: fly rough demonstrations, learn, fail, ask, learn again, fly well, replay."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from advise_msgs.action import Fly
from advise_msgs.msg import AdviceQuery, LearnerStatus, Policy
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.errors import AdviseError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.trial import fly
from advise_ros.demo import browser
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.graph import LISTENERS, DemoGraph
from advise_ros.demo.options import DemoOptions
from advise_ros.demo.tracks import TrackLog
from advise_ros.demo.trials import trial_settings
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.report.pictures import FlownTrack
from advise_ros.ros import convert, convert_advice
from advise_ros.ros.graph_client import GraphClient
from advise_ros.supervisor import Child, Supervisor

# By the supervisor's clock, which stands still while the machine is too busy for the processes.
STEP_PATIENCE_S = 120.0
FLIGHT_PATIENCE_S = 300.0
SETTLE_PATIENCE_S = 30.0
HUMAN_PATIENCE_S = 86_400.0
ADDRESS = re.compile(r'http://\S+token=\S+')


@dataclass(frozen=True)
class DemoFlight:
    """One flight of a learnt policy in the simulator."""

    seed: int
    policy: str
    success: bool
    steps: int
    seconds: float
    message: str


@dataclass
class DemoSession:
    """What one learning session left: the values that the report is made of."""

    seed: int
    demonstrations: tuple[Demonstration, ...] = ()
    queries: dict[int, AdviceQuery] = field(default_factory=dict)
    policies: dict[int, Policy] = field(default_factory=dict)
    log: tuple[AdviceRecord, ...] = ()
    flights: list[DemoFlight] = field(default_factory=list)


class Story:
    """Runs the sessions one after another in one running graph."""

    def __init__(self, options: DemoOptions, grid: Grid, supervisor: Supervisor, console: DemoConsole) -> None:
        self._options = options
        self.grid = grid
        self._supervisor = supervisor
        self._console = console
        self._graph = DemoGraph(options, grid, supervisor)
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
        """The main session: its demonstrations are flown, and everything is recorded into the bag."""
        session = DemoSession(self._options.seed)
        logger, recorder = self._graph.start_recording(bag)
        learning = self._graph.start_learning(session.seed, None)
        if self._options.expert == 'human':
            self._open_page()
        self._fly_demonstrations(session)
        self._before_and_after(session)
        if self._supervisor.stop(logger):
            raise AdviseError(f'the logger did not finish its bag {bag} and was killed; its log: {logger.log_path}')
        self._supervisor.stop(recorder, *learning)
        return session

    def model_session(self, seed: int, directory: Path) -> DemoSession:
        """A further seed: demonstrations come from the grid model, the policies fly in the simulator."""
        self.client.forget_session()
        session = DemoSession(seed, fly(self.grid, trial_settings(self._options), np.random.default_rng(seed)))
        path = directory / f'demonstrations-{seed}.json'
        save_demonstrations(path, session.demonstrations)
        learning = self._graph.start_learning(seed, path)
        self._before_and_after(session)
        self._supervisor.stop(*learning)
        return session

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
            self.tracks.append(FlownTrack('demonstration', demonstration.demonstration_id, positions, reached))
        moves = sum(len(demonstration.states) for demonstration in session.demonstrations)
        self._console.say(f'{wanted} rough demonstrations flown and recorded, {moves} moves')

    def _positions_are_heard(self) -> bool:
        return self.client.is_heard('pose', *LISTENERS)

    def _before_and_after(self, session: DemoSession) -> None:
        self._wait_for_policy(session)
        self._fly_policy(session, 'before')
        expert = self._start_expert(session)
        patience = HUMAN_PATIENCE_S if expert is None else FLIGHT_PATIENCE_S
        self.client.wait('the last answer', lambda: self._phase() == LearnerStatus.DONE, patience)
        self.client.wait('the log of the answers', lambda: len(self._log()) >= self._answers(), SETTLE_PATIENCE_S)
        session.queries, session.policies = dict(self.client.queries), dict(self.client.policies)
        session.log = self._log()
        self._console.say(f'seed {session.seed}: {self._answers()} questions asked and answered')
        self._fly_policy(session, 'after')
        if expert is not None:
            self._supervisor.stop(expert)

    # -- learning ----------------------------------------------------------------------------
    def _phase(self) -> int | None:
        return self.client.learner.phase if self.client.learner is not None else None

    def _log(self) -> tuple[AdviceRecord, ...]:
        return tuple(map(convert_advice.advice_from_msg, self.client.advice))

    def _answers(self) -> int:
        return self.client.learner.answers if self.client.learner is not None else 0

    def _wait_for_policy(self, session: DemoSession) -> None:
        def learnt() -> bool:
            status = self.client.learner
            if status is not None and status.phase == LearnerStatus.FAILED:
                raise AdviseError(f'the learner failed: {status.message}')
            return (
                status is not None
                and status.phase in (LearnerStatus.ASKING, LearnerStatus.DONE)
                and status.demonstrations == len(session.demonstrations)
                and status.policy_version in self.client.policies
            )

        self.client.wait('a policy learnt from all demonstrations', learnt, STEP_PATIENCE_S)

    def _start_expert(self, session: DemoSession) -> Child | None:
        """The simulated expert, or None: a person answers, on the page or by service call."""
        if self._options.expert == 'simulated':
            return self._graph.start_expert(session.seed)
        self._console.say(f'[bold]Your turn:[/bold] the drone asks, you answer on the page ({self._address})')
        self._console.say('or in another terminal, by ./advise ask.')
        _HumanPrompt(self.client, self._console).install()
        return None

    def _open_page(self) -> None:
        """Start the page and tell where it is: its address stands in its log."""
        console = self._graph.start_console()
        found = self.client.wait('the page', lambda: ADDRESS.search(console.log_path.read_text()), STEP_PATIENCE_S)
        self._address = found[0]
        self._console.say(f'[bold]Watch and answer in a browser:[/bold] {self._address}')
        browser.show(self._address)

    # -- flying ------------------------------------------------------------------------------
    def _fly_policy(self, session: DemoSession, policy: str) -> None:
        self.client.take_off(STEP_PATIENCE_S)
        result = self.client.fly(self.grid.waypoints[-1], FLIGHT_PATIENCE_S)
        positions = self._track_log.between(self.client.flying_since_ns, self._track_log.last_stamp_ns())
        self.tracks.append(FlownTrack(policy, f'seed {session.seed}', positions, result.success))
        session.flights.append(_flight(session.seed, policy, result))
        mark = '[green]reached the end[/green]' if result.success else '[red]did not reach the end[/red]'
        self._console.say(f'seed {session.seed}, {policy} advice: {mark} ({result.message})')
        self.client.land(STEP_PATIENCE_S)


def _flight(seed: int, policy: str, result: Fly.Result) -> DemoFlight:
    return DemoFlight(seed, policy, bool(result.success), int(result.steps), float(result.seconds), str(result.message))


class _HumanPrompt:
    """Prints each new question with the exact call that answers it."""

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
        for line in answer_calls(query.query_id, self._client.node.resolve_service_name('advise/answer')):
            self._console.rich.print(f'           {line}', markup=False)


def answer_calls(query_id: int, service: str) -> tuple[str, str]:
    """The two ways to answer a query by hand, as lines to type."""
    request = f'{{query_id: {query_id}, verdict: 0, preferred: [1], avoided: [0, 2, 3], expert_id: me}}'
    return (
        f'./advise answer --query {query_id} --prefer east --avoid north,south,west',
        f'ros2 service call {service} advise_msgs/srv/AnswerQuery "{request}"',
    )

