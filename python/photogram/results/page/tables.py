"""Tables of networks: control, check points, observations beside images, photos, points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.messages import counted
from photogram.results.axes import point_axes
from photogram.results.network import AdjustedNetwork, Observed
from photogram.results.network_tables import Terms, control, part, photos, points, stations, terms_of
from photogram.results.observation_rows import is_held
from photogram.results.result import Result
from photogram.results.tables import check_points, observations, unheld
from photogram.results.weakest import weakest_photos, weakest_points
from photogram.show.cells import long_table, page_table, unit_written
from photogram.show.page import Column, Layers, Row, Section, Table
from photogram.show.quantity import Quantity, chosen, labelled

ALL = 200
"""Photos or points up to which all have a row."""
SOME = 100
"""Otherwise the rows of the most notable, beside those that other tables name."""
CONDITION_NOTE = (
    "The condition, of the covariance matrix of the pose scaled to ones, stands at the weakest ten."
)
RATIO_NOTE = (
    "The ratio of the standard deviations, in any directions, stands at the weakest ten: above 10,000 rays"
    " are nearly parallel."
)


def control_section(result: AdjustedNetwork) -> Section:
    """Return control: prior, posterior, difference, test; what is held has none."""
    weighted = ~is_held(result.control)
    own = replace(result.control, sd=np.where(weighted[:, np.newaxis], result.control.sd, np.nan))
    tables = _observed("Control points", control(result), own, result.point_sd)
    if isinstance(result, Result):
        tables += _compared("Components of control that are not held", unheld(result))
    intro = (
        "What was given for the control points, and what the adjustment made of it. A component with a"
        " redundancy"
        " number near 0 is not checked by the rest of the network: an error of it goes into the result"
        " unseen."
    )
    if held := int(np.count_nonzero(~weighted)):
        intro += f" {counted(held, 'point')} held where given, which nothing tests, are not listed."
    return Section("control", "Control points", tables, intro)


def _observed(caption: str, table: Sequence[Quantity], given: Observed, sd: Floats) -> list[Table]:
    """Return prior, posterior, difference and test of every observed component; none where there are none.

    `sd` are (n, k) standard deviations of the adjusted values, of all photos or points.
    """
    there = np.isfinite(given.sd)
    tests, own = _tested(there, given.standardized), np.where(there, sd[given.rows], np.nan)
    return long_table(caption, table, tests, own, " components")


def _tested(there: np.ndarray, tests: Floats) -> Floats:
    """Return test values: infinite where there is none, NaN where the component is not there."""
    found: Floats = np.where(there, np.nan_to_num(tests, nan=np.inf), np.nan)
    return found


def check_section(result: Result) -> Section:
    """Return check points with what they say as a whole."""
    tables = _compared("Check points one by one", check_points(result))
    parts = [_check_summary(result), *tables] if tables else []
    intro = (
        "Points with known coordinates that took no part in the adjustment: the independent proof of"
        " its accuracy."
        " The test value is the difference over its standard deviation: that of the adjusted coordinate and"
        " that of the given one together."
    )
    return Section("check-points", "Check points", parts, intro)


def _check_summary(result: Result) -> Table:
    checks = result.check_points
    all_differences, sd = checks.differences, np.hypot(checks.sd, checks.given_sd)
    rows: list[Row] = []
    for k, axis in enumerate(point_axes(result.block)):
        own = np.isfinite(all_differences[:, k])
        if not own.any():
            continue
        differences, deviations = all_differences[own, k] * axis.factor, sd[own, k] * axis.factor
        with np.errstate(all="ignore"):
            tests = differences / deviations
            rows.append(
                [
                    f"{axis.name}, {unit_written(axis.small)}",
                    int(own.sum()),
                    float(differences.mean()),
                    float(np.sqrt((differences**2).mean())),
                    float(differences[np.abs(differences).argmax()]),
                    float(np.sqrt((deviations**2).mean())),
                    float(np.sqrt((tests**2).mean())),
                ]
            )
    columns = (
        Column("Component", text=True),
        Column("Points", decimals=0),
        Column("Mean difference", figures=3),
        Column("rms difference", figures=3),
        Column("Largest", figures=3),
        Column("rms of sd", figures=3),
        Column("rms of test values", decimals=2),
    )
    note = "Test values have an rms of about 1 where the standard deviations are right."
    return Table("Check points together", columns, rows, note)


def _compared(caption: str, table: Sequence[Quantity]) -> list[Table]:
    """Return given and adjusted coordinates of the components that can be compared."""
    there = np.isfinite(labelled(table, "difference").values)
    tests = next(each.values for each in table if each.head == "Test value")
    own = np.where(there, labelled(table, "sd adjusted").values, np.nan)
    return long_table(caption, table, _tested(there, tests), own)


def stations_section(result: AdjustedNetwork) -> Section:
    """Return what was given of photos as observations, layer by layer."""
    tables: list[Table] = []
    layers = terms_of(result).layers
    for caption, of in layers.items():
        given, table = result.stations, [part(each, of) if each.axes else each for each in stations(result)]
        own = replace(given, sd=given.sd[:, of], standardized=given.standardized[:, of])
        tables += _observed(f"{caption} of photos", table, own, result.photo_sd[:, of])
    *others, last = [caption.lower() for caption in layers]
    intro = f"{', '.join(others).capitalize()} and {last} that were given with standard deviations."
    return Section("stations", "Observed photos", _layers("stations", tables), intro)


def _layers(name: str, tables: list[Table]) -> list[Layers] | list[Table]:
    return [Layers(f"{name}-layers", tables)] if len(tables) > 1 else tables


def beside_section(result: Result) -> Section:
    """Return observations beside images, kind by kind."""
    tables = []
    for each in result.kinds.values():
        if each.used:
            tests = _tested(np.isfinite(each.residuals), each.standardized)
            tables += long_table(each.kind[:1].upper() + each.kind[1:], observations(each), tests)
    intro = "Observations beside images: observed minus adjusted, with their tests."
    return Section("observations", "Other observations", _layers("beside", tables), intro)


def chosen_rows(count: int, named: Iterable[int], orders: Sequence[Indices]) -> tuple[Indices, bool]:
    """Return which of many have a row, and whether these are all.

    Those that other tables name come first, then by turns the worst in each order.
    """
    if count <= ALL:
        return np.arange(count), True
    rows = dict.fromkeys(named)
    share = max(SOME // max(len(orders), 1), 1)
    for order in orders:
        rows |= dict.fromkeys(order[:share].tolist())
    return np.sort(np.array(list(rows), dtype=np.int64)), False


def photos_section(result: AdjustedNetwork, named: Iterable[int], intro: str = "") -> Section:
    """Return photos, those `named` elsewhere first: their unknowns, and how their images fit, in layers."""
    terms, fit = terms_of(result), _fit_of_photos(result, terms_of(result))
    places = {str(name): row for row, name in enumerate(terms.photos.tolist())}
    weak = {places[each.photo]: each.condition for each in weakest_photos(result)}
    orders = [np.argsort(-np.nan_to_num(column, nan=-1.0), kind="stable") for column in fit.T[[3, 4]]]
    rows, every = chosen_rows(len(terms.photos), [*weak, *named], orders)
    note = (
        ""
        if every
        else f"{len(rows)} of {len(terms.photos)}: those that other tables name, the largest"
        " residuals and test values, and the weakest. The table of photos has all."
    )
    own, *_, values, sd = photos(result)
    tables = []
    for caption, of in terms.layers.items():
        by = result.photo_sd[:, of] if terms.split else None
        table = chosen([own, part(values, of), part(sd, of)], rows)
        tables.append(page_table(caption, table, note, by))
        own = replace(own, link=None)  # a name leads to one row only
    x, y = terms.image_axes
    size = replace(x, name="")
    condition = [weak.get(row) for row in rows.tolist()]
    table = [
        *chosen(
            [
                own,
                Quantity(fit[:, 5].astype(int), head="Images"),
                Quantity(fit[:, :2], (x, y), "deviation", head="rms {}", decimals=2),
                Quantity(fit[:, 2], head="Mean redundancy", decimals=3),
                Quantity(fit[:, 3:4], (size,), "deviation", head="Largest residual{}", decimals=2),
                Quantity(fit[:, 4], head="Largest |w|", decimals=2),
            ],
            rows,
        ),
        Quantity(condition, head="Condition of the pose"),
    ]
    tables.append(page_table("Fit of images", table, f"{note} {CONDITION_NOTE}".strip()))
    return Section("photos", "Photos", [Layers("photos-layers", tables)], intro)


@np.errstate(all="ignore")
def _fit_of_photos(result: AdjustedNetwork, terms: Terms) -> Floats:
    """Return (P, 6) rms x and y, mean redundancy, longest residual, largest |w|, number of images."""
    used = result.used_images
    photos, count = result.given.image_photos[used], len(terms.photos)
    images = np.bincount(photos, minlength=count)
    residuals = result.residuals[used]
    found = np.full((count, 6), np.nan)
    found[:, 5] = images
    for axis in (0, 1):
        found[:, axis] = np.sqrt(np.bincount(photos, residuals[:, axis] ** 2, count) / images)
    found[:, 2] = np.bincount(photos, result.redundancy[used].mean(axis=1), count) / images
    for column, values in (
        (3, np.hypot(*residuals.T)),
        (4, np.nan_to_num(np.abs(result.standardized[used])).max(axis=1, initial=0.0)),
    ):
        largest = np.zeros(count)
        np.maximum.at(largest, photos, values)
        found[:, column] = np.where(images > 0, largest, np.nan)
    return found


def points_section(result: AdjustedNetwork, named: Iterable[int], intro: str = "") -> Section:
    """Return points with their standard deviations, those `named` by other tables first."""
    terms, used = terms_of(result), np.flatnonzero(result.used_points)
    places = {str(name): row for row, name in enumerate(terms.points.tolist())}
    weak = {places[each.point]: each.ratio for each in weakest_points(result)}
    # What makes lengths of angles, near enough to sort by.
    lengths = np.array([6.4e6 if axis.angle else 1.0 for axis in terms.point_axes])
    size = np.where(result.used_points, np.linalg.norm(result.point_sd * lengths, axis=1), np.nan)
    order = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")
    if len(used) <= ALL:
        rows, every = used, True
    else:
        rows, every = chosen_rows(len(terms.points), [*weak, *named], [order])
        rows = rows[result.used_points[rows]]
    if not len(rows):
        return Section("points", "Points", [])
    ratios = Quantity([weak.get(row) for row in rows.tolist()], head="Largest over smallest sd")
    few_of = f"{len(rows)} of {len(used)}: those that other tables name, those of the largest sd"
    note = f"{'' if every else few_of + ', and the weakest. The table of points has all. '}{RATIO_NOTE}"
    by = result.point_sd[used] if terms.split else None
    shown = [*chosen(points(result), np.searchsorted(used, rows)), ratios]
    return Section("points", "Points", [page_table("Points", shown, note, by)], intro)
