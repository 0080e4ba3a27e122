"""Small linear fits with any covariance by whitening and QR.

Values x with the covariance S = L L' are fitted by x = A p + v. With A~ = L^-1 A = B U, B'B = I,

    p = U^-1 B' L^-1 x,    Q = U^-1 U^-T,    v~ = L^-1 v = (I - B B') L^-1 x,    Omega = v~' v~.

The residuals v have the cofactors Q_vv = L (I - B B') L'; redundancy numbers are the diagonal of Q_vv S^-1.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Fit:
    root: Floats  # (n, n) L
    basis: Floats  # (n, u) B
    whitened: Floats  # (n,) residuals, observed minus fitted, of unit weight
    parameters: Floats  # (u,) and (u, u)
    cofactors: Floats

    @classmethod
    def of(cls, values: Floats, covariance: Floats, columns: Floats) -> Fit:
        """Fit values (n,) with a covariance (n, n) by columns (n, u).

        InputError if the covariance is not positive definite, LinAlgError if columns are dependent.
        """
        scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        try:
            root = scale[:, np.newaxis] * np.linalg.cholesky(covariance / np.outer(scale, scale))
        except (np.linalg.LinAlgError, FloatingPointError):
            raise InputError(phrase("error.covariance")) from None
        a, y = np.linalg.solve(root, columns), np.linalg.solve(root, values)
        size = np.linalg.norm(a, axis=0)
        size[size == 0] = 1.0
        basis, upper = np.linalg.qr(a / size)
        inverse = np.linalg.inv(upper) / size[:, np.newaxis]
        return cls(root, basis, y - basis @ (basis.T @ y), inverse @ (basis.T @ y), inverse @ inverse.T)

    @property
    def residuals(self) -> Floats:
        """(n,) v, observed minus fitted."""
        return np.asarray(self.root @ self.whitened)

    @property
    def omega(self) -> float:
        return float(self.whitened @ self.whitened)

    @property
    def redundancy(self) -> Floats:
        """(n,) redundancy numbers."""
        left = np.eye(len(self.root)) - self.basis @ self.basis.T
        return np.diag(self.root @ left @ np.linalg.inv(self.root)).copy()

    @property
    def standardized(self) -> Floats:
        """(n,) Baarda's w, (W v)_i / sqrt((W Q_vv W)_ii), W = S^-1; NaN if undefined."""
        back = np.linalg.inv(self.root).T
        left = back - (back @ self.basis) @ self.basis.T
        variances = (left**2).sum(axis=1)
        unchecked = variances < UNCHECKED * (back**2).sum(axis=1)
        variances[unchecked] = np.nan
        return np.asarray(back @ self.whitened / np.sqrt(variances))

    def tested(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return estimates of single additional columns with sd; NaN if inestimable."""
        z = np.linalg.solve(self.root, columns)
        left = z - self.basis @ (self.basis.T @ z)
        squares = (left**2).sum(axis=0)
        squares[squares < BLIND * (z**2).sum(axis=0)] = np.nan
        return left.T @ self.whitened / squares, 1 / np.sqrt(squares)


BLIND = 1e-8  # Smallest part of a column that is independent of the others
UNCHECKED = 1e-10  # Smallest redundancy number of a checked observation
