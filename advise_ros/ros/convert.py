"""Values of core <-> messages. Every converter is here, and only converts."""

from __future__ import annotations

from builtin_interfaces.msg import Time

from advise_msgs import msg
from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.flight.vehicle_state import VehicleState
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import MAP_FRAME, NS


def stamp_to_ns(stamp: Time) -> int:
    return int(stamp.sec) * NS + int(stamp.nanosec)


def stamp_from_ns(stamp_ns: int) -> Time:
    return Time(sec=stamp_ns // NS, nanosec=stamp_ns % NS)


def grid_to_msg(grid: Grid, stamp_ns: int = 0) -> msg.GridMap:
    """The grid as a message.

    Args:
        grid: cells and waypoints.
        stamp_ns: of its header; the map itself is not dated.
    """
    out = msg.GridMap()
    out.header.frame_id = MAP_FRAME
    out.header.stamp = stamp_from_ns(stamp_ns)
    out.info.resolution = grid.resolution_m
    out.info.width = grid.width
    out.info.height = grid.height
    out.info.origin.position.x, out.info.origin.position.y = grid.origin_enu_m
    out.info.origin.orientation.w = 1.0
    out.altitude_m = grid.altitude_m
    out.waypoints = list(grid.waypoints)
    out.blocked = list(grid.blocked)
    return out


def grid_from_msg(grid: msg.GridMap) -> Grid:
    """The grid of a message.

    `info.resolution` is a float32: it is rounded to 7 significant digits, so that 0.1 stays 0.1.

    Raises:
        InputError: as Grid.
    """
    return Grid(
        resolution_m=float(f'{grid.info.resolution:.7g}'),
        width=int(grid.info.width),
        height=int(grid.info.height),
        origin_enu_m=(float(grid.info.origin.position.x), float(grid.info.origin.position.y)),
        altitude_m=float(grid.altitude_m),
        waypoints=tuple(int(cell) for cell in grid.waypoints),
        blocked=tuple(int(cell) for cell in grid.blocked),
    )


def demonstration_to_msg(demonstration: Demonstration) -> msg.Demonstration:
    """The message, stamped with the end of the demonstration's window."""
    out = msg.Demonstration()
    out.header.frame_id = MAP_FRAME
    out.header.stamp = stamp_from_ns(demonstration.window_ns[1])
    out.demonstration_id = demonstration.demonstration_id
    out.source = demonstration.source
    out.grid = grid_to_msg(demonstration.grid)
    out.states = list(demonstration.states)
    out.actions = list(demonstration.actions)
    out.stamps = [stamp_from_ns(stamp) for stamp in demonstration.stamps_ns]
    out.window_start, out.window_end = (stamp_from_ns(stamp) for stamp in demonstration.window_ns)
    out.end_reason = int(demonstration.end_reason)
    out.audit = _audit_to_msg(demonstration.audit)
    return out


def _audit_to_msg(audit: Audit) -> msg.DiscretisationAudit:
    out = msg.DiscretisationAudit()
    for name in ('samples', 'late', 'unstamped', 'out_of_grid', 'cell_skips', 'ambiguous_actions'):
        setattr(out, name, getattr(audit, name))
    out.max_gap_s = audit.max_gap_s
    out.notes = list(audit.notes)
    return out


def demonstration_from_msg(demonstration: msg.Demonstration) -> Demonstration:
    """The demonstration of a message.

    Raises:
        InputError: the grid or the indices are not consistent.
    """
    audit = demonstration.audit
    return Demonstration(
        demonstration_id=demonstration.demonstration_id,
        source=demonstration.source,
        grid=grid_from_msg(demonstration.grid),
        states=tuple(int(s) for s in demonstration.states),
        actions=tuple(int(a) for a in demonstration.actions),
        stamps_ns=tuple(stamp_to_ns(stamp) for stamp in demonstration.stamps),
        window_ns=(stamp_to_ns(demonstration.window_start), stamp_to_ns(demonstration.window_end)),
        end_reason=EndReason(demonstration.end_reason),
        audit=Audit(
            samples=audit.samples, late=audit.late, unstamped=audit.unstamped, out_of_grid=audit.out_of_grid,
            cell_skips=audit.cell_skips, ambiguous_actions=audit.ambiguous_actions,
            max_gap_s=float(audit.max_gap_s), notes=tuple(audit.notes),
        ),
    )


def vehicle_from_msg(message: msg.VehicleStatus) -> VehicleState:
    """The vehicle's state for those that fly it."""
    return VehicleState(**{name: getattr(message, name) for name in VehicleState._fields if hasattr(message, name)})
