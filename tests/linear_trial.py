"""Snooping in a linear model given as a matrix: for small problems, and as a standard for networks."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram import InputError
from photogram.arguments.types import Floats
from photogram.statistics import group_tests
from photogram.statistics.snooping.suspects import (
    LostSupportError,
    Out,
    Prediction,
    Standing,
    Suspects,
    Tests,
)


class LinearSuspects(Suspects):
    """Groups of numbered rows."""

    names: list[str]

    def loads(self, group):
        """Return no photos."""
        return np.empty(0, dtype=np.int64)

    def parts(self, group):
        """Return None: groups go as a whole."""

    def name(self, group):
        """Return the name of a group."""
        return f"observation {self.names[group]}"

    def row_name(self, row):
        """Return the number of a row in its group."""
        return str(row - int(self.row_starts[np.searchsorted(self.row_starts, row, "right") - 1]))

    def unit(self, row):
        """Return no unit."""
        return ""

    def photo_name(self, photo):
        """Return the number of a photo."""
        return str(photo)


class LinearTrial:
    """Observations l = A x with standard deviations, in groups.

    Parameters
    ----------
    partials
        (M, u) A.
    observed
        (M,) l.
    sd
        (M,) or one for all.
    groups
        Rows of each group, consecutive from the first on; each row by itself when None.
    names
        Of the groups; their numbers when None.

    Raises
    ------
    InputError
        Arrays that do not go together, or observations that do not determine the unknowns.
    """

    def __init__(
        self,
        partials: ArrayLike,
        observed: ArrayLike,
        sd: ArrayLike,
        groups: Sequence[int] | None = None,
        names: Sequence[str] | None = None,
    ) -> None:
        a, values = np.asarray(partials, dtype=np.float64), np.asarray(observed, dtype=np.float64)
        if a.ndim != 2 or values.shape != a.shape[:1]:
            raise InputError("partials are (M, u) and observed values (M,)")
        self.deviations: Floats = np.array(np.broadcast_to(np.asarray(sd, dtype=np.float64), values.shape))
        self._a = a / self.deviations[:, np.newaxis]
        self._l = values / self.deviations
        sizes = [1] * len(values) if groups is None else list(groups)
        starts = np.concatenate([[0], np.cumsum(sizes)])
        if starts[-1] != len(values):
            raise InputError("groups have as many rows as there are observations")
        called = [str(number) for number in range(len(sizes))] if names is None else list(names)
        none = np.full(len(sizes), -1)
        self.suspects = LinearSuspects(
            row_starts=starts,
            kinds=np.zeros(len(sizes), dtype=np.int64),
            kind_names=["observation"],
            subjects=np.arange(len(sizes)),
            points=none,
            photos=none,
            removable=np.ones(len(sizes), dtype=bool),
        )
        self.suspects.names = called
        self.whole = True
        self.unknowns: Floats = np.zeros(a.shape[1])
        self.adjust(Out(np.zeros(len(values), dtype=bool)))

    def adjust(self, out: Out, *, exact: bool = False) -> Standing:
        """Solve without what is out."""
        self._in = ~out.rows
        a, values = self._a[self._in], self._l[self._in]
        if np.linalg.matrix_rank(a) < a.shape[1]:
            raise LostSupportError([], [])
        self.unknowns = np.asarray(np.linalg.lstsq(a, values, rcond=None)[0], dtype=np.float64)
        self._q = np.linalg.inv(a.T @ a)
        v = values - a @ self.unknowns
        return Standing("converged", float(v @ v), len(values) - a.shape[1])

    def response(self) -> tuple[Floats, Floats]:
        """Return residuals of unit weight and R; zero for what is out."""
        a = np.where(self._in[:, np.newaxis], self._a, 0.0)
        v = np.where(self._in, self._l - self._a @ self.unknowns, 0.0)
        return v, np.diag(self._in.astype(np.float64)) - a @ self._q @ a.T

    def tests(self) -> Tests:
        """Test all groups."""
        v, r = self.response()
        starts = self.suspects.row_starts
        size = int(np.diff(starts).max())
        rows = starts[:-1, np.newaxis] + np.arange(size)
        there = rows < starts[1:, np.newaxis]
        rows = np.where(there, rows, 0)
        there &= self._in[rows]
        found = group_tests(
            r[rows[:, :, np.newaxis], rows[:, np.newaxis, :]], np.where(there, v[rows], math.nan)
        )
        variances = np.diagonal(found.cofactors, axis1=1, axis2=2)
        error = np.full((2, len(v)), math.nan)
        error[0, rows[there]], error[1, rows[there]] = found.error[there], np.sqrt(variances[there])
        return Tests(
            active=np.asarray(there.any(axis=1)),
            rank=found.dimension,
            statistic=found.statistic,
            least=found.weakest,
            shared=np.zeros(len(starts) - 1),
            residual=np.where(self._in, v, math.nan),
            redundancy=np.where(self._in, np.diagonal(r), math.nan),
            error=error[0] * self.deviations,
            error_sd=error[1] * self.deviations,
        )

    def predictions(self, groups: Sequence[int]) -> list[Prediction | None]:
        """Test what is out of groups against the rest."""
        return [self._prediction(group) for group in groups]

    def _prediction(self, group: int) -> Prediction | None:
        rows = self.suspects.rows(group)
        rows = rows[~self._in[rows]]
        if not rows.size:
            return None
        a = self._a[rows]
        d, c = self._l[rows] - a @ self.unknowns, np.eye(len(rows)) + a @ self._q @ a.T
        sd = self.deviations[rows]
        return Prediction(
            statistic=float(d @ np.linalg.solve(c, d)),
            rows=tuple(rows.tolist()),
            error=tuple((d * sd).tolist()),
            error_sd=tuple((np.sqrt(np.diagonal(c)) * sd).tolist()),
        )

    def blocks(self, groups: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return each group by itself: nothing is on a point."""
        v, r = self.response()
        rows = [self.suspects.rows(group) for group in groups]
        return [([group], v[own], r[np.ix_(own, own)]) for group, own in zip(groups, rows, strict=True)]

    def gone_blocks(self, points: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """There are no points."""
        return []

    def resist(self, scale: float) -> Floats:
        """Reweight by Huber's loss, then by Cauchy's (Holland and Welsch 1977)."""
        weights = self._in.astype(np.float64)
        residual = np.zeros(len(weights))
        for limit in (1.345, 2.385):
            for _ in range(10):
                root = np.sqrt(weights)
                x = np.linalg.lstsq(self._a * root[:, np.newaxis], self._l * root, rcond=None)[0]
                residual = np.where(self._in, np.abs(self._l - self._a @ x), 0.0)
                size = np.maximum(residual / (limit * scale), 1e-12)
                shrunk = np.minimum(1.0, 1.0 / size) if limit < 2 else 1.0 / (1.0 + size**2)
                weights = np.where(self._in, shrunk, 0.0)
        return np.asarray(np.sqrt(np.add.reduceat(residual**2, self.suspects.row_starts[:-1])))

    def consequences(self, out: Out, group: int) -> tuple[set[int], set[int]]:
        """Nothing goes with a group."""
        return set(), set()
