"""A user's own decision process as a domain.

The .npz file has the fields of a process (`n_states`, `n_actions`, `gamma`; `p_action`, `p_from`, `p_to`, `p_prob`)
and its task: `reward` (n,), and optionally `goal` (n,) states that count as success, `start` (n,) distribution
(default: uniform), `horizon` steps (default 100) and `features` (n, f).
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from advise_ros.core.numerics import Bools, Floats
from advise_ros.core.planning.process import Mdp
from advise_ros.domains.domain import DISTRIBUTION_TOLERANCE, Domain, Measure, uniform_over
from advise_ros.domains.fields import PROCESS, Fields, read_fields, read_process

FIELDS = (*PROCESS, 'reward', 'goal', 'start', 'horizon', 'features')
HORIZON = 100


def load_domain(path: str) -> Domain:
    """The domain of a file, named after it; remembered until the file changes.

    Raises:
        InputError: the file cannot be read, or a field is missing or wrong.
    """
    return _loaded(path, changed_ns(Path(path)))


def changed_ns(file: Path) -> int:
    """When a file was last written; 0 where there is none, whose reader gives the error."""
    return file.stat().st_mtime_ns if file.exists() else 0


@lru_cache(maxsize=4)
def _loaded(path: str, _: int) -> Domain:
    fields = read_fields(path)
    fields.check_names(FIELDS)
    mdp = read_process(fields)
    ended = _never_left(mdp)
    if ended.all():
        raise fields.wrong('p_to', 'leads from no state to another; there is nothing to learn')
    has_goal = 'goal' in fields
    return Domain(
        name=Path(path).stem,
        mdp=mdp,
        reward=_of_states(fields, 'reward', mdp.n_states),
        ended=ended,
        goal=fields.flags('goal', (mdp.n_states,)) if has_goal else np.zeros(mdp.n_states, dtype=np.bool_),
        start=_of_states(fields, 'start', mdp.n_states) if 'start' in fields else uniform_over(~ended),
        measure=Measure.GOAL if has_goal else Measure.RETURN,
        horizon=fields.whole('horizon', 1, 1_000_000) if 'horizon' in fields else HORIZON,
        features=_features(fields, mdp.n_states),
        actions=tuple(f'action {action}' for action in range(mdp.n_actions)),
    )


def _of_states(fields: Fields, name: str, n_states: int) -> Floats:
    found = fields.floats(name)
    if len(found) != n_states:
        raise fields.wrong(name, f'has {len(found)} entries; it needs one a state, {n_states}')
    if name == 'start' and (found < 0).any():
        raise fields.wrong(name, f'holds {found.min():g}; it must be a distribution')
    if name == 'start' and abs(float(found.sum()) - 1.0) > DISTRIBUTION_TOLERANCE:
        raise fields.wrong(name, f'sums to {found.sum():g}; it must be a distribution')
    return found


def _features(fields: Fields, n_states: int) -> Floats:
    if 'features' not in fields:
        return np.zeros((n_states, 0))
    found = fields.array('features', 2, 'iuf').astype(np.float64)
    if len(found) != n_states:
        raise fields.wrong('features', f'has shape {found.shape}; it needs a row a state, {n_states}')
    if not np.isfinite(found).all():
        raise fields.wrong('features', f'holds {found[~np.isfinite(found)][0]}; it needs finite numbers')
    return found


def _never_left(mdp: Mdp) -> Bools:
    """States that every action stays in."""
    n = mdp.n_states
    stays = mdp.stacked[np.arange(mdp.n_actions * n), np.tile(np.arange(n), mdp.n_actions)]
    return np.all(np.asarray(stays).reshape(mdp.n_actions, n) > 1.0 - 1e-12, axis=0)
