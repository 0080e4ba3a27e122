"""What every adjustment of photos and points has: cofactors, and covariances scaled by the unit weight."""

from __future__ import annotations

from photogram.arguments.arrays import standard_deviations
from photogram.arguments.types import Floats

__all__ = ["Scaled"]


class Scaled:
    """Photos and points with their cofactors, and the variance of unit weight that makes covariances of them.

    Attributes
    ----------
    status
        `converged`, `not converged` or `diverged`.
    variance_of_unit_weight
        None without degrees of freedom.
    photo_cofactors, point_cofactors
        (P, k, k) and (n, 3, 3), for a priori unit weight.
    """

    status: str
    variance_of_unit_weight: float | None
    photo_cofactors: Floats
    point_cofactors: Floats

    @property
    def converged(self) -> bool:
        """Whether the criterion of convergence was met."""
        return self.status == "converged"

    @property
    def covariance_scale(self) -> float:
        """What cofactors are multiplied by: the variance of unit weight, or 1 where there is none."""
        return 1.0 if self.variance_of_unit_weight is None else self.variance_of_unit_weight

    @property
    def photo_covariances(self) -> Floats:
        """(P, k, k) covariances of the unknowns of photos, scaled by the variance of unit weight."""
        return self.photo_cofactors * self.covariance_scale

    @property
    def point_covariances(self) -> Floats:
        """(n, 3, 3) covariances, scaled by the variance of unit weight."""
        return self.point_cofactors * self.covariance_scale

    @property
    def photo_sd(self) -> Floats:
        """(P, k) standard deviations of the unknowns of photos."""
        return standard_deviations(self.photo_covariances)

    @property
    def point_sd(self) -> Floats:
        """(n, 3) standard deviations."""
        return standard_deviations(self.point_covariances)
