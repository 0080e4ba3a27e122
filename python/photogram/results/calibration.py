"""Results of self-calibrations: tests and correlations of camera parameters.

A parameter p with cofactor q has the standard deviation s = sigma0 sqrt(q). Its test value is t = (p - p_ref)
/ s. Its distribution is Student's with the degrees of freedom of the adjustment, or normal if the unit weight
is known a priori. p_ref is 0 for distortion terms and the given value for focal length and principal point.
R^2 = 1 - 1 / (n q) is the squared multiple correlation with all other unknowns; n is the diagonal of the
normal equations. For a group of g terms, p' Q^-1 p / (g sigma0^2) has Fisher's F distribution with g and
these degrees of freedom.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass
from photogram.results.cameras import AdjustedCamera
from photogram.results.covariance import Covariances, photo_components
from photogram.results.distortion import INTERIOR
from photogram.results.model_tests import TermsTest, groups_of_terms, tail_probability, terms_test
from photogram.results.scores import quadratic
from photogram.show.page import about

if TYPE_CHECKING:
    from photogram import Result

LEVEL = 0.05  # Significance level of terms
CORRELATED = 0.95  # The report lists larger correlations
ASKED = 20  # Largest number of cameras with correlations to the poses of photos
INSEPARABLE = 0.9999  # Largest R^2 of a parameter that is separable from the others
FROM_PRIOR = 0.05  # With a lower redundancy number the weight determines the parameter, not the images
FAR = 5.0  # Change of a weighted parameter that contradicts it (a priori sd)


@dataclass(frozen=True)
class ParameterTest:
    # Name and unit; empty for plain numbers
    name: str
    unit: str
    # Adjusted value and its standard deviation
    value: float
    sd: float
    # Initial or observed value; its standard deviation, infinite if free
    given: float
    given_sd: float
    test_value: float  # (value - reference) / sd
    probability: float  # Probability of a larger test value under the null hypothesis
    multiple_correlation: float  # R with all other unknowns, 0 to 1
    redundancy: float  # Redundancy number of its weight; 0 without a weight
    gain: float  # Increase of the weighted sum of squares without the parameter (first order)

    @property
    def change(self) -> float:
        """Adjusted minus given value."""
        return self.value - self.given

    @property
    def significant(self) -> bool:
        """Whether it differs from its reference at the 5 percent level."""
        return self.probability < LEVEL

    @property
    def separable(self) -> bool:
        """Whether the observations separate it from the other unknowns."""
        return not self.multiple_correlation**2 > INSEPARABLE

    @property
    def from_prior(self) -> bool:
        """Whether its weight determines it, and not the images."""
        return 0 < self.given_sd < math.inf and self.redundancy < FROM_PRIOR

    @property
    def contradicts(self) -> bool:
        """Whether the images contradict its weight."""
        return 0 < self.given_sd < math.inf and abs(self.change) > FAR * self.given_sd

    @property
    def is_lens(self) -> bool:
        """Whether it is a distortion term, not the principal point or distance."""
        return self.name not in INTERIOR


@dataclass(frozen=True)
class GroupTest:
    """Distortion terms that are tested together."""

    names: tuple[str, ...]  # The parameters
    test_value: float  # p' Q^-1 p / (g sigma0^2)
    probability: float  # Probability of a larger test value if all terms are zero

    @property
    def significant(self) -> bool:
        """Whether the terms differ from zero at the 5 percent level."""
        return self.probability < LEVEL

    @property
    def outcome(self) -> str:
        return "significant" if self.significant else "not significant"


@dataclass(frozen=True)
class Correlation:
    first: str
    second: str
    coefficient: float


@dataclass(frozen=True)
class PoseCorrelation:
    """A parameter that is correlated with one component of photo poses."""

    # Names of the parameter and of the pose component: a coordinate, omega, phi or kappa
    parameter: str
    component: str
    photos: tuple[str, ...]  # Photos with correlations above 0.95, the largest first
    coefficient: float  # The largest coefficient


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated camera.

    Attributes
    ----------
    camera
        The adjusted camera.
    parameters
        Tests of its estimated parameters.
    groups
        Joint tests of families of terms.
    correlations
        Correlations of parameter pairs above 0.95, largest first.
    poses
        Correlations above 0.95 with positions and attitudes of photos, by parameter and component.
    terms
        Terms that are used together, tested at 1 percent, with their effect on images.
    removable
        The term that may be omitted: the least significant independent term; None if all are required. Only
        one term, because its removal changes the tests of the others.
    """

    camera: AdjustedCamera
    parameters: tuple[ParameterTest, ...]
    groups: tuple[GroupTest, ...]
    correlations: tuple[Correlation, ...]
    poses: tuple[PoseCorrelation, ...]
    terms: tuple[TermsTest, ...]
    removable: str | None

    def remarks(self) -> list[str]:
        """Return warnings about the calibration, as sentences."""
        said = []
        for each in self.parameters:
            own = {"name": each.name, "r": each.multiple_correlation, "redundancy": each.redundancy}
            own["size"] = abs(each.change) / each.given_sd if each.contradicts else 0.0
            holds = {"inseparable": not each.separable, "prior": each.from_prior, "moved": each.contradicts}
            said += [about(f"parameter.{code}", **own) for code in holds if holds[code]]
        for code, kept in (("kept", True), ("others", False)):
            names = [
                about(f"term.{code}", names=each.names, p=each.probability, effect=each.effect)
                for each in self.terms
                if each.worth_keeping == kept
            ]
            said += [about(f"terms.{code}", names=names)] if names else []
        return [*said, about("terms.removable", term=self.removable)] if self.removable else said


