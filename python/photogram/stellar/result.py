"""A calibrated camera with its covariance, and what the stars and their images say about it."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.show.methods import Documented, Judged
from photogram.show.summary import Brief
from photogram.statistics.limits import GlobalTest, global_test
from photogram.stellar.camera_tables import correlated, correlations, significance
from photogram.stellar.parameters import INDEX, NAMES
from photogram.stellar.plate_model import plate_camera
from photogram.stellar.problem import Counts, Problem
from photogram.stellar.state import Level, Solved

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings

__all__ = ["Ellipse", "FictitiousPoint", "Movement", "PreRun", "Result", "Stage", "ellipse"]


@dataclass(frozen=True)
class Movement:
    """A fictitious point under two attitudes."""

    first: str  # The groups
    second: str
    xy: float  # x = y of the point, metres
    angle: float  # Angle between its two directions and its mean error, radians
    mean_error: float
    # Second minus first: right ascension times cos(declination), declination, azimuth times sin(zenith
    # distance), elevation; radians
    differences: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class FictitiousPoint:
    """A plate point as a direction under one attitude."""

    group: str  # Of the attitude
    xy: float  # x = y of the point, metres
    place: tuple[float, float]  # Apparent right ascension and declination, radians
    azimuth: float  # Observed (refracted) ones: azimuth from south, positive west; radians
    elevation: float
    covariance: Floats  # (2, 2) of the place from the orientation, radians squared


SIGNIFICANT = 1.96
"""Distortion terms below this multiple of their mean error are named (5 % of error)."""
_SIDES: tuple[Literal["left"], Literal["right"]] = ("left", "right")
DISTORTION = ("K1", "K2", "K3", "K4", "K5")


@dataclass(frozen=True)
class Ellipse:
    """A mean error ellipse on the sphere."""

    major: float  # Half axes, radians
    minor: float
    # Of the major axis, from increasing right ascension towards increasing declination, radians
    direction: float


def ellipse(covariance: Floats, declination: float) -> Ellipse:
    """Return the mean error ellipse of a covariance of right ascension and declination (section 5.7)."""
    turned = np.diag([math.cos(declination), 1.0])
    values, vectors = np.linalg.eigh(turned @ covariance @ turned)
    minor, major = (math.sqrt(max(float(value), 0.0)) for value in values)
    return Ellipse(major, minor, math.atan2(vectors[1, 1], vectors[0, 1]) % math.pi)


@dataclass(frozen=True, eq=False)
class Direction:
    """An unknown direction (section 5.7)."""

    star: str  # Its number
    place: tuple[float, float]  # Right ascension and declination, radians
    correction: tuple[float, float]  # (2,) of the direction of its first image, radians
    azimuth: float  # Observed (refracted) ones at its first image: azimuth from south, positive west; radians
    elevation: float
    mean_errors: tuple[float, float]  # Of right ascension times cos(declination), and declination; radians
    # m_i: mean error of unit weight from its own images, which should be parallel; that of the
    # adjustment where there is only one
    image_mean_error: float
    orientation: Ellipse  # Ellipse from the orientation alone, as if its images had no error
    total: Ellipse  # Ellipse with its images at the mean error of unit weight of the adjustment
    published: Ellipse  # Ellipse with its images at m_i, as the report has it


@dataclass(frozen=True)
class Stage:
    """One of the solutions of a run."""

    solution: str  # `minimum`, `maximum` or `refraction`
    counts: Counts  # Its observations and unknowns
    levels: tuple[Level, ...]  # Its history
    stop: str  # Why it stopped
    converged: bool  # Whether by its criterion
    # Natural logarithm of the determinant of its reduced normal equations, in the units of the
    # parameters
    log_determinant: float


@dataclass(frozen=True, eq=False)
class PreRun:
    """Images that took no part in the minimum solution (option 7)."""

    points: tuple[str, ...]  # Their numbers, and those of their stars
    stars: tuple[str, ...]
    residuals: Floats  # (m, 2) computed minus measured, metres


@dataclass(frozen=True, eq=False, repr=False)
class Result(Judged, Documented, Brief):
    """A calibration.

    Residuals are computed minus measured (the report's v), for stars adjusted minus catalogue: what has to be
    added to an observation. Covariances are cofactors times the square of `mean_error`.

    Attributes
    ----------
    problem
        What was adjusted.
    solved
        Parameters, places, cofactors, residuals.
    counts
        Observations and unknowns.
    messages
        Remarks that did not stop the run.
    given
        The whole problem, where only the minimum solution was computed.
    stages
        The solutions of the run in their order; the last one is `solved`.
    pre_run
        Residuals of the images that took no part, if a pre-run was asked for.
    movement
        The movement test, if asked for.
    combined
        The combined solution, if attitudes do not differ: a result of its own.
    pairs
        Of a combined solution: the pairs that the movement test found equal.
    spoiled
        By how much outliers change the camera, where that is more than it is uncertain without them.
    """

    problem: Problem
    solved: Solved
    counts: Counts
    messages: tuple[Message, ...]
    given: Problem
    stages: tuple[Stage, ...] = ()
    pre_run: PreRun | None = None
    movement: tuple[Movement, ...] = ()
    combined: Result | None = None
    pairs: tuple[tuple[str, str], ...] = ()
    spoiled: str = ""

    @property
    def converged(self) -> bool:
        """Whether the last solution ended by its criterion."""
        return self.solved.converged

    @property
    def levels(self) -> tuple[Level, ...]:
        """The history of all solutions."""
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
        """The global test where the mean error of unit weight is given (option 14); else it is not known."""
        given = self.problem.options.mean_error
        return global_test(sum(self.solved.sums) / given**2, self.degrees_of_freedom) if given else None

    @property
    def mean_error(self) -> float:
        """Mean error of unit weight in use: the given one (option 14), or the computed one."""
        return self.problem.options.mean_error or self.computed_mean_error

    @property
    def parameters(self) -> dict[str, float]:
        """Adjusted parameters by name; radians, metres, seconds of arc."""
        return dict(zip(NAMES, self.solved.parameters.tolist(), strict=True))

    def as_camera(self, name: str = "", *, weighted: bool = True) -> Camera:
        """Return the camera as blocks take it, of the combined solution where there is one: `plate`, in mm.

        Parameters
        ----------
        name
            For reports.
        weighted
            Whether its parameters are observations with their full covariance; otherwise they are known.
        """
        own = self.combined or self
        options = own.problem.options
        interior = slice(INDEX["epsilon"], INDEX["phi_T"] + 1)
        return plate_camera(
            own.solved.parameters[interior],
            own.covariance[interior, interior],
            name,
            weighted=weighted,
            common_scale=options.common_scale,
            distortion_first=options.distortion_first,
        )

    @property
    def estimated(self) -> list[str]:
        """Names of the parameters that were estimated."""
        return [name for name, free in zip(NAMES, self.solved.free, strict=True) if free]

    @cached_property
    def covariance(self) -> Floats:
        """(26, 26) of all parameters; zero for what was not estimated."""
        return self.mean_error**2 * self.solved.cofactors

    @property
    def mean_errors(self) -> dict[str, float]:
        """Mean errors of the parameters by name."""
        return dict(zip(NAMES, np.sqrt(np.maximum(np.diag(self.covariance), 0)).tolist(), strict=True))

    @cached_property
    def correlation(self) -> Floats:
        """(26, 26) correlations; zero for what was not estimated."""
        return correlations(self.covariance)

    @property
    def star_residuals(self) -> Floats:
        """(S, 2) adjusted minus catalogue right ascension and declination, radians."""
        return self.solved.places - self.problem.star_places

    @property
    def star_covariances(self) -> Floats:
        """(S, 2, 2) of the adjusted places, radians squared, scaled by `mean_error`."""
        return self.mean_error**2 * self.solved.star_cofactors

    @property
    def standardized(self) -> Floats:
        """(m, 2) residuals over their mean errors."""
        return self.solved.standardized / (self.mean_error or math.nan)

    @property
    def star_standardized(self) -> Floats:
        """(S, 2) residuals of the catalogue places over their mean errors."""
        return self.solved.star_standardized / (self.mean_error or math.nan)

    def ellipses(self) -> list[Ellipse]:
        """Return the mean error ellipse of every star."""
        pairs = zip(self.star_covariances, self.solved.places, strict=True)
        return [ellipse(covariance, place[1]) for covariance, place in pairs]

    def directions(self) -> list[Direction]:
        """Return the unknown directions with their error ellipses."""
        unknown = np.flatnonzero(~self.problem.known)
        if not unknown.size:
            return []
        core = self.problem.core(self.solved.parameters, self.solved.places, ~self.solved.free)
        of_images = core.directions()
        order = np.argsort(self.problem.image_stars, kind="stable")
        firsts, ends = (np.searchsorted(self.problem.image_stars[order], unknown, side) for side in _SIDES)
        return [
            self._direction(int(star), order[first:end], of_images)
            for star, first, end in zip(unknown, firsts, ends, strict=True)
        ]

    def _direction(self, star: int, images: Indices, of_images: Floats) -> Direction:
        problem, solved = self.problem, self.solved
        place, unit = solved.places[star], self.mean_error
        residuals, weights = solved.residuals[images], problem.image_weights[images]
        square = float(np.einsum("mi,mij,mj->", residuals, weights, residuals))
        own = math.sqrt(square / (2 * len(images) - 2)) if len(images) > 1 else unit
        inverse = solved.star_inverse[star]
        orientation = unit**2 * (solved.star_cofactors[star] - inverse)
        total = self.star_covariances[star]
        time = problem.image_times[images[:1]]
        ((xi, eta),) = problem.site.standard_coordinates(place[None], time, solved.parameters[22:])
        return Direction(
            star=problem.star_ids[star],
            place=(float(place[0]), float(place[1])),
            correction=(
                math.remainder(place[0] - of_images[images[0], 0], math.tau),
                float(place[1] - of_images[images[0], 1]),
            ),
            azimuth=math.atan2(-eta, -xi) % math.tau,
            elevation=math.atan2(1.0, math.hypot(xi, eta)),
            mean_errors=(
                math.sqrt(total[0, 0]) * math.cos(place[1]),
                math.sqrt(total[1, 1]),
            ),
            image_mean_error=own,
            orientation=ellipse(orientation, place[1]),
            total=ellipse(total, place[1]),
            published=ellipse(orientation + own**2 * inverse, place[1]),
        )

    def document(self) -> Document:
        """Return the document: verdict, parameters, stars, images, curves, movement."""
        from photogram.stellar.document import plate_document

        return plate_document(self)

    def _findings(self) -> Findings:
        from photogram.stellar.findings import plate_findings

        return plate_findings(self)

    def correlated(self) -> list[tuple[str, str, float]]:
        """Name pairs of parameters whose correlation exceeds 0.95."""
        return correlated(NAMES, self.covariance)

    def significance(self) -> dict[str, float]:
        """Return each estimated distortion coefficient over its mean error."""
        rows = [INDEX[name] for name in DISTORTION if self.solved.free[INDEX[name]]]
        names = [NAMES[row] for row in rows]
        return significance(names, self.solved.parameters[rows], self.covariance[np.ix_(rows, rows)])

    def doubtful(self) -> list[str]:
        """Name what the stars hardly determine: correlations, distortion terms that are not significant."""
        found = [f"correlation of {a} and {b}: {r:+.4f}" for a, b, r in self.correlated()]
        weak = [f"{name} ({t:.1f} mean errors)" for name, t in self.significance().items() if t < SIGNIFICANT]
        return found + ([f"distortion terms that are not significant: {', '.join(weak)}"] if weak else [])
