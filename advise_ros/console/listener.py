"""Hears the graph and keeps a board of it."""

from __future__ import annotations

import math
import time
from collections import deque

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import BatteryState

from advise_msgs import msg
from advise_ros.console import views, wording
from advise_ros.console.advice_history import AdviceHistory
from advise_ros.console.board import Board
from advise_ros.console.language import languages, words
from advise_ros.console.lessons import Lessons
from advise_ros.console.settings import LearnerSettings
from advise_ros.core.advice.advice import Query
from advise_ros.core.demonstrations.demonstration import Demonstration, count, known, standing
from advise_ros.core.errors import AdviseError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.sessionfile import LogEntry
from advise_ros.ros import convert, convert_advice, qos

TICK_S = 0.25
# A track is a point each time the drone has moved by this share of a cell, the latest so many: more would hide the map.
TRACK_STEP_CELLS = 0.1
TRACK_POINTS = 300
LEARNER = 'advise'
# A stamp below this is simulated time [s].
SIMULATED_S = 365 * 86400.0
# A text of the autopilot is shown for so long (steady time).
TEXT_S = 20.0
# Nodes that end when their work is done; nobody depends on them.
VISITORS = ('pilot', 'expert', 'teleop')
LEVELS = {DiagnosticStatus.OK: 'ok', DiagnosticStatus.WARN: 'warn', DiagnosticStatus.ERROR: 'error'}