def calibrations(result: Result) -> list[Calibration]:
    """Return the calibrations of cameras with unknown parameters, if covariances exist.

    Correlations with photo poses require a factorization of the normal equations and a solution for each
    parameter. They are computed for the first 20 cameras, and not for blocks that were adjusted in parts.
    """
    cameras = [each for each in result.cameras if each.estimated and np.isfinite(each.cofactors).all()]
    covariances = result.covariances() if cameras and result.WHOLE else None
    found = []
    for number, each in enumerate(cameras):
        parameters = tuple(_parameter(result, each, k) for k in each.estimated)
        found.append(
            Calibration(
                camera=each,
                parameters=parameters,
                groups=tuple(_group(result, each, names) for names in _families(each)),
                correlations=_correlations(each),
                poses=() if covariances is None or number >= ASKED else _poses(result, each, covariances),
                terms=tuple(terms_test(result, names, camera=each.name) for names in groups_of_terms(each)),
                removable=_removable(parameters),
            )
        )
    return found


def _parameter(result: Result, camera: AdjustedCamera, k: int) -> ParameterTest:
    name, given = camera.names[k], float(camera.given.values[k])
    value, sd = float(camera.values[k]), float(camera.sd[k])
    reference = given if name in INTERIOR else 0.0
    t = (value - reference) / sd if sd > 0 else math.nan
    freedom = result.freedom_of_scale
    probability = math.erfc(abs(t) / math.sqrt(2)) if math.isinf(freedom) else _photocore.student(t, freedom)
    own = camera.information[k] * camera.cofactors[k, k]
    return ParameterTest(
        name=name,
        unit=camera.camera.unit_of(name),
        value=value,
        sd=sd,
        given=given,
        given_sd=float(camera.given.deviations[k]),
        test_value=t,
        probability=probability,
        multiple_correlation=math.sqrt(max(0.0, 1.0 - 1.0 / own)) if own > 0 else math.nan,
        redundancy=float(camera.redundancy[k]),
        gain=t * t * result.covariance_scale,
    )


def _group(result: Result, camera: AdjustedCamera, names: tuple[str, ...]) -> GroupTest:
    rows = [camera.names.index(name) for name in names]
    value, k = quadratic(camera.covariance[np.ix_(rows, rows)], camera.values[rows]), len(rows)
    return GroupTest(names, value / k, tail_probability(value, k, result.freedom_of_scale))


def _families(camera: AdjustedCamera) -> list[tuple[str, ...]]:
    """Return groups of terms: by letter, radial also without the first, Gruen's by degree."""
    by_family: dict[str, list[str]] = {}
    for k in camera.estimated:
        name = camera.names[k]
        found = re.fullmatch(r"([A-Za-z]+)_?(\d+)", name)
        if name in INTERIOR or found is None:
            continue
        letter, number = found.groups()
        degree = "" if len(number) < 2 or letter == "e" else f" {sum(map(int, number)) - 2}"
        by_family.setdefault("degree" + degree if degree else letter, []).append(name)
    families = [tuple(names) for names in by_family.values() if len(names) > 1]
    radial = [tuple(names[1:]) for letter, names in by_family.items() if letter in "Kk" and len(names) > 2]
    return families + radial


def _correlations(camera: AdjustedCamera) -> tuple[Correlation, ...]:
    table, rows = camera.correlations, camera.estimated
    pairs = [
        Correlation(camera.names[i], camera.names[j], float(table[i, j]))
        for place, i in enumerate(rows)
        for j in rows[place + 1 :]
        if abs(table[i, j]) > CORRELATED
    ]
    return tuple(sorted(pairs, key=lambda pair: -abs(pair.coefficient)))


def _poses(result: Result, camera: AdjustedCamera, covariances: Covariances) -> tuple[PoseCorrelation, ...]:
    rows = camera.estimated
    found = covariances.covariance(("camera", camera.name), ("photo", None))[rows]
    with np.errstate(invalid="ignore", divide="ignore"):
        table = np.abs(found / np.outer(camera.sd[rows], result.photo_sd.ravel()))
    table = table.reshape(len(rows), -1, 6)
    pairs = []
    for row, k in zip(table, rows, strict=True):
        for column, component in enumerate(photo_components(result.block)):
            order = np.argsort(-np.nan_to_num(row[:, column]), kind="stable")
            above = order[np.nan_to_num(row[order, column]) > CORRELATED]
            if above.size:
                photos = tuple(result.block.photo_ids[photo] for photo in above.tolist())
                largest = float(row[above[0], column])
                pairs.append(PoseCorrelation(camera.names[k], component, photos, largest))
    return tuple(sorted(pairs, key=lambda pair: -pair.coefficient))


def _removable(parameters: tuple[ParameterTest, ...]) -> str | None:
    """Return the least significant term; radial terms in order of decreasing power."""
    lens = [each for each in parameters if each.is_lens]
    radial = [each.name for each in lens if re.fullmatch(r"[Kk]\d", each.name)]
    held_up = set(radial[:-1])
    candidates = [each for each in lens if not each.significant and each.name not in held_up]
    return max(candidates, key=lambda each: each.probability).name if candidates else None
