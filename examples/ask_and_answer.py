"""The loop of questions and answers without ROS; a simulated person flies and answers."""

import numpy as np

from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.planning.rollout import rollout
from advise_ros.recording.gridfile import load_grid

grid, rng = load_grid('config/grid_6x6.yaml'), np.random.default_rng(1)
pilot, expert = SimulatedPilot(grid, noise_rate=0.4, mistake_share=0.2, rng=rng), SimulatedExpert(grid, rng)
session = Session(grid, LearnSettings(acquisition='occupancy'))  # Asks about clusters; 'site' would ask what no map says.
for number in range(3):
    session.add(demonstrate(grid, pilot, number, max_moves=400))

while (work := session.snapshot()) is not None:
    session.adopt(work.run())  # run() takes long on large grids: call it in a thread or process of your own.
    flown = rollout(grid, session.learned.greedy, grid.start_state(), step_budget=100)
    print('the policy reaches', flown.waypoints_reached, 'of', len(grid.waypoints), 'waypoints')
    if session.query is not None:
        print(session.query.question)
        print('  ', session.submit(expert.answer(session.query)).message)  # Or your own: Answer(query_id, Verdict.ANSWER, ...)
