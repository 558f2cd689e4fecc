"""Positions of a flight become a demonstration: moves between the cells of a grid."""

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorder import Recorder
from advise_ros.core.grid.grid import Action
from advise_ros.recording.gridfile import load_grid

grid = load_grid('config/grid_6x6.yaml')
recorder = Recorder(grid, DiscretiseSettings(), source='my estimator', by_flights=False)

recorder.start()
for tick in range(1, 101):  # Ten seconds at 10 Hz: east along the lowest row at 1 m/s.
    recorder.pose(stamp_ns=tick * 100_000_000, position_enu_m=(tick * 0.1, 0.0, grid.altitude_m))
print(recorder.stop().message)

for output in recorder.take(steady_s=0.0) + recorder.take(steady_s=1.0):  # Late positions have their time.
    if output.demonstration is not None:
        for state, action in zip(output.demonstration.states, output.demonstration.actions, strict=True):
            print('in cell', grid.xy(grid.cell_of(state)), 'go', Action(action).name)
