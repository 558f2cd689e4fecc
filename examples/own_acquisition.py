"""Another answer to "what is asked next?": the cluster that was flown least, wherever the policy flies."""

import numpy as np

from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import learn
from advise_ros.core.people.simulated_pilot import SimulatedPilot, demonstrate
from advise_ros.core.questions.acquisition import ACQUISITIONS, cluster_uncertainty
from advise_ros.recording.gridfile import load_grid


def least_flown(ranking):
    """(k,) worth of each cluster, from the scarcity (n,) of moves in its states; the highest is asked about first."""
    return cluster_uncertainty(ranking.labels, ranking.sources.scarcity, 'mean')


ACQUISITIONS['least flown'] = least_flown

grid = load_grid('config/grid_6x6.yaml')
pilot = SimulatedPilot(grid, noise_rate=0.4, mistake_share=0.2, rng=np.random.default_rng(1))
flights = tuple(demonstrate(grid, pilot, number, max_moves=400) for number in range(5))
for name in ('occupancy', 'least flown'):
    print(f'{name}: {learn(grid, LearnSettings(acquisition=name), flights, log=()).query.question}')
