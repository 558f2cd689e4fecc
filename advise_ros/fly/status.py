"""What `fly` says while it runs: one line of where everything stands."""

from __future__ import annotations

from advise_msgs.msg import FlightStatus, LearnerStatus
from advise_ros.ros.graph_client import GraphClient

FLIGHTS = {
    FlightStatus.TO_START: 'flies to the start', FlightStatus.FLYING: 'flies the policy',
    FlightStatus.SUCCEEDED: 'has flown the route', FlightStatus.BLOCKED: 'stopped', FlightStatus.STOPPED: 'holds',
    FlightStatus.LOST: 'lost its position', FlightStatus.BUDGET_SPENT: 'stopped',
}


def line(client: GraphClient, expected: tuple[str, ...], url: str) -> str:
    """The state of the session in one line, what is waited for first.

    Args:
        client: of the graph.
        expected: names of the nodes that should run.
        url: of the vehicle.
    """
    missing = [name for name in expected if name not in client.health]
    if missing:
        return f'waiting for {", ".join(missing)} to start'
    return ' | '.join(part for part in (_vehicle(client, url), _learner(client), _flight(client)) if part)


def _vehicle(client: GraphClient, url: str) -> str:
    vehicle = client.vehicle
    if vehicle is None or not vehicle.connected:
        return f'waiting for a vehicle on {url}'
    name = vehicle.autopilot or 'vehicle'
    if vehicle.owner == 'others' and vehicle.in_air:
        return f'{name} is flown by others ({vehicle.mode})'
    if vehicle.commandable:
        return f'{name} in the air'
    if vehicle.in_air:
        return f'{name} in the air, waiting for {vehicle.waiting_for or "a mode that takes commands"} (mode {vehicle.mode})'
    return f'{name} ready: take off' if vehicle.ready else f'{name}: waiting for {vehicle.waiting_for or "it to be ready"}'


def _learner(client: GraphClient) -> str:
    learner = client.learner
    if learner is None:
        return ''
    flights = '1 demonstration' if learner.demonstrations == 1 else f'{learner.demonstrations} demonstrations'
    if learner.phase == LearnerStatus.WAITING_FOR_DEMONSTRATIONS:
        return f'{flights}: fly the route once'
    if learner.phase == LearnerStatus.LEARNING:
        return f'{flights}, learning'
    if learner.phase == LearnerStatus.FAILED:
        return f'learner failed: {learner.message}'
    answers = '1 answer' if learner.answers == 1 else f'{learner.answers} answers'
    asks = f'question {learner.query_id} is open' if learner.phase == LearnerStatus.ASKING else 'no question is left: let it fly'
    return f'{flights}, {answers}, {asks}'


def _flight(client: GraphClient) -> str:
    flight = client.flight
    if flight is None or flight.phase not in FLIGHTS:
        return ''
    return f'{FLIGHTS[flight.phase]}{f" ({flight.message})" if flight.message else ""}'
