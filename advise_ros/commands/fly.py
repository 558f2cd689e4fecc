"""The whole graph around one vehicle from one command, and the end of all of it by one Ctrl-C."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.status import Status

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.demo import browser
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.graph import refuse_a_second_graph
from advise_ros.exits import INTERRUPTED, OK, USAGE, VERDICT_NO, fail
from advise_ros.fly import status
from advise_ros.fly.graph import WHY, FlightGraph
from advise_ros.fly.options import FlyOptions, parse
from advise_ros.ros.arguments import check_environment
from advise_ros.ros.graph_client import GraphClient
from advise_ros.ros.run import exit_now
from advise_ros.supervisor import ChildDiedError, Supervisor

ADDRESS = re.compile(r'http://\S+token=\S+')
# Another graph in this domain shows itself within this time.
DISCOVERY_S = 0.5
PAGE_PATIENCE_S = 120.0
LOOK_S = 0.1


class _StatusLine:
    """One line that stays at the bottom of a terminal; elsewhere each new text is a line of its own."""

    def __init__(self, console: DemoConsole) -> None:
        self._console, self._text = console, ''
        self._line = Status('', console=console.rich) if console.rich.is_terminal else None

    def show(self, text: str) -> None:
        if text == self._text:
            return
        self._text = text
        if self._line is None:
            self._console.say(text)
        else:
            self._line.update(text)
            self._line.start()

    def close(self) -> None:
        if self._line is not None:
            self._line.stop()


@contextmanager
def _client(options: FlyOptions, supervisor: Supervisor) -> Iterator[GraphClient]:
    client = GraphClient('fly', supervisor.check, supervisor.clock, options.namespace)
    try:
        yield client
    finally:
        client.close()


def run(options: FlyOptions, console: DemoConsole) -> int:
    """Run a session until Ctrl-C; returns the exit code.

    Raises:
        InputError: nodes of ours run in this ROS domain already; nothing was started.
    """
    with Supervisor(options.logs) as supervisor, _client(options, supervisor) as client:
        graph = FlightGraph(options, supervisor)
        code = OK
        time.sleep(DISCOVERY_S)
        refuse_a_second_graph(client.node, options.namespace, simulated_time=options.simulated_time)
        options.bag.parent.mkdir(parents=True, exist_ok=True)
        try:
            _fly(options, graph, supervisor, client, console)
        except KeyboardInterrupt:
            console.say('Ctrl-C: everything ends in order')
        except ChildDiedError as problem:
            code = fail(f'{problem}\n{remedy(problem.name)}', VERDICT_NO)
        except AdviseError as problem:
            code = fail(str(problem), USAGE if isinstance(problem, InputError) else VERDICT_NO)
        flies = client.vehicle is not None and client.vehicle.in_air
        killed = graph.end()
        if flies and not options.simulated:
            console.say('[bold]the vehicle is in the air[/bold] and stands or holds: land it by your transmitter')
        return _close(options, graph, killed, console) or code


def _fly(options: FlyOptions, graph: FlightGraph, supervisor: Supervisor, client: GraphClient, console: DemoConsole) -> None:
    """Start everything and show its state for ever; ends by an exception only."""
    page = graph.start()
    console.say(f'starting {", ".join(graph.names)}; their logs are in {options.logs}')
    if not options.simulated:
        console.say(f'waiting for a vehicle on {options.url}: start it, or let its ground station forward MAVLink there')
    address = client.wait('the page', lambda: ADDRESS.search(page.log_path.read_text()), PAGE_PATIENCE_S)[0]
    shown = options.browser and browser.show(address)
    console.say(f'the page {"opens in your browser" if shown else "is served, open it in a browser"}: {address}')
    console.say('take off and fly the route there; answer what the drone asks, then let it fly. Ctrl-C here ends everything')
    line = _StatusLine(console)
    try:
        while True:
            supervisor.check()
            check_vehicle(options, client)
            line.show(status.line(client, graph.running, options.url))
            time.sleep(LOOK_S)
    finally:
        line.close()


def check_vehicle(options: FlyOptions, client: GraphClient) -> None:
    """Whether what sends heartbeats is what was asked for.

    Raises:
        InputError: another autopilot.
    """
    found = '' if client.vehicle is None else client.vehicle.autopilot
    if options.vehicle and found and found != options.vehicle:
        raise InputError(f'--vehicle is {options.vehicle}, and {found} sends on {options.url}; name --vehicle {found}, or none')


def remedy(name: str) -> str:
    """What the death of a process means, and what to do."""
    return f'{WHY[name]}; everything was ended in order. Mend what its last lines say, and start ./advise fly again'


def _close(options: FlyOptions, graph: FlightGraph, killed: tuple[str, ...], console: DemoConsole) -> int:
    """Say where the recording is; returns the exit code."""
    for name in killed:
        console.say(f'{name} did not end by itself and was killed; its log: {options.logs / name}.log')
    if not options.bag.exists():
        console.say('nothing was recorded')
        return VERDICT_NO
    whole = graph.bag_is_whole
    console.say(f'bag:    {options.bag}{"" if whole else ", which is not whole"}')
    console.say(f'replay: ./advise replay {options.bag}' if whole else f'mend:   ./advise recover {options.bag}')
    return OK if whole and not killed else VERDICT_NO


def main() -> None:
    """Entry point of `fly`."""
    try:
        check_environment()
        code = run(parse(), DemoConsole())
    except InputError as problem:
        code = fail(str(problem))
    except AdviseError as problem:
        code = fail(str(problem), VERDICT_NO)
    except KeyboardInterrupt:
        code = fail('stopped before anything was started', INTERRUPTED)
    exit_now(code)
