"""Results of self-calibrations: tests and correlations of camera parameters, and their tables.

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
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass
from photogram.results.covariance import Covariances, photo_components
from photogram.results.distortion import (
    INTERIOR,
    DistortionCurve,
    distortion_curve,
    lens_field,
    observed_rows,
)
from photogram.results.model_tests import LEVEL, TermsTest, groups_of_terms, joint_test, terms_test
from photogram.results.network_tables import image_axes
from photogram.results.parts import AdjustedCamera
from photogram.show.page import Drawing, Fact, Facts, Layers, Part, Remarks, Section, about, significant
from photogram.show.quantity import Axis, Quantity, Table, component, for_people, members, of_each, records

if TYPE_CHECKING:
    from photogram import Result

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
    groups: tuple[TermsTest, ...]
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
        # The least significant term; radial terms in order of decreasing power.
        lens = [test for test in parameters if test.is_lens]
        held_up = [test.name for test in lens if re.fullmatch(r"[Kk]\d", test.name)][:-1]
        candidates = [test for test in lens if not test.significant and test.name not in held_up]
        removable = max(candidates, key=lambda test: test.probability, default=None)
        names, table = each.names, each.correlations
        every = (
            Correlation(names[i], names[j], float(table[i, j])) for i, j in combinations(each.estimated, 2)
        )
        pairs = [pair for pair in every if abs(pair.coefficient) > CORRELATED]
        found.append(
            Calibration(
                camera=each,
                parameters=parameters,
                groups=tuple(joint_test(result, each, names) for names in _families(each)),
                correlations=tuple(sorted(pairs, key=lambda pair: -abs(pair.coefficient))),
                poses=() if covariances is None or number >= ASKED else _poses(result, each, covariances),
                terms=tuple(terms_test(result, names, camera=each.name) for names in groups_of_terms(each)),
                removable=None if removable is None else removable.name,
            )
        )
    return found


def _parameter(result: Result, camera: AdjustedCamera, k: int) -> ParameterTest:
    name, given = camera.names[k], float(camera.given.values[k])
    value, sd = float(camera.values[k]), float(camera.sd[k])
    reference = given if name in INTERIOR else 0.0
    t = (value - reference) / sd if sd > 0 else math.nan
    freedom, given_sd = result.freedom_of_scale, float(camera.given.deviations[k])
    probability = math.erfc(abs(t) / math.sqrt(2)) if math.isinf(freedom) else _photocore.student(t, freedom)
    own, redundancy = camera.information[k] * camera.cofactors[k, k], float(camera.redundancy[k])
    correlation = math.sqrt(max(0.0, 1.0 - 1.0 / own)) if own > 0 else math.nan
    gain, unit = t * t * result.covariance_scale, camera.camera.unit_of(name)
    numbers = value, sd, given, given_sd, t, probability, correlation, redundancy, gain
    return ParameterTest(name, unit, *numbers)


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


def _poses(result: Result, camera: AdjustedCamera, covariances: Covariances) -> tuple[PoseCorrelation, ...]:
    rows = camera.estimated
    found = covariances.covariance(("camera", camera.name), ("photo", None))[rows]
    with np.errstate(invalid="ignore", divide="ignore"):
        table = np.abs(found / np.outer(camera.sd[rows], result.photo_sd.ravel()))
    table = table.reshape(len(rows), -1, 6)
    pairs = []
    for row, k in zip(table, rows, strict=True):
        for column, name in enumerate(photo_components(result.block)):
            order = np.argsort(-np.nan_to_num(row[:, column]), kind="stable")
            above = order[np.nan_to_num(row[order, column]) > CORRELATED]
            if above.size:
                photos = tuple(result.block.photo_ids[photo] for photo in above.tolist())
                largest = float(row[above[0], column])
                pairs.append(PoseCorrelation(camera.names[k], name, photos, largest))
    return tuple(sorted(pairs, key=lambda pair: -pair.coefficient))


LISTED = 12  # Number of cameras with individual tables
RADII = 9  # Rows of a distortion curve


def cameras_section(result: Result, drawings: Sequence[Drawing]) -> Section:
    found = result._calibrations
    shown, note = found[:LISTED], about("cameras.others")
    law = "Student" if result.unit_variance != "unity" and result.variance_of_unit_weight else "normal"
    tables = [parameters_table(each, law) for each in shown]
    groups = [group for each in shown for group in each.groups]
    parts: list[Part] = [Layers("camera-layers", tables), _terms_together(groups)]
    curves = [
        _curve_table(each.camera.name, curve, str(each.camera.camera.unit))
        for each in shown
        if (curve := distortion_curve(result, each.camera)) is not None
    ]
    parts += [*drawings, Layers("curve-layers", curves)]
    remarks = [
        about("cameras.remark", camera=each.camera.name, sentence=sentence)
        for each in shown
        for sentence in (
            *(about("correlated", **vars(pair)) for pair in each.correlations),
            *(about("correlated.pose", **vars(pair)) for pair in each.poses),
            *_field_remarks(result, each),
            *each.remarks(),
        )
    ]
    held = [each for each in result.cameras if each.given.is_held]
    facts = [
        Fact(
            f"{each.name}: {each.camera.model}",
            ", ".join(
                f"{name} {significant(value, 8)}"
                for name, value in each.camera.parameters.items()
                if value != 0
            ),
            each.camera.unit or "",
            about("camera.used", photos=each.photos, images=each.images),
        )
        for each in held[:LISTED]
    ]
    if len(held) > LISTED:
        facts.append(Fact.of("Not shown here", len(held) - LISTED, note=note))
    more = [Fact.of("Not shown here", len(found) - LISTED, note=note)] if len(found) > LISTED else []
    parts += [Remarks(remarks), Facts("Cameras that are held", facts), Facts("More cameras", more)]
    return Section("cameras", "Cameras", parts, about("cameras") if found else "")


def parameters_table(found: Calibration, law: str = "") -> Table:
    every, camera = found.parameters, found.camera
    axes, of = tuple(Axis.of(each.name, each.unit) for each in every), np.arange(len(every))
    names = replace(component(axes, of)[0], head="Parameter")
    alike: dict[str, Any] = {"axes": axes, "of": of}
    free = {math.inf: "free"}
    weighted = np.array([0 < each.given_sd < math.inf for each in every], dtype=bool)
    columns = [
        of_each(every, "name", member="name", kind="name"),
        of_each(every, "unit", kind="name"),
        names,
        of_each(every, "given", kind="value", member="", head="Given", **alike),
        of_each(every, "given_sd", kind="deviation", member="", head="sd given", words=free, **alike),
        of_each(every, "value", kind="value", head="Adjusted", **alike),
        of_each(every, "sd", kind="deviation", head="sd adjusted", **alike),
        of_each(every, "change", kind="difference", head="Change", **alike),
        of_each(every, "test_value", head=f"t {law}".strip(), decimals=2),
        of_each(every, "probability", head="p", figures=2),
        of_each(every, "significant"),
        of_each(every, "multiple_correlation", head="R with all others", decimals=4),
        of_each(every, "from_prior"),
        of_each(every, "redundancy", member="", head="Redundancy", decimals=3, seen=weighted),
        of_each(every, "gain", head="Gain"),
        Quantity(
            [outcome(each) for each in every],
            kind="name",
            head="Outcome",
            marked=np.array([not each.separable or each.contradicts for each in every], dtype=bool),
        ),
    ]
    lens = {"model": camera.camera.model, "direction": camera.camera.direction}
    note = about("camera", **lens, photos=camera.photos, images=camera.images)
    deviations = np.array([each.sd for each in every])
    return Table(f"parameters-{camera.name}", camera.name, columns, note, "", deviations)


def outcome(each: ParameterTest) -> str:
    code = "not-" * (not each.significant) + ("significant" if each.is_lens else "different")
    holds = {code: True, "not-separable": not each.separable, "from-prior": each.from_prior}
    return ", ".join(about(f"outcome.{code}") for code in holds if holds[code])


def _terms_together(groups: Sequence[TermsTest]) -> Table:
    columns = [
        of_each(groups, "camera", kind="name", head="Camera"),
        Quantity([", ".join(each.names) for each in groups], kind="name", head="Terms together"),
        of_each(groups, "test_value", head="F", decimals=2),
        of_each(groups, "probability", head="p", figures=2),
        of_each(groups, "outcome", kind="name", head="Outcome"),
    ]
    return Table("camera-groups", "Terms of the lens tested together", for_people(columns))


def _curve_table(camera: str, curve: DistortionCurve, unit: str) -> Table:
    axes = (replace(image_axes(unit)[0], name=""),)
    rows = observed_rows(curve, RADII)
    added = "measured" if curve.direction == "backward" else "ideal"
    column: Any = partial(Quantity, axes=axes, kind="deviation", decimals=3)
    columns = [
        Quantity(curve.radii, (Axis.of("", unit),), "deviation", head="Radius", decimals=4),
        column(curve.values, head="Distortion"),
        column(curve.sd, head="sd"),
        column(curve.sd_mapping, head="sd of the mapping"),
        column(curve.balanced, head="Balanced"),
        column(curve.sd_balanced, head="sd of balanced"),
    ]
    sizes = {"observed": curve.observed, "zero": curve.balanced_at, "distance": curve.balanced_distance}
    note = about("curve", added=added, unit=unit, **sizes)
    return Table(f"distortion-{camera}", f"Radial distortion of {camera}", columns, note, shown=rows)


def _field_remarks(result: Result, found: Calibration) -> list[str]:
    field, unit = lens_field(result, found.camera), str(found.camera.camera.unit)
    if field is None:
        return []
    axis, at = image_axes(unit)[0], field.largest
    numbers = *field.vectors[at], *np.sqrt(np.diag(field.covariances[at]))
    sizes = dict(zip(("dx", "dy", "sx", "sy"), np.multiply(axis.factor, numbers), strict=True))
    place = dict(zip("xy", field.positions[at], strict=True))
    return [about("field", names=list(field.names), **place, unit=unit, **sizes, small=axis.small)]


def calibration_member(result: Result, found: Calibration) -> dict[str, Any]:
    curve, field = distortion_curve(result, found.camera), lens_field(result, found.camera)
    of_curve = ("direction", "balanced_at", "balanced_distance", "sd", "balanced")
    return {
        "camera": found.camera.name,
        "parameters": records(parameters_table(found).columns),
        "groups": [
            members(each, "names", "test_value", "probability", "significant") for each in found.groups
        ],
        "correlations": [vars(each) for each in found.correlations],
        "pose_correlations": [vars(each) for each in found.poses],
        "terms": [
            members(each, "names", "statistic", "probability", "worth_keeping", largest_effect_sd="effect")
            for each in found.terms
        ],
        "removable": found.removable,
        "remarks": found.remarks(),
        "distortion": curve
        and members(curve, *of_curve, radius="radii", distortion="values", balanced_sd="sd_balanced")
        | members(curve, observed_radius="observed", sd_of_mapping="sd_mapping"),
        "field": field
        and members(field, terms="names", position="positions", vector="vectors", covariance="covariances"),
    }
