"""What an autopilot's estimator and GPS say of themselves while it stands on the ground.

EKF_STATUS_REPORT of ArduPilot, ESTIMATOR_STATUS of PX4, GPS_RAW_INT of both: https://mavlink.io/en/messages/ardupilotmega.html
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.findings import Finding, Level, advice, right, wrong
from advise_ros.mavlink.messages import Message, dialect

ESTIMATOR_STATUS = int(dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS)
GPS_RAW_INT = int(dialect.MAVLINK_MSG_ID_GPS_RAW_INT)
ESTIMATOR = {'ardupilot': mav.EKF_STATUS_REPORT, 'px4': ESTIMATOR_STATUS}
# The worst of what came within this time counts.
WINDOW_S = 2.0

# Bits that both have, as far as a flight by position needs them.
NEEDED = {1: 'attitude', 2: 'horizontal velocity', 4: 'vertical velocity', 16: 'horizontal position', 32: 'height'}
POSITION = 16
# PX4 sets 0x80 (constant position) whenever it stands still on the ground.
DOUBTS = {
    'ardupilot': {0x80: 'it holds a constant position', 0x400: 'it is not initialised', 0x8000: 'its GPS glitches'},
    'px4': {0x400: 'its GPS glitches', 0x800: 'its accelerometer is bad'},
}
# Innovation test ratios: what a sensor says against what is expected. ArduPilot's failsafe acts at 0.8 (FS_EKF_THRESH),
# PX4 refuses a sensor at 1.
HIGH = 0.5
TOO_HIGH = {'ardupilot': 0.8, 'px4': 1.0}
RATIOS = {
    'ardupilot': {'velocity_variance': 'velocity', 'pos_horiz_variance': 'position', 'pos_vert_variance': 'height',
                  'compass_variance': 'compass'},
    'px4': {'vel_ratio': 'velocity', 'pos_horiz_ratio': 'position', 'pos_vert_ratio': 'height', 'mag_ratio': 'compass'},
}
FIX_3D, FEW_SATELLITES, POOR_HDOP, UNKNOWN_EPH = 3, 6, 2.5, 0xFFFF


class EstimatorReport(NamedTuple):
    """One message of the estimator: flags, and ratio by sensor."""

    at_s: float
    flags: int
    ratios: dict[str, float]


class EstimatorWatch:
    """Keeps the latest messages of one autopilot's estimator and GPS, and judges them."""

    def __init__(self, autopilot: str) -> None:
        self._autopilot = autopilot
        self._reports: deque[EstimatorReport] = deque()
        self._gps: Message | None = None

    @property
    def wanted(self) -> list[int]:
        """Ids of the messages that do not come so far."""
        missing = [] if self._reports else [ESTIMATOR[self._autopilot]]
        return missing if self._gps is not None else [*missing, GPS_RAW_INT]

    def observe(self, message: Message, now_s: float) -> None:
        """Take in a message of the autopilot.

        Args:
            message: of the autopilot.
            now_s: steady time.
        """
        if message.get_msgId() == GPS_RAW_INT:
            self._gps = message
        elif message.get_msgId() == ESTIMATOR[self._autopilot]:
            fields = RATIOS[self._autopilot]
            ratios = {sensor: float(getattr(message, name)) for name, sensor in fields.items()}
            self._reports.append(EstimatorReport(now_s, int(message.flags), ratios))
        while self._reports and self._reports[0].at_s < now_s - WINDOW_S:
            self._reports.popleft()

    def findings(self) -> list[Finding]:
        """What the latest messages say."""
        return [*self._estimator(), *self._fix()]

    def _estimator(self) -> list[Finding]:
        if not self._reports:
            remedy = 'ask again; without it nobody sees a position going wrong before it jumps'
            return [Finding(Level.UNKNOWN, 'its estimator says nothing of itself', remedy)]
        everywhere, anywhere = -1, 0
        for report in self._reports:
            everywhere, anywhere = everywhere & report.flags, anywhere | report.flags
        lacking = [what for bit, what in NEEDED.items() if not everywhere & bit]
        doubts = [what for bit, what in DOUBTS[self._autopilot].items() if anywhere & bit]
        if not lacking and not doubts:
            return [right(f'its estimator has attitude, velocity and position (flags {everywhere:#x})'), *self._worst_ratio()]
        said = [f'it lacks {", ".join(lacking)}'] if lacking else []
        remedy = 'wait for it (--wait), under an open sky and away from metal; then check again'
        return [wrong(f'its estimator: {"; ".join(said + doubts)} (flags {everywhere:#x})', remedy), *self._worst_ratio()]

    def _worst_ratio(self) -> list[Finding]:
        known = [(ratio, sensor) for report in self._reports for sensor, ratio in report.ratios.items() if math.isfinite(ratio)]
        if not known:
            return []
        ratio, sensor = max(known)
        limit = TOO_HIGH[self._autopilot]
        said = f'its estimator and its sensors: worst ratio {ratio:.2f} ({sensor}; {limit:g} is too much)'
        remedy = f'find out what disturbs its {sensor}: reboot on level ground, calibrate, move away from metal'
        if ratio < HIGH:
            return [right(said)]
        return [(wrong if ratio >= limit else advice)(said, remedy)]

    def _fix(self) -> list[Finding]:
        if self._gps is None:
            return []
        fix, satellites = int(self._gps.fix_type), int(self._gps.satellites_visible)
        if fix < FIX_3D:
            return [self._no_fix(fix)]
        hdop = math.nan if self._gps.eph == UNKNOWN_EPH else self._gps.eph / 100.0
        said = f'GPS: 3D fix, {satellites} satellites' + ('' if math.isnan(hdop) else f', HDOP {hdop:.1f}')
        if satellites < FEW_SATELLITES or hdop > POOR_HDOP:
            return [advice(said, f'wait for {FEW_SATELLITES} satellites and an HDOP below {POOR_HDOP:g}: positions may jump')]
        return [right(said)]

    def _no_fix(self, fix: int) -> Finding:
        said = f'GPS: no 3D fix (fix type {fix})'
        if self._reports and self._reports[-1].flags & POSITION:
            return advice(f'{said}; its position comes from something else', 'see that it is meant to')
        return wrong(said, 'wait for it under an open sky, or give it another source of positions')
