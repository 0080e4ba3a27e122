"""The page of every adjusted network: how good it is, how it went, what was remarked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from photogram.arguments.types import Floats
from photogram.plots.accessor import sketch_of
from photogram.results.axes import component_axis
from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import iterations, terms_of
from photogram.results.observation_rows import IMAGE_COORDINATES, outlying, tested_singly
from photogram.results.page.tables import photos_section, points_section
from photogram.results.report import ORDERINGS, problems_of
from photogram.show.cells import page_table, unit_written
from photogram.show.judgement import judged, remarks_section, verdict_table
from photogram.show.page import (
    Cell,
    Column,
    Document,
    Drawing,
    Fact,
    Facts,
    Part,
    Row,
    Section,
    Table,
    significant,
)
from photogram.show.quantity import Axis
from photogram.statistics.evidence import GLOBAL
from photogram.statistics.findings import Tested

_NOT_CHECKED = 0.01


def network_page(
    result: AdjustedNetwork,
    what: str,
    size: Section,
    given: Sequence[Section],
    *,
    photos: int,
    title: str = "",
    more: Sequence[Fact] = (),
    redundancy: Sequence[Table] = (),
    beside: Sequence[Section] = (),
    datum: str = "",
    poses: str = "",
) -> Document:
    """Return the page of a network: its number of `photos`, sections on its `size` and on what was `given`.

    `more` is what a reader wants first besides; `redundancy` stands beside the picture of redundancy numbers,
    `beside` beside the plan; `datum` says what coordinates refer to, `poses` what the poses of photos are
    where that is not plain.
    """
    pictures, worst = drawings(result), _worst_of(tested_singly(result))
    worst_photos, worst_points = _worst_images(result, worst)
    intro = (
        "The redundancy number of an observation is the share of its error that shows in its own"
        " residual; the rest"
        " goes into the unknowns. Their sum is the number of observations beyond what is needed."
    )
    return Document(
        what=what,
        title=title,
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=[*_highlights(result, photos), *more],
        sections=[
            Section("network", "Plan of the network", [pictures["network"]]),
            *beside,
            size,
            Section("residuals", "Image residuals", [pictures["residuals"]]),
            Section("redundancy", "Redundancy", [pictures["redundancy"], *redundancy], intro),
            _tests_section(result, pictures["tests"]),
            _worst_section(result, worst),
            *given,
            photos_section(result, worst_photos, f"{datum} {poses}".strip()),
            points_section(result, worst_points, datum),
            _iterations_section(result),
            remarks_section(problems_of(result)),
        ],
        phases=result.seconds,
    )


def size_section(
    result: AdjustedNetwork, much: Sequence[tuple[str, str]], more: Sequence[Fact], good: Sequence[Fact]
) -> Section:
    """Return how much there is, `more` of it, and how good it is."""
    facts = [Fact(f"{name[:1].upper()}{name[1:]}", value) for name, value in much]
    facts.append(Fact("Degrees of freedom", f"{result.degrees_of_freedom:.8g}"))
    parts: list[Part] = [
        Facts("How much", [*facts, *more]),
        Facts("How good", [*good, *_images_facts(result)]),
        *_precision_table(result),
    ]
    return Section("size", "How much, how good", parts)


def _highlights(result: AdjustedNetwork, photos: int) -> list[Fact]:
    """Return what a reader wants first of every network, with its number of photos."""
    used, (axis, _) = result.used_images, terms_of(result).image_axes
    images, points = np.count_nonzero(used), np.count_nonzero(result.used_points)
    found = [
        _unit_weight(result),
        Fact("Photos", f"{photos:,}", note=f"{points:,} points, {images:,} images"),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:,.0f}"),
    ]
    if images:
        rms = math.sqrt(float(((result.residuals[used] * axis.factor) ** 2).mean()))
        found.append(Fact("rms of image residuals", significant(rms, 3), unit_written(axis.small)))
    return found


def _unit_weight(result: AdjustedNetwork) -> Fact:
    """Return the standard deviation of unit weight with what it may be, where that was tested."""
    variance, name = result.variance_of_unit_weight, "Standard deviation of unit weight"
    if variance is None:
        return Fact(name, "–", note="no degrees of freedom: covariances are scaled by 1")
    note = ""
    for test in result.verdict.tests:
        if test.kind == GLOBAL and test.limits[0] is not None and test.limits[1] is not None:
            note = f"{math.sqrt(test.limits[0]):.3f} to {math.sqrt(test.limits[1]):.3f} expected"
    return Fact(name, f"{math.sqrt(variance):.3f}", note=note)


def _images_facts(result: AdjustedNetwork) -> list[Fact]:
    """Return how well images fit and are checked."""
    used, (axis, _) = result.used_images, terms_of(result).image_axes
    unit, residuals = unit_written(axis.small), result.residuals[used] * axis.factor
    if not len(residuals):
        return []
    with np.errstate(over="ignore"):
        rms = np.sqrt((residuals**2).mean(axis=0))
        length = np.hypot(*residuals.T)
    facts = [
        Fact(
            "Residuals of images, rms in x and y", f"{significant(rms[0], 3)}, {significant(rms[1], 3)}", unit
        ),
        Fact(
            "Length of image residuals, median and largest",
            f"{significant(float(np.median(length)), 3)}, {significant(float(length.max()), 3)}",
            unit,
        ),
    ]
    redundancy = result.redundancy[used]
    if np.isfinite(redundancy).all():
        hidden = int(np.count_nonzero(redundancy <= _NOT_CHECKED))
        facts.append(
            Fact(
                "Redundancy numbers of images, mean and least",
                f"{redundancy.mean():.3f}, {redundancy.min():.3f}",
                note="the share of an error that shows in its own residual: 0 not checked at all, 1 fully",
            )
        )
        facts.append(
            Fact(
                "Image coordinates that nothing checks",
                f"{hidden} of {redundancy.size}",
                note=f"redundancy below {_NOT_CHECKED:g}",
            )
        )
    return facts


def _precision_table(result: AdjustedNetwork) -> list[Table]:
    """Return how the standard deviations of adjusted values are spread; none where none were computed."""
    terms, rows = terms_of(result), list[Row]()
    for what, axes, deviations in (
        ("points", terms.point_axes, result.point_sd[result.used_points]),
        ("photos", terms.photo_axes, result.photo_sd),
    ):
        for axis, column in zip(axes, deviations.T, strict=True):
            known = column[np.isfinite(column)] * axis.factor
            if known.size:
                figures = [float(each) for each in np.quantile(known, (0.5, 0.9, 1.0))]
                rows.append([what, axis.name, *figures, unit_written(axis.small)])
    columns = (
        Column("Standard deviations of", text=True),
        Column("Component", text=True),
        Column("Median", figures=3),
        Column("90 % are below", figures=3),
        Column("Largest", figures=3),
        Column("Unit", text=True),
    )
    note = "A posteriori: scaled by the unit variance where that is estimated."
    return [Table("Precision", columns, rows, note)] if rows else []


def _tests_section(result: AdjustedNetwork, drawing: Drawing) -> Section:
    """Return all tests, and the picture of single ones."""
    table = verdict_table(result.verdict)
    parts: list[Part] = [drawing, *([table] if table.rows else [])]
    intro = "How the residuals agree with the standard deviations that were given, as a whole and one by one."
    return Section("tests", "Tests", parts, intro)


def _worst_section(result: AdjustedNetwork, worst: Sequence[Worst]) -> Section:
    """Return the worst observations."""
    intro = (
        "A residual alone says little: an error shows in it only by the share of its redundancy number."
        " The test"
        " value takes both into account. Names of photos and points lead to their rows below."
    )
    parts = [_worst_table(result, worst)] if worst else []
    return Section("worst", "Worst observations", parts, intro)


def _iterations_section(result: AdjustedNetwork) -> Section:
    """Return the history."""
    facts = [
        Fact("Status", result.status),
        Fact("Photos eliminated", ORDERINGS.get(result.ordering, result.ordering)),
    ]
    if result.loss is not None:
        facts.append(Fact("Robust loss", f"{result.loss[0]}, from {result.loss[1]:g} standard deviations"))
    note = "Damping is 0 for a step of Gauss-Newton. The sum is that after the corrections of the iteration."
    table = page_table("Iterations", iterations(result), note)
    return Section("iterations", "Iterations", [table, Facts("Course", facts)])


WORST = 25
"""Observations in the table of the worst."""
Worst = tuple[float, Tested, tuple[int, ...]]
"""The size of a test value, its kind, and its place there."""


def _worst_of(groups: Sequence[Tested], count: int = WORST) -> list[Worst]:
    """Return the observations of least probability, with |test value| as the measure of what is alike."""
    found: list[Worst] = []
    for tested in groups:
        sizes = np.where(np.isnan(tested.values), -1.0, np.abs(tested.values))
        flat = sizes.ravel()
        if not flat.size:
            continue
        few = np.argpartition(-flat, min(count, flat.size - 1))[:count]
        for index in few[flat[few] > 0].tolist():
            place = tuple(int(each) for each in np.unravel_index(index, sizes.shape))
            found.append((float(flat[index]), tested, place))
    found.sort(key=lambda each: (-each[0], str(each[1].kind), each[2]))
    return found[:count]


def _worst_images(result: AdjustedNetwork, worst: Sequence[Worst]) -> tuple[list[int], list[int]]:
    """Return photos and points of the images among the worst observations."""
    own = [place[0] for _, tested, place in worst if tested.kind == IMAGE_COORDINATES]
    return result.given.image_photos[own].tolist(), result.image_points[own].tolist()


def _worst_table(result: AdjustedNetwork, worst: Sequence[Worst]) -> Table:
    """Return the observations whose test values are the largest, of all kinds."""
    terms, every = terms_of(result), tested_singly(result)
    marked = {each.kind: outlying(result.verdict, each) for each in every}
    numbers = dict(zip((each.kind for each in every), _numbers(result), strict=True))
    rows: list[list[Cell | str | float | None]] = []
    for _, tested, place in worst:
        residuals, sd, redundancy, axes = numbers[tested.kind]
        axis = axes[place[1]]
        names: list[Cell | str | None] = [str(tested.name(place)), None, None]
        if tested.kind == IMAGE_COORDINATES:
            photo, point = result.given.image_photos[place[0]], result.image_points[place[0]]
            names = [
                f"image {axis.name}",
                Cell(str(terms.photos[photo]), goes_to=f"photo-{photo}"),
                Cell(str(terms.points[point]), goes_to=f"point-{point}"),
            ]
        rows.append(
            [
                *names,
                float(residuals[place]) * axis.factor,
                float(sd[place]) * axis.factor,
                unit_written(axis.small),
                float(redundancy[place]),
                Cell(float(tested.values[place]), tone="look" if marked[tested.kind][place] else ""),
            ]
        )
    columns = (
        Column("Observation", text=True),
        Column("Photo", text=True),
        Column("Point", text=True),
        Column("Residual", figures=3),
        Column("sd given", figures=3),
        Column("Unit", text=True),
        Column("Redundancy", decimals=3),
        Column(f"Test value {worst[0][1].statistic}", decimals=2),
    )
    said = "Marked observations are the outliers of the verdict: the section Tests has the limits."
    return Table("Worst observations", columns, rows, f"The {len(rows)} of the largest test values. {said}")


def _numbers(result: AdjustedNetwork) -> list[tuple[Floats, Floats, Floats, tuple[Axis, ...]]]:
    """Return residuals, standard deviations, redundancy numbers and components of every kind."""
    terms = terms_of(result)
    return [
        (result.residuals, result.image_given_sd, result.redundancy, terms.image_axes),
        (result.point_residuals, result.point_given_sd, result.point_redundancy, terms.point_axes),
        (result.photo_residuals, result.photo_given_sd, result.photo_redundancy, terms.photo_axes),
        *(
            (
                each.residuals,
                each.sd,
                each.redundancy,
                tuple(map(component_axis, each.components, each.units)),
            )
            for each in terms.kinds
        ),
    ]


CAPTIONS = {
    "network": (
        "Plan of the network",
        "Photos with what they show, points by their number of rays, control and check points with their"
        " differences, and error ellipses (95 percent). What is enlarged has a scale bar.",
    ),
    "residuals": (
        "Image residuals over the frame",
        "Observed minus computed, camera by camera: one by one, or the means of cells where there are many."
        " Arrows that point alike in one part of the frame are what the camera model does not explain.",
    ),
    "redundancy": (
        "Redundancy over the frame and over the network",
        "Where the network checks itself, and where not: dark places have errors that nobody sees.",
    ),
    "tests": (
        "Test values against the normal distribution",
        "Left the histogram, right the ordered test values over those expected: they lie on the line where"
        " the standard deviations are right, on a steeper one where these are too small; single ones"
        " away from it"
        " are gross errors.",
    ),
    "correlations": (
        "Correlations of the parameters of cameras",
        "Strong colours away from the diagonal: parameters that the network can hardly tell apart.",
    ),
    "distortion": (
        "Radial distortion with its standard deviations",
        "The curve, dashed where no image lies; where it is estimated, with one standard deviation beside.",
    ),
    "features": (
        "Deviations of points from their features",
        "Outside positive, of a plane on the side of its normal; bars are U to either side.",
    ),
    "films": (
        "Residuals of fiducial marks, and patterns of films",
        "Means over all photos, in the frame of the camera: marks that stay off on all of them are those of"
        " the certificate, or a pattern that was left out. Patterns as the adjustment has them.",
    ),
}
"""Title and caption by name."""


def drawings(result: AdjustedNetwork) -> dict[str, Drawing]:
    """Return the pictures that a result may have, by name; what there is nothing of draws nothing."""
    return {
        name: Drawing(f"picture-{name}", *words, partial(sketch_of, result, name))
        for name, words in CAPTIONS.items()
    }
