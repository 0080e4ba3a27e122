"""Calibrated plate camera with its covariance, and statistics of stars and images."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import truth_value
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.show.methods import Documented, Judged
from photogram.statistics.limits import GlobalTest, global_test
from photogram.stellar.camera_tables import (
    correlated,
    correlation_remarks,
    correlations,
    plate_findings,
    significance,
)
from photogram.stellar.cameras import PlateCamera
from photogram.stellar.curves import Directions, directions, mean_error_ellipses
from photogram.stellar.iteration import PreRun, Solved
from photogram.stellar.parameters import DISTORTION, GROUPS, INDEX, NAMES, SIGNIFICANT
from photogram.stellar.places import transformed_angles
from photogram.stellar.problem import Counts, Problem
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings
    from photogram.stellar.movement import Movement
    from photogram.stellar.pictures import PicturedStars


@dataclass(frozen=True, eq=False, repr=False)
class Result(Judged, Documented):
    """Result of a plate calibration.

    Residuals are computed minus measured (v of the report), for stars adjusted minus catalogue. They are
    added to observations. Covariances are cofactors times the square of `mean_error`.

    Attributes
    ----------
    problem
        Input of the adjustment.
    solved
        Adjusted parameters, star positions, cofactors, residuals.
    messages
        Warnings.
    given
        Complete problem if only the minimum solution was computed.
    stages
        Solutions in order; the last one is `solved`.
    pre_run
        Residuals of the unused images, if a pre-run was requested.
    movement
        Movement test, if requested.
    combined
        Combined solution, a separate result, if attitudes do not differ.
    pairs
        For a combined solution: the pairs that passed the movement test.
    spoiled
        Change of the camera by outliers, if it exceeds the uncertainty without them; else empty.
    """

    problem: Problem
    solved: Solved
    messages: tuple[Message, ...]
    given: Problem
    stages: tuple[Solved, ...] = ()
    pre_run: PreRun | None = None
    movement: Movement | None = None
    combined: Result | None = None
    pairs: tuple[tuple[str, str], ...] = ()
    spoiled: str | Phrase = ""

    @property
    def converged(self) -> bool:
        """Whether the last solution met its convergence criterion."""
        return self.solved.converged

    @property
    def counts(self) -> Counts:
        """Observations and unknowns."""
        return self.solved.counts

    @property
    def levels(self) -> tuple[float, ...]:
        """Levels of discrepancies of all solutions, metres."""
        return tuple(level for stage in self.stages for level in stage.levels)

    @property
    def degrees_of_freedom(self) -> int:
        """Observations minus unknowns."""
        return self.counts.degrees_of_freedom

    @property
    def computed_mean_error(self) -> float:
        """Mean error of unit weight from the residuals, metres for unit plate weight."""
        return math.sqrt(sum(self.solved.sums) / self.counts.usable)

    @property
    def test(self) -> GlobalTest | None:
        """Global test for a given mean error of unit weight (option 14), else None."""
        given = self.problem.options.mean_error
        return global_test(sum(self.solved.sums) / given**2, self.degrees_of_freedom) if given else None

    @property
    def mean_error(self) -> float:
        """Mean error of unit weight: given (option 14) or computed."""
        return self.problem.options.mean_error or self.computed_mean_error

    @property
    def parameters(self) -> dict[str, float]:
        """Adjusted parameters by name; radians, metres, seconds of arc."""
        return dict(zip(NAMES, self.solved.parameters.tolist(), strict=True))

    def as_camera(self, name: str = "", *, weighted: bool = True) -> Camera:
        """Return the camera of blocks, `plate` in mm, preferably of the combined solution.

        Parameters
        ----------
        name
            Name in reports.
        weighted
            Whether parameters are weighted by their full covariance; otherwise they are fixed.
        """
        truth_value("weighted", weighted)
        return PlateCamera.of(self).as_camera(name, weighted=weighted)

    @property
    def groups(self) -> tuple[str, ...]:
        """Orientations (`pre`, `post`, `event`) with an estimated attitude."""
        free = self.solved.free[:9]
        return tuple(
            name for first, name in zip((0, 3, 6), GROUPS, strict=True) if free[first : first + 3].any()
        )

    def attitude(self, group: str) -> Floats:
        """Return alpha, omega, kappa (3,) of an orientation, radians."""
        first = 3 * GROUPS.index(group)
        return self.solved.parameters[first : first + 3]

    def transformed_attitudes(self) -> dict[str, Floats]:
        """Return attitudes at the reference station and mean pole, if one is given."""
        site, options = self.problem.site, self.problem.options
        if (reference := options.reference) is None:
            return {}
        angles = {name: self.attitude(name) for name in self.groups}
        return {name: transformed_angles(own, site, reference, options.pole) for name, own in angles.items()}

    @property
    def estimated(self) -> list[str]:
        """Names of the estimated parameters."""
        return [name for name, free in zip(NAMES, self.solved.free, strict=True) if free]

    @cached_property
    def covariance(self) -> Floats:
        """(26, 26) covariance of all parameters; zero for fixed ones."""
        return self.mean_error**2 * self.solved.cofactors

    @property
    def mean_errors(self) -> dict[str, float]:
        """Mean errors of the parameters by name."""
        return dict(zip(NAMES, np.sqrt(np.maximum(np.diag(self.covariance), 0)).tolist(), strict=True))

    @cached_property
    def correlation(self) -> Floats:
        """(26, 26) correlations; zero for fixed parameters."""
        return correlations(self.covariance)

    @property
    def star_residuals(self) -> Floats:
        """(S, 2) adjusted minus catalogue right ascension and declination, radians."""
        return self.solved.places - self.problem.star_places

    @property
    def star_covariances(self) -> Floats:
        """(S, 2, 2) of adjusted star positions, radians squared, scaled by `mean_error`."""
        return self.mean_error**2 * self.solved.star_cofactors

    @property
    def standardized(self) -> Floats:
        """(m, 2) residuals over their mean errors."""
        return self.solved.standardized / (self.mean_error or math.nan)

    @property
    def star_standardized(self) -> Floats:
        """(S, 2) residuals of the catalogue positions over their mean errors."""
        return self.solved.star_standardized / (self.mean_error or math.nan)

    def ellipses(self) -> Floats:
        """Return (S, 3) semi-axes and directions of the mean error ellipses of the stars, radians."""
        return mean_error_ellipses(self.star_covariances, self.solved.places[:, 1])

    def directions(self) -> Directions:
        """Return the unknown directions with their error ellipses."""
        return directions(self)

    def document(self) -> Document:
        """Return the document with verdict, parameters, observations, curves and movement."""
        from photogram.stellar.document import plate_document

        return plate_document(self)

    def _plot_data(self) -> PicturedStars:
        from photogram.stellar.pictures import plate_pictured

        return plate_pictured(self)

    def _findings(self) -> Findings:
        return plate_findings(self)

    def correlated(self) -> list[tuple[str, str, float]]:
        """Return pairs of parameters with correlations above 0.95."""
        return correlated(NAMES, self.covariance)

    def significance(self) -> dict[str, float]:
        """Return the ratio of each estimated distortion coefficient to its mean error."""
        rows = [INDEX[name] for name in DISTORTION if self.solved.free[INDEX[name]]]
        names = [NAMES[row] for row in rows]
        return significance(names, self.solved.parameters[rows], self.covariance[np.ix_(rows, rows)])

    def doubtful(self) -> list[Phrase]:
        """Return warnings on correlated parameters and insignificant distortion terms."""
        weak = {name: ratio for name, ratio in self.significance().items() if ratio < SIGNIFICANT}
        terms = [phrase("stars.weak-ratio", name=name, ratio=ratio) for name, ratio in weak.items()]
        remarks = [*correlation_remarks(self.correlated())]
        return [*remarks, *([phrase("stars.weak-terms", terms=terms)] if terms else [])]
