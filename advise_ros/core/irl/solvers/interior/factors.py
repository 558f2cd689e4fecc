"""Factors of the interior-point system, by either of two packages behind one interface.

CHOLMOD gathers columns of equal pattern and leaves them to dense kernels, which makes it several times faster at
large sizes. It comes with cvxopt, whose licence is the GPL; QDLDL, whose licence is Apache 2.0, does without it.
Which of them is used is part of the solver's name, since their roundings differ.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from scipy import sparse

from advise_ros.core.errors import AdviseError
from advise_ros.core.irl.solvers.packaged import package
from advise_ros.core.numerics import Floats
from advise_ros.core.planning.process import Mdp

QDLDL, CHOLMOD = 'qdldl', 'cholmod'


class Pattern(NamedTuple):
    """Where the upper triangle of a symmetric matrix has entries, column by column, the diagonal among them."""

    indptr: npt.NDArray[np.int32]
    indices: npt.NDArray[np.int32]


class Factors(Protocol):
    """A positive definite matrix of one pattern, factored as often as its entries change."""

    def factor(self, data: Floats) -> None:
        """Take the entries of the upper triangle.

        Args:
            data: entries in the order of the pattern.

        Raises:
            AdviseError: the matrix is not positive definite in floating point.
        """

    def solve(self, right: Floats) -> Floats:
        """(n,) the solution, with the newest entries.

        Args:
            right: (n,) right-hand side.
        """

    def release(self) -> None:
        """Give back what is as large as the factors; what depends on the pattern alone may stay."""


class Qdldl:
    """LDL' by QDLDL."""

    def __init__(self, pattern: Pattern) -> None:
        self._package = package(QDLDL, 'qdldl', 'interior')
        n = len(pattern.indptr) - 1
        self._matrix = sparse.csc_matrix((np.zeros(len(pattern.indices)), pattern.indices, pattern.indptr), shape=(n, n))
        self._factor: Any = None

    def factor(self, data: Floats) -> None:
        self._matrix.data[:] = data
        try:
            if self._factor is None:
                self._factor = self._package.Solver(self._matrix, upper=True)
            else:
                self._factor.update(self._matrix, upper=True)
        except (RuntimeError, ValueError) as problem:
            raise AdviseError(f'the interior-point system cannot be factored: {problem}') from None

    def solve(self, right: Floats) -> Floats:
        solution: Floats = self._factor.solve(right)
        return solution

    def release(self) -> None:
        self._factor = None


class Cholmod:
    """LL' by CHOLMOD as cvxopt brings it: ordered by AMD, supernodal, one thread."""

    def __init__(self, pattern: Pattern) -> None:
        cvxopt = package('cvxopt', 'cvxopt', 'interior-cholmod')
        self._cholmod = importlib.import_module('cvxopt.cholmod')
        n = len(pattern.indptr) - 1
        columns = np.repeat(np.arange(n), np.diff(pattern.indptr))
        rows = cvxopt.matrix(pattern.indices.astype(np.int64))
        self._matrix = cvxopt.spmatrix(0.0, rows, cvxopt.matrix(columns), (n, n))
        # What numpy writes into the views, cvxopt reads.
        self._entries, self._right = cvxopt.matrix(0.0, (len(pattern.indices), 1)), cvxopt.matrix(0.0, (n, 1))
        self._entries_view, self._right_view = np.asarray(self._entries)[:, 0], np.asarray(self._right)[:, 0]
        self._order = importlib.import_module('cvxopt.amd').order(self._matrix, uplo='U')
        self._factor: Any = None

    def factor(self, data: Floats) -> None:
        self._entries_view[:] = data
        self._matrix.V = self._entries
        if self._factor is None:
            self._factor = self._symbolic()
        try:
            self._cholmod.numeric(self._matrix, self._factor)
        except ArithmeticError as problem:
            raise AdviseError(f'the interior-point system cannot be factored: column {problem}') from None

    def solve(self, right: Floats) -> Floats:
        self._right_view[:] = right
        self._cholmod.solve(self._factor, self._right)
        return self._right_view.copy()

    def release(self) -> None:
        self._factor = None

    def _symbolic(self) -> Any:
        """The factors' pattern in the order that is known."""
        options = self._cholmod.options
        before = dict(options)
        options['nmethods'] = 1  # This order, and no search for another one.
        try:
            return self._cholmod.symbolic(self._matrix, p=self._order, uplo='U')
        finally:
            options.clear()
            options.update(before)


KINDS: dict[str, type[Qdldl] | type[Cholmod]] = {QDLDL: Qdldl, CHOLMOD: Cholmod}
_idle: dict[str, WeakKeyDictionary[Mdp, Factors]] = {kind: WeakKeyDictionary() for kind in KINDS}


@contextmanager
def factors(mdp: Mdp, pattern: Pattern, kind: str) -> Iterator[Factors]:
    """Factors for the process's pattern, those of an earlier program if they are free.

    Raises:
        InputError: the package is missing.
    """
    idle = _idle[kind]
    try:
        made = idle.pop(mdp)
    except KeyError:
        made = KINDS[kind](pattern)
    try:
        yield made
    finally:
        made.release()
        idle[mdp] = made
