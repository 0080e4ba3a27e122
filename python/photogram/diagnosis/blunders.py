"""Blunders that snooping has taken out, as findings: what does not fit, by how much, and what may as well."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.adjusting import LEAST_GIVEN
from photogram.diagnosis.findings import Finding, Level, Listing, Section, small_unit
from photogram.diagnosis.robust import critical, mad_sd
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.results.result import Result
from photogram.results.snooping_result import Snooped
from photogram.results.suspects import observations_of_core
from photogram.show.angles import ARCSEC
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.snooping.log import Removal

BLUNDER = 3.0
TWENTIETH = 1.96
SURE = 1e-4
"""Chance that the largest test value of a good block is beyond what is grave."""
SHOWN = 20
BESIDE = "beside images: "
"""Before the names of further kinds of observations."""


def blunder_section() -> Section:
    """Return the blunder list without entries."""
    return Section(
        "Blunders (adjustment, 3-sigma rule)",
        "A residual beyond three of its standard deviations is suspect; what is taken out is named below.",
    )


def tests(result: Result) -> dict[str, Floats]:
    """Test values by kind, in standard deviations of the residuals; 0 where nothing checks."""
    images = np.where(result.redundancy > TESTABLE, np.abs(result.standardized), 0.0)
    others = {
        "control": (result.point_redundancy, result.point_standardized),
        "station": (result.photo_redundancy, result.photo_standardized),
        **{f"{BESIDE}{name}": (each.redundancy, each.standardized) for name, each in result.kinds.items()},
    }
    return {
        "image": np.nan_to_num(images),
        **{
            name: np.where(redundancy > LEAST_GIVEN, np.nan_to_num(np.abs(values)), 0.0)
            for name, (redundancy, values) in others.items()
        },
    }


@dataclass(frozen=True)
class Blunders:
    """What snooping has taken out of a block, in the words of a check.

    Attributes
    ----------
    findings
        On images, photos, stations and observations beside images.
    control
        On components of control, by point.
    """

    findings: list[Finding]
    control: dict[str, list[Finding]]


def blunders(found: Snooped, block: Block, last: Result) -> Blunders:
    """Return the log of snooping as findings, grave where a test value is beyond what good blocks have.

    Parameters
    ----------
    found
        What snooping has made of the block.
    block
        The block with what was taken out.
    last
        Its adjustment without.
    """
    told = _Told(found, block, last)
    findings: list[Finding] = []
    control: dict[str, list[Finding]] = {}
    for each in found.exchanged:
        text = f"{each.sentence}: {each.reason}"
        findings.append(Finding("exchanged-points", "grave", text, list(each.photos), list(each.points)))
    paired = {(photo, point) for each in found.exchanged for photo in each.photos for point in each.points}
    for entry in found.removed:
        if entry.kind == "control":
            name, own = told.control(entry)
            control.setdefault(name, []).extend(own)
        elif entry.kind != "image" or told.image_names(entry.group) not in paired:
            findings.append(told.finding(entry))
    return Blunders(findings, control)


class _Told:
    """Says what was taken out."""

    def __init__(self, found: Snooped, block: Block, last: Result) -> None:
        self.suspects, self.block = found.suspects, block
        count = sum(int((each > 0).sum()) for each in tests(last).values())
        self.limit = critical(count, SURE) * max(mad_sd(last.standardized), _tail(last))

    def finding(self, entry: Removal) -> Finding:
        """Return the finding on anything but control."""
        if entry.kind == "image":
            return self._image(entry)
        if entry.kind == "photo":
            return self._photo(entry)
        if entry.kind in ("position", "attitude"):
            return self._station(entry)
        return self._observation(entry)

    def image_names(self, group: int) -> tuple[str, str]:
        """Return the photo and the point of an image."""
        block, row = self.block, self._subject(group)
        return block.photo_ids[block.image_photos[row]], block.point_ids[block.image_points[row]]

    def control(self, entry: Removal) -> tuple[str, list[Finding]]:
        """Return the point, and a finding on each component that is wrong by more than its uncertainty."""
        row = self._subject(entry.group)
        name, rivals = self.block.point_ids[row], self._rivals(entry, "control")
        components = ("longitude", "latitude", "height") if self.block.geographic else ("X", "Y", "Z")
        names = [self.block.point_ids[self._subject(group)] for group in rivals]
        doubt = f"; it may as well be control point {' or '.join(names)}" if names else ""
        level = self._level(entry)
        findings = []
        for place in _large(entry):
            axis = components.index(entry.components[place])
            own = control_finding(self.block, row, axis, _errors(entry)[place], math.sqrt(entry.statistic))
            findings.append(replace(own, level=level, text=f"{own.text}{doubt}", points=[name, *names]))
        return name, findings

    def _subject(self, group: int) -> int:
        return int(self.suspects.subjects[group])

    def _level(self, entry: Removal) -> Level:
        return "grave" if math.sqrt(entry.statistic) > self.limit else "look"

    def _rivals(self, entry: Removal, kind: str) -> list[int]:
        """Return groups of a kind that may hold the error instead."""
        return [each.group for each in entry.rivals if self.suspects.kind(each.group) == kind]

    def _image(self, entry: Removal) -> Finding:
        photo, point = self.image_names(entry.group)
        others, doubt = self._other_rays(entry, point)
        place = _large(entry)[0]
        axis, unit, factor = entry.components[place], *small_unit(self.block.image_unit)
        error, test = factor * _errors(entry)[place], math.sqrt(entry.statistic)
        text = (
            f"point {point} on photo {photo}: error of {axis} about {error:.{0 if unit == 'um' else 2}f}"
            f" {unit} (test value {test:.1f}, redundancy {entry.redundancy:.2f}){doubt}"
        )
        values = {f"error_{unit}": error, "test_value": test, "redundancy": entry.redundancy}
        values["axis"] = float("xy".index(axis))
        return Finding("blunder", self._level(entry), text, [photo, *others], [point], values)

    def _other_rays(self, entry: Removal, point: str) -> tuple[list[str], str]:
        """Return the photos whose image of a point may as well be wrong, and say so."""
        block, row = self.block, self._subject(entry.group)
        photos = block.image_photos[block.image_points == block.image_points[row]]
        if len(photos) == 2:
            (other,) = photos[photos != block.image_photos[row]].tolist() or [int(photos[0])]
            name = block.photo_ids[other]
            return [name], f"; with two rays it may as well be the image on photo {name}"
        rivals = [self.image_names(group) for group in self._rivals(entry, "image")]
        names = [photo for photo, of in rivals if of == point]
        return names, f"; it may as well be the image on photo {' or '.join(names)}" if names else ""

    def _photo(self, entry: Removal) -> Finding:
        photo = self.block.photo_ids[int(self.suspects.photos[entry.group])]
        text = f"photo {photo} does not fit the others: {entry.consequences[0]}"
        return Finding("bad-photo", "grave", text, [photo], [], {})

    def _station(self, entry: Removal) -> Finding:
        name, test = self.block.photo_ids[self._subject(entry.group)], math.sqrt(entry.statistic)
        what = " and ".join(entry.components)
        text = f"{what} of station {name} contradicts its standard deviation (test value {test:.1f})"
        return Finding("station-misfit", self._level(entry), text, [name], [], {"test_value": test})

    def _observation(self, entry: Removal) -> Finding:
        """Say that an observation beside images does not fit."""
        place, test = _large(entry)[0], math.sqrt(entry.statistic)
        error, unit = _errors(entry)[place], entry.units[place]
        if unit == "rad":
            error, unit = error / ARCSEC, "arcsec"
        name = f"{entry.components[place]} of {self.suspects.name(entry.group)}"
        text = (
            f"{name} does not fit (test value {test:.1f}, redundancy {entry.redundancy:.2f}):"
            f" its error is about {error:.4g} {unit}".rstrip()
        )
        values = {"test_value": test, "redundancy": entry.redundancy, f"error_{unit}".rstrip("_"): error}
        observation = observations_of_core(self.block)[self._subject(entry.group)]
        photos, points = list(observation.photos), list(observation.points)
        return Finding("observation-misfit", self._level(entry), text, photos, points, values)


def _large(entry: Removal) -> list[int]:
    """Return the components whose errors are beyond three standard deviations, the largest first."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sizes = np.nan_to_num(np.abs(np.array(entry.error)) / np.array(entry.error_sd), nan=0.0)
    order = np.argsort(-sizes, kind="stable").tolist()
    return [order[0], *(place for place in order[1:] if sizes[place] > BLUNDER)]


