"""The local parts of the interior-point method: what each state does by itself, given v.

    p - q = (I - gamma Pbar) v,    p + q + u = r_max,               p, q, u >= 0
    s = G v - xi,                  xi + c = cap,                    s, c >= 0
    s = H v - delta - zeta + eta,  zeta + c_zeta = cap,             s, zeta, c_zeta, eta >= 0

All of them lie in one vector x, their multipliers in another, z. With d = z / x a step fulfils d dx + dz = aim z for
an aim that the method chooses, so eliminating a block is the arithmetic of springs: theta is the stiffness of a
reward, and the rows of a margin are one vertex (`margin_vertices.py`). Changes of x and z are relative to x and z: how far
a step can go is then read off, and dz is aim - dx.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import sparse

from advise_ros.core.irl.program import Duals, Problem
from advise_ros.core.irl.solvers.interior.elimination import System, structure_of
from advise_ros.core.irl.solvers.interior.factors import Factors
from advise_ros.core.irl.solvers.interior.margin_vertices import Margins, margins_of
from advise_ros.core.numerics import Floats

# The start's room between the margin and its rows, and the least multiplier.
ROOM, LEAST = 0.3, 1.0
# Rows start with this share of what would leave them and their cap alike: flows then start near balance.
LIGHT = 0.2


class Point(NamedTuple):
    """v (n,), the non-negative variables x and their multipliers z."""

    v: Floats
    x: Floats
    z: Floats


class Direction(NamedTuple):
    """Changes of v, and of x and z in shares of what they are."""

    v: Floats
    x: Floats
    z: Floats

    def plus(self, other: Direction, share: float) -> Direction:
        """This direction plus a multiple of another.

        Args:
            other: the other direction.
            share: its factor.
        """
        return Direction(*(a + share * b for a, b in zip(self, other, strict=True)))


class Layout(NamedTuple):
    """Where each kind of variable lies."""

    p: slice
    q: slice
    u: slice
    s: slice
    c: slice
    zeta: slice
    c_zeta: slice
    eta: slice

    @classmethod
    def of(cls, *sizes: int) -> Layout:
        """One kind after the other."""
        ends = np.cumsum([0, *sizes]).tolist()
        return cls(*(slice(a, b) for a, b in pairwise(ends)))


class Weights(NamedTuple):
    """What all directions of one step share.

    Attributes:
        x_inverse, z, d: 1 / x, z and z / x.
        half, lean: (n,) half of what p + q + u resist together, and how p and q differ in it.
        bound: (|S|,) what zeta and its cap resist.
        ground, total: (margins,) what bounds a margin resists, and that together with its rows.
        residual: (n,) what the dual equation of v lacks.
    """

    x_inverse: Floats
    z: Floats
    d: Floats
    half: Floats
    lean: Floats
    bound: Floats
    ground: Floats
    total: Floats
    residual: Floats


class Blocks:
    """The blocks of one problem.

    Args:
        problem: with elastic advice, or without advice.
        factors: for the pattern of its process.
    """

    def __init__(self, problem: Problem, factors: Factors) -> None:
        self._problem = problem
        self._margins = margins_of(problem, structure_of(problem.mdp).edge)
        self._system = System(problem, factors)
        self._rows = _rows(problem, self._margins)
        self._columns = self._rows.T.tocsr()
        self._n_shown = self._margins.n_demonstrated
        self._capped = np.flatnonzero(np.isfinite(self._margins.caps))
        n, advised = problem.mdp.n_states, len(self._margins.start) - self._n_shown
        capped = advised if np.isfinite(problem.terms.cap) else 0
        self._at = Layout.of(n, n, n, len(self._margins.owner), len(self._capped), advised, capped, advised)

    # -- the start, and what a point says ----------------------------------------------------
    def start(self) -> Point:
        """v = 0, and all else as central as it can be without a solve."""
        terms, margins, at = self._problem.terms, self._margins, self._at
        cap = terms.cap if np.isfinite(terms.cap) else 1.0
        lambda_t = terms.lambda_t
        x, z = np.ones(at.eta.stop), np.ones(at.eta.stop)
        x[at.p] = x[at.q] = x[at.u] = terms.r_max / 3.0
        x[at.s], x[at.c] = ROOM, margins.caps[self._capped] + ROOM
        x[at.zeta] = x[at.c_zeta] = cap / 2.0
        x[at.eta] = cap / 2.0 + terms.delta + ROOM
        rows = np.bincount(margins.owner, minlength=len(margins.start))
        shown, capped = rows[: self._n_shown], np.isfinite(margins.caps)
        of_row = np.where(capped, LIGHT, 1.0) * lambda_t / (shown + capped)
        mean = max(LEAST, lambda_t / (3.0 / ROOM + 1.0 / (cap + ROOM)))
        z[at.u] = mean * 3.0 / terms.r_max
        z[at.p] = z[at.q] = 1.0 + z[at.u]
        z[at.c] = (lambda_t - shown * of_row)[self._capped]
        asked = self._start_of_advice(z, mean)
        z[at.s] = np.concatenate([of_row, np.full(len(rows) - self._n_shown, asked) / rows[self._n_shown :]])[margins.owner]
        return Point(np.zeros(self._problem.mdp.n_states), x, z)

    def _start_of_advice(self, z: Floats, mean: float) -> float:
        """The multipliers of zeta, its cap and eta; what the rows of a state then sum to."""
        terms, at = self._problem.terms, self._at
        if not np.isfinite(terms.cap):
            asked = (terms.lambda_a + terms.slack_cost) / 2.0
            z[at.zeta], z[at.eta] = asked - terms.lambda_a, terms.slack_cost - asked
            return asked
        asked = LIGHT * terms.slack_cost / 2.0
        z[at.zeta] = max(mean * 2.0 / terms.cap, LEAST + asked - terms.lambda_a)
        z[at.c_zeta] = z[at.zeta] + terms.lambda_a - asked
        z[at.eta] = terms.slack_cost - asked
        return asked

    def estimated_gap(self, point: Point) -> float:
        """The relative gap if the residual were nothing."""
        terms, at, x = self._problem.terms, self._at, point.x
        xi = (self._margins.caps[self._capped] - x[at.c]).sum()
        objective = (
            terms.lambda_t * xi + terms.lambda_a * x[at.zeta].sum() - terms.slack_cost * x[at.eta].sum()
            - x[at.p].sum() - x[at.q].sum()
        )
        return float(np.einsum('i,i', x, point.z) / max(1.0, abs(objective)))

    def duals(self, point: Point) -> Duals:
        """The multipliers of the problem's rows; rows that are zero have none."""
        at, rows = self._at, self._margins.rows_demonstrated
        shown = np.zeros(len(self._problem.demonstration_pairs.states))
        shown[self._margins.shown] = point.z[at.s][:rows]
        return Duals((point.z[at.p] - point.z[at.q]) / 2.0, shown, point.z[at.s][rows:])

    # -- one step ----------------------------------------------------------------------------
    def weigh(self, point: Point) -> Weights:
        """Factor the system at a point.

        Raises:
            AdviseError: it cannot be factored.
        """
        at, margins, x_inverse = self._at, self._margins, 1.0 / point.x
        d = point.z * x_inverse
        d_p, d_q, d_u = d[at.p], d[at.q], d[at.u]
        both = d_p + d_q
        half = (both + 4.0 * d_u) / 2.0
        theta = (d_p * d_q + d_u * both) / (2.0 * half)
        bound = self._with_cap(d[at.zeta], d[at.c_zeta])
        ground = self._of_margins(d[at.c], bound * d[at.eta] / (bound + d[at.eta]))
        total = margins.total(d[at.s]) + ground
        self._system.factor(theta, margins.weights(d[at.s], ground, total))
        return Weights(
            x_inverse, point.z, d, half, (d_p - d_q) / (2.0 * half), bound, ground, total, self._residual(point)
        )

    def _residual(self, point: Point) -> Floats:
        flow = (point.z[self._at.p] - point.z[self._at.q]) / 2.0
        return -(self._columns @ np.concatenate([flow, point.z[self._at.s]]))

    def direction(self, weights: Weights, aim: Floats | float, residual: Floats | None = None) -> Direction:
        """The changes with d dx + dz = aim z that take the residual away.

        Args:
            weights: of `weigh`, for the point.
            aim: number, or one for each variable (k,).
            residual: (n,) to be taken away; None: 0.
        """
        at, margins, d = self._at, self._margins, weights.d
        n = at.p.stop
        wanted = aim * weights.z
        together = wanted[at.p] + wanted[at.q]
        together -= 2.0 * wanted[at.u]
        together /= weights.half
        room, d_eta = self._with_cap(wanted[at.zeta], -wanted[at.c_zeta]), d[at.eta]
        advice = (weights.bound * wanted[at.eta] - d_eta * room) / (weights.bound + d_eta)
        of_bounds = self._of_margins(wanted[at.c], advice)
        pull = margins.total(wanted[at.s]) + of_bounds
        force = np.empty(n + len(margins.owner))
        np.subtract(wanted[at.p], wanted[at.q], out=force[:n])
        force[:n] -= weights.lean * together * weights.half
        force[:n] /= 2.0
        np.multiply(d[at.s], margins.spread(pull / weights.total), out=force[n:])
        np.subtract(wanted[at.s], force[n:], out=force[n:])
        right = self._columns @ force
        if residual is not None:
            right -= residual
        v = self._system.solve(right)
        moved = self._rows @ v
        reward, rows = moved[:n], moved[n:]
        margin = (margins.total(d[at.s] * rows) - pull) / weights.total
        x = np.empty(at.eta.stop)
        together -= weights.lean * reward
        np.add(together, reward, out=x[at.p])
        np.subtract(together, reward, out=x[at.q])
        x[: at.u.start] /= 2.0
        np.negative(together, out=x[at.u])
        np.subtract(rows, margins.spread(margin), out=x[at.s])
        x[at.c] = -margin[self._capped]
        asked = -(of_bounds + margin * weights.ground)[self._n_shown :]
        x[at.zeta] = (room - asked) / weights.bound
        x[at.c_zeta] = -x[at.zeta][: at.c_zeta.stop - at.c_zeta.start]
        x[at.eta] = (asked + wanted[at.eta]) / d_eta
        x *= weights.x_inverse
        return Direction(v, x, aim - x)

    def _with_cap(self, of_zeta: Floats, of_cap: Floats) -> Floats:
        """The sum where zeta has a cap."""
        return of_zeta + of_cap if len(of_cap) else of_zeta.copy()

    def _of_margins(self, of_caps: Floats, of_advice: Floats) -> Floats:
        """(margins,) what belongs to the cap of each demonstrated and to the margin of each advised state."""
        whole = np.zeros(self._n_shown + len(of_advice))
        whole[self._capped] = of_caps
        whole[self._n_shown :] = of_advice
        return whole


def _rows(problem: Problem, margins: Margins) -> sparse.csr_array:
    """(n + m, n) what turns v into rewards and then into margins."""
    rewards = sparse.eye_array(problem.mdp.n_states, format='csr') - problem.mdp.gamma * problem.mixed
    return sparse.vstack([rewards, margins.pairs.differences(problem.mdp)], format='csr')
