"""A policy and the first question from demonstrations: ./advise python examples/learn_from_file.py demos.json

The file is made by ./advise discretise bags/arducopter_five_flights --grid config/grid_6x6.yaml --out demos.json
"""

import sys

from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import learn
from advise_ros.recording.demofile import load_demonstrations
from advise_ros.recording.gridfile import load_grid

grid = load_grid('config/grid_6x6.yaml')
learned = learn(grid, LearnSettings(), load_demonstrations(sys.argv[1], grid), log=())

for waypoint in range(len(grid.waypoints)):
    print(f'on the way to waypoint {waypoint + 1}:')
    for y in reversed(range(grid.height)):
        states = [grid.state(waypoint, grid.cell(x, y)) for x in range(grid.width)]
        print('  ', *('^>v<'[learned.greedy[state]] for state in states))
print(learned.query.question if learned.query else 'nothing to ask')
