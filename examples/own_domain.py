"""A decision process of your own, learnt with the methods of the paper: a corridor of ten cells with the goal on its right."""

import tempfile
from pathlib import Path

import numpy as np

from advise_ros.experiments.method import METHODS
from advise_ros.experiments.protocols import protocol_for
from advise_ros.experiments.trial import curves

file, n, gamma = str(Path(tempfile.mkdtemp(), 'corridor.npz')), 10, 0.95
cells = np.arange(n)
ended = cells == n - 1
right, left = np.where(ended, cells, cells + 1), np.where(ended, cells, np.maximum(cells - 1, 0))
np.savez(
    file, n_states=n, n_actions=2, gamma=gamma, reward=ended.astype(float), goal=ended, horizon=20,
    p_action=np.repeat([0, 1], n), p_from=np.tile(cells, 2), p_to=np.concatenate([right, left]), p_prob=np.ones(2 * n),
    features=cells[:, None] / n,
)
# A simulated person demonstrates with mistakes; then each method asks its questions.
reached = curves(protocol_for(file), (METHODS['clustered'], METHODS['random']), seed=0)
for method, curve in reached.items():
    print(f'{method}: goal reached in {", ".join(f"{percent:.0f}" for percent in curve)} % after 0, 1, 2, ... questions')