class GraphListener:
    """Subscribes to what the page shows; everything happens in the thread of the node's executor.

    Attributes:
        board: the sections `map`, `flown`, `policy`, `gains`, `query`, `site`, `log`, `learner`, `vehicle`, `flight`,
            `battery`, `nodes`, `drone`, `track` and `lessons`, as far as something was heard.
        lessons: the demonstrations that stand, as a list for people.
        query: the open question, None while there is none.
        grid: of the session, None before the first message that has one.
    """

    def __init__(self, node: Node, silence_s: float, grid: Grid | None = None) -> None:
        """Joins the graph; a node that says nothing for `silence_s` (steady time) counts as gone."""
        self.board = Board()
        self.lessons = Lessons(self.board)
        self.query: Query | None = None
        self.grid: Grid | None = None
        self._past = AdviceHistory()
        self._settings = LearnerSettings(node, self._show_policy)
        self._silence_s = silence_s
        self._demonstrations: tuple[Demonstration, ...] = ()
        self._policy: msg.Policy | None = None
        self._health: dict[str, tuple[DiagnosticStatus, float]] = {}
        self._learner_heard_s: float | None = None
        self._heard_at: dict[tuple[int, bool], float] = {}
        self._vehicle: msg.VehicleStatus | None = None
        self._text_since_s = 0.0
        self._track: deque[tuple[float, float]] = deque(maxlen=TRACK_POINTS)
        if grid is not None:
            self._on_grid(grid)
        self._subscribe(node)
        node.create_timer(TICK_S, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _subscribe(self, node: Node) -> None:
        listen = node.create_subscription
        listen(msg.Demonstration, 'demonstration', self._on_demonstration, qos.DEMONSTRATIONS)
        listen(msg.Policy, 'advise/policy', self._on_policy, qos.latched())
        listen(msg.AdviceQuery, 'advise/query', self._on_query, qos.latched())
        listen(msg.Advice, 'advise/advice_log', self._on_advice, qos.ADVICE_LOG)
        listen(OccupancyGrid, 'advise/site_map', lambda m: self.board.put('site', views.site_view(m)), qos.latched())
        listen(msg.LearnerStatus, 'advise/status', self._on_learner, qos.latched())
        listen(msg.VehicleStatus, 'vehicle_status', self._on_vehicle, qos.latched())
        listen(msg.FlightStatus, 'policy/status', lambda m: self.board.put('flight', views.flight_view(m)), qos.latched())
        listen(BatteryState, 'battery_state', self._on_battery, qos.SENSOR)
        listen(PoseStamped, 'pose', self._on_pose, qos.SENSOR)
        listen(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)

    @property
    def policy(self) -> msg.Policy | None:
        """The newest one, None before there is one."""
        return self._policy

    # -- the learner -------------------------------------------------------------------------
    def learner_alive(self) -> bool:
        """Whether the learner said something of itself lately."""
        heard_s = self._learner_heard_s
        return heard_s is not None and time.monotonic() - heard_s <= self._silence_s

    def _hear_learner(self) -> None:
        self._learner_heard_s = time.monotonic()

    def _on_grid(self, grid: Grid) -> None:
        if grid != self.grid:
            self.grid = grid
            self.board.put('map', views.map_view(grid))

    def _on_demonstration(self, message: msg.Demonstration) -> None:
        try:
            demonstration = convert.demonstration_from_msg(message)
        except (AdviseError, ValueError):
            return  # The learner refuses it too, and says so on /diagnostics.
        if not known(demonstration, self._demonstrations):
            self._demonstrations += (demonstration,)
            self._on_grid(demonstration.grid)
            self._show_flown()

    def _held(self) -> tuple[Demonstration, ...]:
        return tuple(one for one in standing(self._demonstrations) if one.grid == self.grid)

    def _show_flown(self) -> None:
        if self.grid is not None:
            self.board.put('flown', views.flown_view(self.grid, self._held()))
            self.lessons.show(self._held())
        self._show_policy()
        self._show_query()

    def _on_policy(self, message: msg.Policy) -> None:
        self._hear_learner()
        before, self._policy = self._policy, message
        self._on_grid(convert.grid_from_msg(message.grid))
        if before is not None and message.version <= before.version and message.header.stamp != before.header.stamp:
            self._on_another_learner(message)
        self._past.begin(int(message.log_length))
        self._show_policy()
        self._note_gain(before, message)
        self.board.put('gains', self._past.view())

    def _on_another_learner(self, first: msg.Policy) -> None:
        """It has been started again: with the same session, or with none."""
        self._settings.forget()
        self.board.put('site', None)
        if first.log_length == 0:
            self._past.clear()
            self.board.put('log', [])

    def _show_policy(self) -> None:
        if self._policy is None or self.grid is None or len(self._policy.greedy) != self.grid.n_states:
            return
        taken = count(self.grid, self._held())
        self.board.put('policy', views.policy_view(
            self._policy, self.grid, taken, self._settings.value, own=self._settings.own,
        ))

    def _note_gain(self, before: msg.Policy | None, now: msg.Policy) -> None:
        """What the entries of the log since the policy before have bought."""
        shown = self.board.sections.get('policy')
        if before is None or shown is None or now.log_length <= before.log_length or len(before.greedy) != len(now.greedy):
            return
        changed = int((np.asarray(before.greedy) != np.asarray(now.greedy)).sum())
        self._past.learnt(int(now.log_length), changed, {name: shown.value[name] for name in ('reaches', 'success')})

    def _on_query(self, message: msg.AdviceQuery) -> None:
        self._hear_learner()
        self._on_grid(convert.grid_from_msg(message.grid))
        self.query = convert_advice.query_from_msg(message)
        self._show_query()
        if self.query is None:
            nothing = {'states': [], 'moments': [], 'disputed': [], 'options': []}
            self.board.put('query', {'id': 0, 'question': message.question, **nothing})

    def _show_query(self) -> None:
        if self.query is not None and self.grid is not None:
            held = self._held()
            taken = count(self.grid, held).taken
            moments, here = views.moments_of(self.query, self.grid, held), taken[list(self.query.states)].sum(axis=0)
            view = views.query_view(self.query, moments, here)
            view['said'] = {code: wording.asked(words(code), view, self.grid, taken) for code in languages()}
            self.board.put('query', view)

    def _on_advice(self, message: msg.Advice) -> None:
        record, stamp_ns = convert_advice.advice_from_msg(message), convert.stamp_to_ns(message.header.stamp)
        if self._past.add(record, stamp_ns):
            self._heard_at[record.advice_id, record.retracted] = time.time()
            self.board.put('log', [self._on_the_wall(entry) for entry in views.log_view(self.entries)])

    def _on_the_wall(self, entry: views.View) -> views.View:
        """An answer with the wall's time: of its stamp, or where that is simulated, of when it was heard."""
        simulated = entry['at'] < SIMULATED_S
        return {**entry, 'at': self._heard_at[entry['id'], False] if simulated else entry['at'], 'simulated': simulated}

    @property
    def entries(self) -> list[LogEntry]:
        """The advice log of the session."""
        return self._past.entries

    def _on_learner(self, message: msg.LearnerStatus) -> None:
        self._hear_learner()
        self.board.put('learner', views.learner_view(message))

    # -- the vehicle -------------------------------------------------------------------------
    def _on_battery(self, message: BatteryState) -> None:
        if math.isfinite(message.percentage) and message.percentage >= 0:
            self.board.put('battery', round(100 * message.percentage))

    def _on_vehicle(self, message: msg.VehicleStatus) -> None:
        if self._vehicle is None or message.text != self._vehicle.text:
            self._text_since_s = time.monotonic()
        self._vehicle = message
        self._show_vehicle()

    def _show_vehicle(self) -> None:
        """The vehicle; what its autopilot wrote goes after a while, as nobody takes it back."""
        if self._vehicle is not None:
            view = views.vehicle_view(self._vehicle)
            old = time.monotonic() - self._text_since_s > TEXT_S
            self.board.put('vehicle', view | ({'text': ''} if old else {}))

    def _on_pose(self, message: PoseStamped) -> None:
        at, turn = message.pose.position, message.pose.orientation
        if not all(map(math.isfinite, (at.x, at.y, at.z))):
            return
        yaw = math.atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2))
        self.board.put('drone', [round(at.x, 2), round(at.y, 2), round(at.z, 2), round(yaw, 2)])
        step = TRACK_STEP_CELLS * (self.grid.resolution_m if self.grid is not None else 1.0)
        if not self._track or math.dist(self._track[-1], (at.x, at.y)) >= step:
            self._track.append((round(at.x, 2), round(at.y, 2)))

    def track(self) -> list[tuple[float, float]]:
        """Where the drone was, oldest first; a page that opens starts with it and goes on from `drone`."""
        return list(self._track)

    # -- the nodes ---------------------------------------------------------------------------
    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        now = time.monotonic()
        said = {status.name.rsplit('/', 1)[-1]: (status, now) for status in message.status}
        self._health.update(said)
        if LEARNER in said:
            self._hear_learner()

    def _on_tick(self) -> None:
        """Tell the state of all nodes, those that have fallen silent included."""
        self._settings.poll()
        self._show_vehicle()
        now = time.monotonic()
        nodes = [
            {'name': name, 'level': self._level(name, status, now - heard), 'message': status.message}
            for name, (status, heard) in sorted(self._health.items())
        ]
        self.board.put('nodes', nodes)
        self.board.put('graph', {'learner': self.learner_alive(), 'heard': self._learner_heard_s is not None})

    def _level(self, name: str, status: DiagnosticStatus, silent_s: float) -> str:
        if silent_s <= self._silence_s:
            return LEVELS.get(status.level, 'error')
        return 'gone' if name in VISITORS else 'silent'
