"""Assessment of a calibration: cross-validation, uncertainty maps, suggested views.

Cross-validation adjusts subsets a and b of the views separately from the values of the whole. With the
weights P of common information, priors and the nominal points of the board,

    cov(k_b - k_a) = Q_a + Q_b - Q_a P Q_b - Q_b P Q_a

for all common unknowns. Unmodelled lens distortion, deformed boards and moving views increase the
differences, while the residuals of each subset may be unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import adjust, adjusted
from photogram.arguments.arrays import argument_error, whole_number
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError, RankError, message_of
from photogram.lazy_dataclasses import dataclass, field
from photogram.summaries import Brief, Rows
from photogram.targets.calibration_difference import (
    MIN_PROBABILITY,
    CameraDifference,
    DifferenceTest,
    squares_of,
)
from photogram.targets.housing import (
    Housing,
    camera_number,
    common_partials,
    datum_rows,
    housed_with,
    housing_of,
)
from photogram.targets.new_views import Suggestions, suggest_views
from photogram.targets.options import Into, WorthOptions
from photogram.targets.uncertainty import UncertaintyMap, at_distance, uncertainty_map
from photogram.targets.vision import unknown_of, values_of
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.adjustment.robust import Loss
    from photogram.targets import Calibrated


RANK_TOLERANCE = 1e-6  # smaller relative cofactors of a change are due to the common priors


@dataclass(frozen=True, eq=False)
class CrossMap:
    differences: Floats  # (n, 2) projections by part b minus part a, pixels, in the datum of the whole
    covariances: Floats  # (n, 2, 2) expected covariances of the differences

    @property
    def chi2(self) -> Floats:
        """(n,) d' cov(d)^-1 d with two degrees of freedom."""
        return squares_of(self.differences, self.covariances)


