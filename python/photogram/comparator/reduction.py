"""Residual effects of errors: traces of products with the reduction R, in linear memory.

With polynomials, the stages of the report are rigid and linear parameters, polynomials, and rigid parameters
again. This gives

    R = (I - P) (I - B B^T) (I - P - L L^T) = I - P - U W^T.

P projects on rotation and translations of every case (three columns on the rows of one case each). L contains
the linear parameters without their projection by P, B the polynomials (both orthonormal). Further, U = [L, (I
- P) B], W = [L, (I - P - L L^T) B] and P U = P W = 0. Sums of squares require only small products of U, W and
the errors of the grid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.comparator.case import PlacedCase
from photogram.comparator.combined_solution import CombinedLinear, CombinedPolynomial
from photogram.comparator.fits import rotation_matrix
from photogram.comparator.polynomial import Frame, design
from photogram.lazy_dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class GridErrors:
    """Coordinate errors e of one plate and their effect on residuals, v = E e."""

    cases: Indices  # Indices of the cases on the plate
    rows: Indices  # (n,) measured point and plate point of each non-zero block of E
    columns: Indices
    turns: Floats  # (n, 2, 2) blocks: rotations, mirrored if the comparator is left-handed
    counts: Indices  # (l,) number of cases per point

    @classmethod
    def of(
        cls,
        plate: int,
        grid_rows: Sequence[Indices],
        cases: Sequence[PlacedCase],
        stage: CombinedLinear | CombinedPolynomial,
    ) -> GridErrors:
        """Return the errors of a plate from its cases and point rows."""
        own = [k for k, case in enumerate(cases) if case.case.plate == plate]
        starts = np.cumsum([0, *(len(case.points) for case in cases)])
        points, columns = np.unique(np.concatenate([grid_rows[k] for k in own]), return_inverse=True)
        turns = []
        for k in own:
            turn = rotation_matrix(stage.cases[k].rotation_rad).T
            turns.append(turn[:, ::-1] if cases[k].orientation.left_handed else turn)
        return cls(
            cases=np.array(own),
            rows=np.concatenate([np.arange(starts[k], starts[k + 1]) for k in own]),
            columns=columns,
            turns=np.repeat(turns, [len(cases[k].points) for k in own], axis=0),
            counts=np.bincount(columns, minlength=len(points)),
        )

    def gathered(self, values: Floats) -> Floats:
        """Return E^T times columns: (measured points, 2, ...) to (plate points, 2, ...)."""
        turned = np.einsum("nji,nj...->ni...", self.turns, values[self.rows])
        flat = turned.reshape(len(turned), -1)
        sums = [np.bincount(self.columns, weights=column, minlength=len(self.counts)) for column in flat.T]
        gathered = np.asarray(np.column_stack(sums), dtype=float)
        return gathered.reshape(len(self.counts), *turned.shape[1:])

    def average(self, values: Floats) -> Floats:
        """Return columns rotated into the grid system and averaged by point, up to sign."""
        return np.asarray((self.gathered(values).T / self.counts).T)


@dataclass(frozen=True, eq=False)
class Reduction:
    """Reduction R for m measured points in case order; columns have shape (m, 2)."""

    starts: Indices  # First row of each case
    rigid: Floats  # (m, 2, 3) the columns of P, each on the rows of its case
    left: Floats  # (m, 2, k) U and W
    right: Floats

    @classmethod
    def of(cls, stage: CombinedLinear | CombinedPolynomial) -> Reduction:
        """Return the reduction of reading errors to residuals of a stage."""
        places = [fit.residuals.xy_um for fit in stage.cases]
        everywhere = np.vstack(places)
        reduction = cls(
            starts=np.cumsum([0, *(len(own) for own in places[:-1])]),
            rigid=np.concatenate([_rigid(own) for own in places]),
            left=np.empty((len(everywhere), 2, 0)),
            right=np.empty((len(everywhere), 2, 0)),
        )
        frame = Frame.of(everywhere)
        arguments = frame.arguments(everywhere)
        # Columns of the scales and of the lack of orthogonality.
        scales = np.zeros((len(arguments), 2, 3))
        scales[:, 0, 0], scales[:, 1, 1], scales[:, 0, 2] = arguments[:, 0], arguments[:, 1], arguments[:, 1]
        linear = np.linalg.qr(reduction.without_rigid(scales).reshape(-1, 3))[0].reshape(scales.shape)
        if isinstance(stage, CombinedLinear):
            return cls(reduction.starts, reduction.rigid, linear, linear)
        functions = np.linalg.qr(design(frame, everywhere))[0]
        both = np.einsum("nk,ij->nijk", functions, np.eye(2)).reshape(len(functions), 2, -1)
        free = reduction.without_rigid(both)
        return cls(
            reduction.starts,
            reduction.rigid,
            np.concatenate([linear, free], axis=2),
            np.concatenate([linear, free - linear @ _product(linear, both)], axis=2),
        )

    def without_rigid(self, values: Floats) -> Floats:
        """Return (I - P) times columns (m, 2, k)."""
        lengths = np.diff([*self.starts, len(values)])
        parts = np.stack(
            [np.add.reduceat(self.rigid[:, :, i, None] * values, self.starts) for i in range(3)], axis=2
        ).sum(axis=1)
        return np.asarray(values - np.einsum("nij,njk->nik", self.rigid, np.repeat(parts, lengths, axis=0)))

    def variances(self) -> Floats:
        """Return the diagonal of R R^T, (m, 2): residual variances for unit variance."""
        inner = _product(self.right, self.right)
        rigid = (self.rigid**2).sum(axis=2)
        mixed = 2 * (self.left * self.right).sum(axis=2)
        return np.asarray(1 - rigid - mixed + ((self.left @ inner) * self.left).sum(axis=2))

    def squares_of_units(self) -> float:
        """Sum of squares of R: expected squares of residuals for unit variance."""
        left, right = _product(self.left, self.left), _product(self.right, self.right)
        trace = float((self.left * self.right).sum())
        return 2 * len(self.left) - 3 * len(self.starts) - 2 * trace + float((left * right).sum())

    def squares_of_errors(self, errors: GridErrors) -> float:
        """Sum of squares of R E."""
        right = errors.gathered(self.right)
        return (
            2 * len(errors.rows)
            - 3 * len(errors.cases)
            - 2 * float((errors.gathered(self.left) * right).sum())
            + float((_product(self.left, self.left) * _product(right, right)).sum())
        )

    def averages_of_units(self, errors: GridErrors) -> float:
        """Sum of squares of A R, with A the average by point."""
        left, right = errors.average(self.left), errors.average(self.right)
        rigid = (self.rigid[errors.rows] ** 2).sum(axis=(1, 2)) / errors.counts[errors.columns] ** 2
        return (
            float((2 / errors.counts).sum() - rigid.sum())
            - 2 * float((left * right).sum())
            + float((_product(left, left) * _product(self.right, self.right)).sum())
        )

    def averages_of_errors(self, averaged: GridErrors, errors: GridErrors, *, lost: bool = False) -> float:
        """Sum of squares of A R E, A of one plate, E of the same or another.

        With `lost`, sum of squares of I - A R E of one plate: the errors that averages do not show.
        """
        left, right = averaged.average(self.left), errors.gathered(self.right)
        total = float((_product(left, left) * _product(right, right)).sum())
        if averaged is not errors:
            return total
        # A E = I; A P E = X Y^T, three columns per case.
        y = self._rigid_effects(errors)
        x = np.asarray((y.T / errors.counts).T)
        total += float((_product(x, x) * _product(y, y)).sum())
        total += 2 * float((_product(x, left) * _product(y, right)).sum())
        if lost:
            return total
        return total + 2 * len(errors.counts) - 2 * float((x * y).sum() + (left * right).sum())

    def _rigid_effects(self, errors: GridErrors) -> Floats:
        """Return E^T times the columns of P: (l, 2, 3 times the cases of the plate)."""
        turned = np.einsum("nji,njk->nik", errors.turns, self.rigid[errors.rows])
        case = np.searchsorted(self.starts, errors.rows, side="right") - 1
        place = np.searchsorted(errors.cases, case)
        effects = np.zeros((len(errors.counts), 2, len(errors.cases), 3))
        effects[errors.columns, :, place] = turned
        return effects.reshape(len(errors.counts), 2, -1)


def _product(first: Floats, second: Floats) -> Floats:
    """Return the products of all columns (m, 2, j) with all columns (m, 2, k)."""
    return np.asarray(np.tensordot(first, second, axes=((0, 1), (0, 1))))


def _rigid(xy_um: Floats) -> Floats:
    """Return translations and rotation of one case as orthonormal columns (n, 2, 3)."""
    x, y = (xy_um - xy_um.mean(axis=0)).T / np.linalg.norm(xy_um - xy_um.mean(axis=0))
    even, zero = np.full_like(x, 1 / np.sqrt(len(x))), np.zeros_like(x)
    return np.stack([np.column_stack([even, zero, -y]), np.column_stack([zero, even, x])], axis=1)
