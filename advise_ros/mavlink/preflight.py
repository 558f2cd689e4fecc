"""What is right with an autopilot before a flight, what is not, and how to set it."""

from __future__ import annotations

from types import ModuleType

from advise_ros.mavlink import preflight_ardupilot, preflight_px4
from advise_ros.mavlink.companion import Status
from advise_ros.mavlink.findings import Change, Finding, Level, Room, Values, right, wrong

RULES: dict[str, ModuleType] = {'ardupilot': preflight_ardupilot, 'px4': preflight_px4}


def optional_names(autopilot: str) -> frozenset[str]:
    """Parameters that not every version has."""
    return frozenset(name for row in RULES[autopilot].ALTERNATIVES for name in row)


def names(autopilot: str) -> tuple[str, ...]:
    """Parameters to ask for."""
    return (*RULES[autopilot].REQUIRED, *sorted(optional_names(autopilot)))


def parameter_findings(autopilot: str, values: Values, room: Room | None) -> list[Finding]:
    """A finding for each parameter that came, and for each that had to come and did not."""
    found: list[Finding] = RULES[autopilot].judge(values, room)
    missing = [name for name in RULES[autopilot].REQUIRED if name not in values]
    remedy = 'try again; if it stays away, look for its name in the documentation of this version of the autopilot'
    return found + [Finding(Level.UNKNOWN, f'{name}: no value came', remedy) for name in missing]


def changes(findings: list[Finding]) -> list[Change]:
    """What `--apply` writes, in this order: the fence is put on when the rest of it is right."""
    return [finding.change for finding in findings if finding.change is not None]


def state_findings(status: Status, texts: list[str]) -> list[Finding]:
    """What the vehicle says of itself."""
    found = [right(f'{status.autopilot} multicopter answers, mode {status.mode}')]
    if status.armed:
        found.append(wrong('it is armed', 'disarm it before a check'))
    elif status.ready:
        found.append(right('it is ready to arm'))
    else:
        lacking = f'it is not ready to arm; it waits for: {status.waiting_for}'
        found.append(wrong(lacking, 'wait longer (--wait), or put right what it says below'))
    return found + [Finding(Level.ADVICE, f'it says: {text}') for text in texts]