def splits(views: int, into: str | int) -> list[tuple[list[int], list[int]]]:
    """Return pairs of view subsets for `odd`, `halves` or K subsets."""
    numbers = list(range(views))
    if into == "odd":
        return [(numbers[::2], numbers[1::2])]
    if into == "halves":
        return [(numbers[: views // 2], numbers[views // 2 :])]
    count = whole_number("into", into)
    folds = [numbers[k::count] for k in range(count)]
    return [(sorted(set(numbers) - set(fold)), fold) for fold in folds]


def changes_between(a: Housing, b: Housing) -> tuple[Floats, Floats]:
    """Return (c,) changes from a to b without the board, and their (c, c) cofactors."""
    found = np.zeros(a.common)
    for number, (first, second) in enumerate(zip(a.cameras, b.cameras, strict=True)):
        found[a.parameters(number)] = (values_of(second) - values_of(first))[unknown_of(first)]
        if number:
            turn = b.sensors[number, :3, :3] @ a.sensors[number, :3, :3].T
            moved = b.sensors[number, :3, 3] - a.sensors[number, :3, 3]
            found[a.sensor(number)] = np.concatenate(
                [moved, _photocore.rotation_vectors(turn[np.newaxis])[0]]
            )
    common = slice(0, a.common)
    own, other = a.cofactors[common, common], b.cofactors[common, common]
    shared = own @ a.weights @ other
    return found, own + other - shared - shared.T


def parts_agree(
    a: Housing, b: Housing, names: Sequence[str], unit: tuple[float, float] = (1.0, math.inf)
) -> list[DifferenceTest]:
    """Test the differences of each of K cameras, and of all cameras and sensors."""
    change, cofactors = changes_between(a, b)
    variance, freedom = unit
    groups = {name: a.parameters(number) for number, name in enumerate(names)}
    if len(names) > 1:
        groups["all"] = slice(0, a.board.start)
    found = []
    for name, own in groups.items():
        splined = any(each.knots is not None for each in a.cameras)
        changed, known = change[own], cofactors[own, own]
        if splined:
            # (r,) changes that corners determine, and their (r, r) cofactors
            scale = 1 / np.sqrt(np.diag(a.cofactors + b.cofactors)[own])
            values, vectors = np.linalg.eigh(known * scale[:, np.newaxis] * scale)
            kept = values > RANK_TOLERANCE
            changed, known = vectors[:, kept].T @ (scale * changed), np.diag(values[kept])
        chi2 = float(changed @ np.linalg.solve(known, changed)) / variance
        found.append(DifferenceTest.of(name, chi2, len(changed), freedom))
    return found


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CrossValidation(Brief):
    """Separately adjusted subsets of the views, and tests of their agreement.

    Attributes
    ----------
    into
        Type of split.
    cameras
        Names of the cameras of the housing.
    parts
        Views of both subsets of each split.
    tests
        For each split the tests of the cameras, and of all with their sensors if there are several.
    whole, housings
        The housing from all views, and from both subsets of each split.
    """

    into: str
    cameras: tuple[str, ...]
    parts: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]
    tests: tuple[tuple[DifferenceTest, ...], ...]
    whole: Housing
    housings: tuple[tuple[Housing, Housing], ...]

    @property
    def explained(self) -> bool:
        """Whether covariances explain the differences (all p >= 0.01 / number of splits)."""
        return min(each[-1].probability for each in self.tests) > MIN_PROBABILITY / len(self.tests)

    @property
    def factor(self) -> float:
        """Mean ratio of the differences to their standard deviations over the splits."""
        return float(np.sqrt(np.mean([each[-1].factor ** 2 for each in self.tests])))

    @property
    def verdict(self) -> str:
        """Verdict of the cross-validation on every uncertainty map."""
        probability = min(each[-1].probability for each in self.tests)
        code = f"cross.{'explained' if self.explained else 'too-small'}"
        return str(phrase(code, factor=self.factor, p=probability))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of splits and tests."""
        rows = []
        for (a, b), tests in zip(self.parts, self.tests, strict=True):
            said = [
                phrase("cross.test", name=each.name, chi2=each.chi2, dof=each.dof, p=each.probability)
                for each in tests
            ]
            views = str(phrase("cross.views", first=len(a), second=len(b)))
            rows.append((views, str(phrase("cross.tests", tests=said))))
        return "Cross-validation", [*rows, ("verdict", self.verdict)]

    def map(self, camera: int, pixels: Floats, distance: float, split: int = 0) -> CrossMap:
        """Return the projection differences between two subsets of a split.

        Parameters
        ----------
        camera
            Camera number in the housing.
        pixels, distance
            (n, 2) pixels, and distance from the camera centre; infinite: directions.
        split
            Split number.
        """
        rows = datum_rows(self.whole, camera, "corners")
        partials = common_partials(self.whole, camera, pixels, distance, rows)
        change, cofactors = changes_between(*self.housings[split])
        scaled = self.whole.variance * partials
        return CrossMap(partials @ change, scaled @ cofactors @ partials.transpose(0, 2, 1))


MIN_VIEWS_PER_PART = 3


def cross_validate(
    result: Calibrated,
    into: Into = "odd",
    camera: int | str = 0,
    *,
    progress: Callable[[str], None] | None = None,
) -> CrossValidation:
    """Adjust subsets of the views separately and test their differences.

    See docs/targets.md.

    Parameters
    ----------
    result
        The adjusted calibration.
    into
        `odd`: even against odd views. `halves`: the first half against the second. A number K: each K-th
        subset against the rest.
    camera
        Camera whose views are split if cameras are separate; any camera of a rig.
    progress
        Called with the part that is adjusted.

    Raises
    ------
    InputError
        If a subset has fewer than three views, or if the camera does not exist.
    RankError
        If the views of a subset do not determine all unknowns.
    """
    if isinstance(into, int) and into < 2:
        raise argument_error("into", "least", low=2, value=into)
    number = camera_number(result, camera)
    cameras = housed_with(result, number)
    names = tuple(result.cameras[each].name for each in cameras)
    corners = result.calibration.corners
    mine = np.isin(corners.cameras, cameras)
    views = np.unique(corners.views[mine])
    parts, tests, housings = [], [], []
    for pair in splits(len(views), into):
        if min(map(len, pair)) < MIN_VIEWS_PER_PART:
            fields = {"views": len(views), "into": into, "least": MIN_VIEWS_PER_PART}
            raise InputError(phrase("targets.few-views", **fields))
        adjusted = []
        for part in pair:
            if progress is not None:
                progress(f"cross-validation: {len(part)} of {len(views)} views")
            adjusted.append(_adjusted(result, mine & np.isin(corners.views, views[part]), cameras))
        a, b = (housing_of(each)[0] for each in adjusted)
        parts.append((tuple(views[pair[0]].tolist()), tuple(views[pair[1]].tolist())))
        sums, freedoms = zip(*(each.sum_and_freedom for each in adjusted), strict=True)
        pooled = sum(sums) / sum(freedoms), sum(freedoms)  # variance of unit weight, degrees of freedom
        tests.append(tuple(parts_agree(a, b, names, pooled)))
        housings.append((a, b))
    return CrossValidation(
        into=str(into),
        cameras=names,
        parts=tuple(parts),
        tests=tuple(tests),
        whole=housing_of(result, number)[0],
        housings=tuple(housings),
    )


def _adjusted(whole: Calibrated, pictures: Bools, cameras: list[int]) -> Calibrated:
    given, restarted, priors = whole.calibration, whole.restarted_calibration(), whole.block.cameras
    corners = given.corners.of_pictures(pictures)
    views = np.unique(given.corners.views[pictures])
    free = []  # unknown parameters are free until the first adjustment ends; the priors are added afterwards
    for camera in (whole.cameras[each].camera for each in cameras):
        unknown = [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd > 0]
        free.append(camera.replace(sd=dict.fromkeys(unknown, np.inf), covariance=None))
    part = given.replace(
        board=given.board.replace(shape=given.shape),
        corners=corners.replace(
            cameras=[cameras.index(each) for each in corners.cameras.tolist()],
            camera_names=[given.corners.camera_names[each] for each in cameras],
            sizes=[given.corners.sizes[each] for each in cameras],
        ),
        cameras=free,
        sensors=np.asarray(restarted.sensors)[cameras],
        poses=whole.poses[views],
        references=None,
        bend=restarted.bend,
        sd_sensors=np.asarray(given.sd_sensors)[cameras],
        offsets=np.asarray(given.offsets)[cameras],
        sd_offsets=np.asarray(given.sd_offsets)[cameras],
        motion=None if given.motion is None else np.asarray(given.motion)[views],
        regularise=None,
    )
    result = adjust(part.block(), loss=cast("Loss | None", whole.options.loss))
    own = [priors[each] for each in cameras]
    sd = np.concatenate([each.deviations for each in own])
    if (np.isfinite(sd) & (sd > 0)).any():
        result = adjusted(part.block(own), result.options, start=result.state)
    return type(whole).of(result, part)


DISTANCE_FIGURES = 2  # significant digits of the median board distance


def appraise(
    calibrated: Calibrated, asked: WorthOptions | None = None, progress: Callable[[str], None] | None = None
) -> Worth:
    """Assess the quality of a calibration.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    asked
        Requested assessments; None: maps and cross-validation.
    progress
        Called with the current step.

    Raises
    ------
    InputError
        If a distance is not positive.
    OutOfMemoryError, KeyboardInterrupt
        As in the adjustment.
    """
    asked = asked or WorthOptions()
    report = progress or (lambda _: None)
    remarks: list[Phrase] = []
    cross: list[CrossValidation] = []
    for number, camera in enumerate(calibrated.cameras):
        if asked.cross_validate is None or housed_with(calibrated, number)[0] != number:
            continue
        try:
            cross.append(cross_validate(calibrated, asked.cross_validate, number, progress=report))
        except (InputError, RankError) as error:
            reason = message_of(error)
            remarks.append(phrase("targets.no-cross-validation", camera=camera.name, reason=reason))
    maps: list[UncertaintyMap] = []
    for number, camera in enumerate(calibrated.cameras):
        if calibrated.calibration.corners.sizes[number] is None:
            remarks.append(phrase("targets.no-size", camera=camera.name))
            continue
        verdicts = [each.verdict for each in cross if camera.name in each.cameras]
        verdicts = verdicts or ["model not tested by cross-validation"]
        frame = phrase("test.frame", camera=camera.name)
        if any(test.kind == frame and not test.accepted for test in calibrated.verdict.tests):
            verdicts.append("residuals have a pattern over the picture: the map is optimistic")
        model = "; ".join(verdicts)
        for distance in asked.distances or (math.inf, median_distance(calibrated, number)):
            report(f"map of {camera.name} {at_distance(distance, calibrated.calibration.board.unit)}")
            how: dict[str, Any] = {"datum": asked.datum, "noise_only": asked.noise_only, "model": model}
            maps.append(uncertainty_map(calibrated, number, distance, asked.grid, **how))
    suggestions = []
    if asked.suggest and maps:
        report("views to take next")
        at = maps[0].distance
        suggestions.append(suggest_views(calibrated, at, camera=maps[0].camera, views=asked.suggest))
    return Worth(maps=tuple(maps), cross=tuple(cross), suggestions=tuple(suggestions), remarks=tuple(remarks))


def median_distance(calibrated: Calibrated, camera: int) -> float:
    housing, own = housing_of(calibrated, camera)
    return float(f"{np.median(housing.board_distances(own)):.{DISTANCE_FIGURES}g}")


@dataclass(frozen=True, eq=False, kw_only=True)
class Worth:
    """Assessment of a calibration.

    Attributes
    ----------
    maps
        Uncertainty maps of each camera at each distance.
    cross
        Cross-validations, one for each housing.
    suggestions
        Suggested views for the first camera.
    differences
        Differences from another calibration, by camera.
    remarks
        Results that could not be computed, and reasons.
    """

    maps: tuple[UncertaintyMap, ...] = ()
    cross: tuple[CrossValidation, ...] = ()
    suggestions: tuple[Suggestions, ...] = ()
    differences: tuple[CameraDifference, ...] = ()
    remarks: tuple[Phrase, ...] = field(default=())

    @property
    def largest(self) -> float:
        """Largest standard deviation of all maps in the observed board region, pixels.

        NaN without maps.
        """
        return max((each.largest for each in self.maps), default=math.nan)

    @property
    def sentences(self) -> list[str]:
        """Summary of the assessment, one line per topic."""
        lines = []
        for camera in dict.fromkeys(each.camera for each in self.maps):
            maps = [each for each in self.maps if each.camera == camera]
            sizes = [
                phrase("map.size", size=each.largest, at=at_distance(each.distance, each.unit))
                for each in maps
            ]
            lines.append(str(phrase("map.worst", camera=camera, sizes=sizes, model=maps[0].model)))
        lines += [line for each in self.differences for line in each.sentences]
        for each in self.suggestions:
            lines += [str(phrase("views.line", line=line)) for line in each.sentences]
        return [*lines, *map(str, self.remarks)]
