"""How a flight of the policy begins and when it is given up."""

from __future__ import annotations

from dataclasses import dataclass

from advise_ros.core.parameter import parameter


@dataclass(frozen=True)
class FlightSettings:
    """Parameters of /policy beside those of the velocity law."""

    step_budget_factor: float = parameter(
        2.0, 'steps before the battery is spent, times the shortest route', low=1.0, high=100.0,
    )
    stop_on_loop: bool = parameter(True, 'end a flight as soon as a state comes back, not when its budget is spent')
    centre_first: bool = parameter(True, 'fly slowly to the centre of the cell before the route begins')
    # A PX4 drifts by metres on the ground, in the climb and while it lands.
    start_reach_m: float = parameter(3.0, 'how far off the grid a flight may begin', low=0.0, high=100.0)
