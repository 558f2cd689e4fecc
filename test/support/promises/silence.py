"""Poses stop: zero velocity within 550 ms of the last one, from the policy and from the guard."""

from __future__ import annotations

import math
import signal
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from geometry_msgs.msg import PoseStamped, TwistStamped

from advise_msgs.action import Fly
from advise_msgs.msg import Policy
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import qos
from support.graph import Graph
from support.policies import best, policy_message
from support.processes import Process
from support.promises.book import Book, Measure
from support.promises.pose_source import READY, SPEAK
from support.promises.rig import private_graph, square

LIMIT_S = 0.55
PATIENCE_S = 20.0
HOW = {'killed': signal.SIGKILL, 'stopped': signal.SIGSTOP}
SOURCE = Path(__file__).with_name('pose_source.py')


class Witness:
    """Hears poses and commands with their steady times."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.pose_s = -math.inf
        self.commands: dict[str, list[tuple[float, float]]] = {'cmd_vel': [], 'guard/cmd_vel': []}
        graph.node.create_subscription(PoseStamped, 'pose', self._on_pose, qos.SENSOR)
        for topic, heard in self.commands.items():
            graph.node.create_subscription(TwistStamped, topic, lambda m, heard=heard: self._on_command(m, heard), qos.COMMAND)

    def _on_pose(self, _: Any) -> None:
        self.pose_s = time.monotonic()

    def _on_command(self, message: TwistStamped, heard: list[tuple[float, float]]) -> None:
        linear = message.twist.linear
        heard.append((time.monotonic(), math.hypot(linear.x, linear.y, linear.z)))
        self.graph.notify()

    def moving(self) -> bool:
        """Both command motion, and the vehicle's poses come."""
        now_s = time.monotonic()
        newest = [heard[-1] if heard else (-math.inf, 0.0) for heard in self.commands.values()]
        return now_s - self.pose_s < 0.1 and all(now_s - at_s < 0.3 and speed > 0.3 for at_s, speed in newest)

    def zero_after_pose(self, topic: str) -> float:
        """Seconds from the last pose until zero velocity; ask when no pose can come any more."""
        def found() -> float:
            return next((at_s for at_s, speed in list(self.commands[topic]) if at_s > self.pose_s and speed == 0.0), 0.0)

        return float(self.graph.wait_until(found, PATIENCE_S, f'zero velocity on {topic}')) - self.pose_s


class Sources:
    """Sources of poses, the next one always started already: it costs a second, and speaks when it is told to."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._next = self._start()

    def _start(self) -> Process:
        return self._graph.start_command('pose_source', [sys.executable, str(SOURCE)])

    def take(self) -> Process:
        """One that has just begun to speak."""
        source, self._next = self._next, self._start()
        self._graph.wait_until(lambda: READY in source.out, PATIENCE_S, 'a source of poses')
        source.popen.send_signal(SPEAK)
        return source

    def end(self, source: Process) -> None:
        source.kill()
        self._graph.processes.remove(source)

    def close(self) -> None:
        self.end(self._next)


def run(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Kill and stop the source of poses each round."""
    grid, grid_file = square(), folder / 'grid.yaml'
    grid_file.write_text(yaml.safe_dump({'grid': grid_to_mapping(grid)}))
    with private_graph() as graph:
        witness = Witness(graph)
        for name in ('policy', 'guard'):
            graph.start(name, {'grid_file': str(grid_file)})
        graph.publisher('advise/policy', Policy, qos.latched()).publish(policy_message(grid, best(grid)))
        sources = Sources(graph)
        for _ in book.rounds():
            for how in HOW:
                for topic, seconds in _silence(witness, sources, how, rng).items():
                    figure = f'seconds from the last pose, {topic}'
                    book.add(Measure('zero velocity', f'source of poses {how}', figure, seconds, LIMIT_S))
        sources.close()


def _silence(witness: Witness, sources: Sources, how: str, rng: np.random.Generator) -> dict[str, float]:
    graph, source = witness.graph, sources.take()
    pilot = graph.accepted_goal(Fly, 'policy/fly', Fly.Goal(start_cell=0), PATIENCE_S)
    graph.wait_until(witness.moving, PATIENCE_S, 'motion')
    time.sleep(float(rng.uniform(0.0, 0.3)))
    source.signal(HOW[how])
    found = {topic: witness.zero_after_pose(topic) for topic in witness.commands}
    graph.cancel(pilot)
    sources.end(source)
    witness.pose_s = -math.inf
    for heard in witness.commands.values():
        heard.clear()
    return found