def _errors(entry: Removal) -> list[float]:
    """Return the errors by component: observed minus what the rest predicts, else as they were estimated."""
    predicted = entry.prediction_error or (math.nan,) * len(entry.error)
    return [own if math.isnan(new) else new for own, new in zip(entry.error, predicted, strict=True)]


def control_finding(block: Block, row: int, axis: int, error: float, test: float) -> Finding:
    """Say that a component of control does not fit; `error` is that of the given value."""
    angle = block.geographic and axis < 2
    unit, error = ("arcsec", float(np.degrees(error)) * 3600) if angle else (block.linear_unit, error)
    component = (("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z"))[axis]
    name = block.point_ids[row]
    text = (
        f"{component} of control point {name} does not fit (test value {test:.1f}):"
        f" its error is about {error:.3f} {unit}"
    )
    values = {"component": float(axis), "test_value": test, f"error_{unit}": error}
    return Finding("control-misfit", "look", text, [], [name], values)


def _tail(result: Result) -> float:
    """Return the spread of test values by their tail, where it is heavier: one in twenty is beyond 1.96."""
    images = tests(result)["image"]
    images = images[images > 0]
    return float(np.quantile(images, 0.95)) / TWENTIETH if images.size else 0.0


def list_largest(result: Result, spread: float, section: Section) -> None:
    """Say how many test values are beyond 3 when all is done, and list the largest."""
    values = tests(result)["image"] / spread
    tested = int((values > 0).sum())
    images, axes = np.nonzero(values > BLUNDER)
    section.figure("robust spread of the test values", f"{spread:.3f} (1 when the weights are right)")
    section.figure(
        f"image coordinates beyond {BLUNDER:g} times the spread",
        f"{len(images)} of {tested} tested ({0.0027 * tested:.0f} to be expected)",
    )
    if not len(images):
        return
    block = result.block
    unit, factor = small_unit(block.image_unit)
    section.parts.append("the largest that are left, each with the error that would explain it:")
    listed: list[tuple[str | float, ...]] = []
    for row in np.argsort(-values[images, axes], kind="stable")[:SHOWN].tolist():
        i, axis = int(images[row]), int(axes[row])
        residual, redundancy = factor * result.residuals[i, axis], result.redundancy[i, axis]
        names = block.photo_ids[block.image_photos[i]], block.point_ids[block.image_points[i]]
        figures = residual, redundancy, values[i, axis], residual / redundancy
        listed.append((*names, "xy"[axis], *map(float, figures)))
    columns = (
        ("photo", "<10"),
        ("point", "<10"),
        ("", "^3"),
        (f"residual {unit}", ">12.1f"),
        ("redundancy", ">12.3f"),
        ("test value", ">12.2f"),
        (f"error {unit}", ">12.1f"),
    )
    section.parts.append(Listing(columns, listed))
