"""Demonstrations of a bag, an .mcap file or a .tlog: ./advise python examples/read_bag.py BAG GRID"""

import sys

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import read_recording

bag, grid_file = sys.argv[1:] or ('bags/arducopter_five_flights', 'config/grid_6x6.yaml')
recording = read_recording(bag)
print(len(recording.poses.stamps_ns), 'positions,', len(recording.commands.stamps_ns), 'commands')

found = demonstrations_of(load_grid(grid_file), recording, DiscretiseSettings())
for demonstration in found.demonstrations:
    audit = demonstration.audit
    print(f'{demonstration.demonstration_id}: {len(demonstration.states)} moves, ended by {demonstration.end_reason.name};',
          f'{audit.samples} positions, {audit.out_of_grid} outside of the grid, longest gap {audit.max_gap_s:.2f} s')
for note in found.notes:
    print(note)
