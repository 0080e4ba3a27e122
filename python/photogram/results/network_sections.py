"""Sections of networks: control, check points, other observations, photos, points, the weakest of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted, listed
from photogram.results.axes import Determined, Terms, point_axes
from photogram.results.network import AdjustedNetwork, Observed
from photogram.results.network_tables import (
    control,
    images,
    part,
    photos,
    plan_deviations,
    points,
    stations,
)
from photogram.results.tables import check_points, observations
from photogram.show.cells import unit_written
from photogram.show.page import Layers, Part, Section, Text, layered_tables
from photogram.show.quantity import Link, Quantity, Table, named, of_each

if TYPE_CHECKING:
    from photogram import Result

WORST = 10
NEAR = 1e-3  # Points closer to a station, as a part of the median distance, are listed first


@dataclass(frozen=True)
class WeakestPoint:
    """A point among those that are determined worst."""

    row: int  # Among the points of the network
    point: str  # Its name
    # The largest of its standard deviations over the smallest, in any directions: the root of the ratio
    # of the eigenvalues of its covariance matrix. Rays that meet at right angles give about 1, nearly
    # parallel ones 10,000 and more. 1 if a component is held
    ratio: float
    # From the nearest station that sees it, in the median of these distances; NaN where scanners alone
    # do
    distance: float
    rays: int  # Number of its images


@dataclass(frozen=True)
class WeakestPhoto:
    """A photo among those that are determined worst."""

    row: int  # Among the photos of the network
    photo: str  # Its name
    # Largest over smallest eigenvalue of the covariance matrix of position and attitude, scaled to a
    # diagonal of ones. Points on a line leave a photo free to turn about it: then it has no bound
    condition: float
    images: int  # Number of its images


@np.errstate(all="ignore")
def weakest_points(result: AdjustedNetwork) -> list[WeakestPoint]:
    """Return the points of the largest ratios, and those nearest to a station, the worst first.

    None without cofactors.
    """
    network = result._determined()
    cofactors = network.point_cofactors
    known = np.isfinite(cofactors).all(axis=(1, 2)) & result.used_points
    ratio = np.full(len(known), np.nan)
    free = known & np.isinf(result.point_given_sd).all(axis=1)
    ratio[known] = 1.0
    ratio[free] = np.sqrt(_condition(cofactors[free], 3))
    distance = _distances(result, network)
    order = np.lexsort((distance, -ratio))
    near = np.flatnonzero(distance < NEAR)
    worst = order[~np.isnan(ratio[order])][:WORST]
    chosen = [*near[np.argsort(distance[near])].tolist(), *worst.tolist()]
    return [
        WeakestPoint(
            row,
            result.given.point_ids[row],
            float(ratio[row]),
            float(distance[row]),
            int(result.point_rays[row]),
        )
        for row in list(dict.fromkeys(chosen))[:WORST]
    ]


@np.errstate(all="ignore")
def weakest_photos(result: AdjustedNetwork) -> list[WeakestPhoto]:
    """Return the photos of the largest conditions, the worst first.

    Fixed unknowns of a photo do not count; those of which all are fixed are left out.
    """
    network = result._determined()
    names, photos = result.given.photo_ids, result.given.image_photos
    images = np.bincount(photos[result.used_images], minlength=len(names))
    known = (images > 0) & np.isfinite(network.poses).all(axis=(1, 2)) & (network.ranks > 0)
    poses, rows = network.poses[known], np.flatnonzero(known)
    variances = np.diagonal(poses, axis1=1, axis2=2)
    sd = np.sqrt(np.where(variances > 0, variances, 1.0))
    condition = _condition(poses / (sd[:, :, np.newaxis] * sd[:, np.newaxis, :]), network.ranks[known])
    return [
        WeakestPhoto(int(rows[k]), names[rows[k]], float(condition[k]), int(images[rows[k]]))
        for k in np.argsort(-condition, kind="stable")[:WORST].tolist()
    ]


def _condition(matrices: Floats, ranks: Indices | int) -> Floats:
    """Return largest over smallest eigenvalue of (n, k, k) matrices; infinite where rounding has taken it.

    Of the smaller ranks only so many eigenvalues count: the others belong to what is fixed.
    """
    values = np.linalg.eigvalsh(matrices)
    largest = values[:, -1]
    smallest = np.take_along_axis(values, values.shape[1] - np.reshape(ranks, (-1, 1)), axis=1)[:, 0]
    found: Floats = np.where(smallest > np.finfo(float).eps * largest, largest / smallest, np.inf)
    return found


def _distances(result: AdjustedNetwork, network: Determined) -> Floats:
    """Return the distances of all points from the nearest station that sees them, in their median."""
    used = result.used_images
    if network.moving is not None:
        used = used & ~network.moving[result.given.image_photos]
    own = result.image_points[used]
    of_images = network.points[own] - network.stations[result.given.image_photos[used]]
    nearest = np.full(len(network.points), np.inf)
    np.minimum.at(nearest, own, np.linalg.norm(of_images, axis=1))
    seen = np.isfinite(nearest)
    found: Floats = np.where(seen, nearest / np.median(nearest[seen]) if seen.any() else np.nan, np.nan)
    return found


ALL = 200  # Number up to which all photos or points are listed
SOME = 100  # Rows of longer tables, besides those that other tables mention
COMPONENTS = 120  # Rows of a table of components
IMAGES = 1_000  # Image observations of a text report


def component_table(
    key: str, title: str, columns: Sequence[Quantity], tests: Floats, deviations: Floats | None = None
) -> list[Table]:
    """Return a table that shows the components with the largest test values; none without components.

    `tests` are (n, k) test values, infinite where there is none, NaN where the component is not there.
    """
    places = np.argwhere(~np.isnan(tests))
    if not len(places):
        return []
    sizes = np.abs(tests[tuple(places.T)])
    order = np.argsort(np.where(np.isinf(sizes), 1.0, -sizes), kind="stable")
    rows = np.sort(order[:COMPONENTS])
    some = f"The {len(rows)} of {len(places)} components with the largest test values."
    note = "" if len(rows) == len(places) else some
    return [Table(key, title, columns, note, deviations=deviations, shown=places[rows])]


def is_held(control: Observed) -> Bools:
    """Return (r,) whether points are held in all their coordinates: nothing tests them."""
    found: Bools = (control.sd == 0).all(axis=1)
    return found


def control_section(result: AdjustedNetwork, free: Sequence[Quantity] = ()) -> Section:
    """Return control: prior, posterior, difference, test; what is held has none.

    `free` are the columns of components of control that are not held.
    """
    columns, held = control(result), is_held(result.control)
    own = replace(result.control, sd=np.where(held[:, np.newaxis], np.nan, result.control.sd))
    tables = _observed("control", "Control points", columns, own, result.point_sd)
    if free:
        tables += _compared("unheld", "Components of control that are not held", free)
    intro = (
        "What was given for the control points, and what the adjustment made of it. A component with a"
        " redundancy"
        " number near 0 is not checked by the rest of the network: an error of it goes into the result"
        " unseen."
    )
    parts: list[Part] = [*tables]
    if held.any():
        names = [str(name) for name in np.asarray(columns[0].values)[held]]
        fixed = counted(len(names), "point")
        parts.append(Text(f"{fixed} held where given, which nothing tests, are not listed: {listed(names)}."))
    return Section("control", "Control points", parts, intro)


def _observed(key: str, title: str, columns: Sequence[Quantity], given: Observed, sd: Floats) -> list[Table]:
    """Return prior, posterior, difference and test of every observed component; none where there are none.

    `sd` are (n, k) standard deviations of the adjusted values, of all photos or points.
    """
    there = np.isfinite(given.sd)
    deviations = np.where(there, sd[given.rows], np.nan)
    return component_table(key, title, columns, _tested(there, given.standardized), deviations)


def _tested(there: np.ndarray, tests: Floats) -> Floats:
    """Return test values: infinite where there is none, NaN where the component is not there."""
    found: Floats = np.where(there, np.nan_to_num(tests, nan=np.inf), np.nan)
    return found


def check_section(result: Result) -> Section:
    """Return check points with what they say as a whole."""
    columns = check_points(result)
    tables = _compared("check_points", "Check points one by one", columns)
    parts = [_check_summary(result), *tables, _check_tests(result, columns)] if tables else []
    intro = (
        "Points with known coordinates that took no part in the adjustment: the independent proof of"
        " its accuracy."
        " The test value is the difference over its standard deviation: that of the adjusted coordinate and"
        " that of the given one together."
    )
    checks = result.check_points
    if checks.assumed.any():
        names = [result.block.point_ids[row] for row in checks.rows[checks.assumed].tolist()]
        intro += (
            f" The given standard deviations of {counted(len(names), 'point')} are assumed: {listed(names)}."
        )
    return Section("check-points", "Check points", parts, intro)


@np.errstate(all="ignore")
def _check_summary(result: Result) -> Table:
    """Return mean and rms differences by component, beside their standard deviations."""
    axes, checks = point_axes(result.block), result.check_points
    factors = np.array([axis.factor for axis in axes])
    differences, sd = checks.differences * factors, np.hypot(checks.sd, checks.given_sd) * factors
    rows = []
    for axis, d, s in zip(axes, differences.T, sd.T, strict=True):
        if (known := np.isfinite(d)).any():
            d, s = d[known], s[known]
            squares = (np.sqrt((values**2).mean()) for values in (d, s, d / s))
            name = f"{axis.name}, {unit_written(axis.small)}"
            rows.append((name, len(d), d.mean(), d[np.abs(d).argmax()], *squares))
    names, counts, means, largest, rms, deviations, tests = zip(*rows, strict=True)
    columns = [
        Quantity(names, kind="name", head="Component"),
        Quantity(counts, head="Points", decimals=0),
        Quantity(means, head="Mean difference"),
        Quantity(rms, head="rms difference"),
        Quantity(largest, head="Largest"),
        Quantity(deviations, head="rms of sd"),
        Quantity(tests, head="rms of test values", decimals=2),
    ]
    note = "Test values have an rms of about 1 where the standard deviations are right."
    return Table("check-summary", "Check points together", columns, note)


def _check_tests(result: Result, columns: Sequence[Quantity]) -> Table:
    """Return the tests of points, all components together, of many those of least probability."""
    statistic, p = named(columns, "statistic"), named(columns, "probability")
    law = "T" if result.unit_variance == "unity" else "F"
    tests = [columns[0], replace(statistic, head=law, decimals=2), replace(p, head="p", figures=2)]
    rows = np.sort(np.argsort(np.nan_to_num(p.values, nan=2.0), kind="stable")[: COMPONENTS // 3])
    return Table("check-tests", "Tests of all components of a point together", tests, shown=rows)


def _compared(key: str, title: str, columns: Sequence[Quantity]) -> list[Table]:
    """Return given and adjusted coordinates of the components that can be compared."""
    there = np.isfinite(named(columns, "d").values)
    tests = next(column.values for column in columns if column.head == "Test value")
    deviations = np.where(there, named(columns, "sd").values, np.nan)
    return component_table(key, title, columns, _tested(there, tests), deviations)


def stations_section(result: AdjustedNetwork) -> Section:
    """Return what was given of photos as observations, layer by layer."""
    tables: list[Table] = []
    layers = result._terms().layers
    for caption, of in layers.items():
        given = result.stations
        columns = [part(column, of) if column.axes else column for column in stations(result)]
        own = replace(given, sd=given.sd[:, of], standardized=given.standardized[:, of])
        key, title = f"stations-{caption.lower()}", f"{caption} of photos"
        tables += _observed(key, title, columns, own, result.photo_sd[:, of])
    *others, last = [caption.lower() for caption in layers]
    intro = f"{', '.join(others).capitalize()} and {last} that were given with standard deviations."
    return Section("stations", "Observed photos", layered_tables("stations", tables), intro)


def beside_section(result: Result) -> Section:
    """Return observations beside images, kind by kind."""
    tables = []
    for kind, observed in result.kinds.items():
        if observed.used:
            tests = _tested(np.isfinite(observed.residuals), observed.standardized)
            title = kind[:1].upper() + kind[1:]
            tables += component_table(f"observations-{kind}", title, observations(observed), tests)
    intro = "Observations beside images: observed minus adjusted, with their tests."
    return Section("observations", "Other observations", layered_tables("beside", tables), intro)


def images_section(result: AdjustedNetwork) -> Section:
    """Return image observations, of many those with the largest test values, for reports as text."""
    columns = images(result)
    *_, residuals, redundancy, tests = columns
    sizes = np.nan_to_num(np.abs(tests.values)).max(axis=1, initial=0.0)
    rows = np.arange(len(sizes))
    if len(sizes) > IMAGES:
        rows = np.sort(np.argpartition(-sizes, IMAGES)[:IMAGES])
    some = f"The {len(rows)} of {len(sizes)} with the largest test values. The table of images has all."
    note = "" if len(rows) == len(sizes) else some
    columns[2:] = [
        replace(residuals, head="Residual {}", decimals=2),
        replace(redundancy, head="Redundancy {}"),
        replace(tests, head="w {}"),
    ]
    table = Table("images", "Image observations", columns, note, shown=rows)
    about = "Observed minus computed; w is the residual over its standard deviation, a priori unit weight."
    return Section("images", "Image observations", [table] if len(rows) else [], about)


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
    terms, fit = result._terms(), _fit_of_photos(result, result._terms())
    orders = [np.argsort(-np.nan_to_num(column, nan=-1.0), kind="stable") for column in fit.T[[3, 4]]]
    rows, every = chosen_rows(len(terms.photos), named, orders)
    some = (
        f"{len(rows)} of {len(terms.photos)}: those that other tables name, the largest"
        " residuals and test values, and the weakest. The table of photos has all."
    )
    note = "" if every else some
    names, *_, values, sd = photos(result)
    tables = []
    for caption, of in terms.layers.items():
        columns = [names, part(values, of), part(sd, of)]
        columns += plan_deviations(terms, result.photo_sd) if of.start == 0 else []
        by = result.photo_sd[:, of] if terms.split else None
        tables.append(Table(f"photos-{caption.lower()}", caption, columns, note, "", by, rows))
        names = replace(names, link=None)  # a name leads to one row only
    x, y = terms.image_axes
    columns = [
        names,
        Quantity(fit[:, 5].astype(int), head="Images"),
        Quantity(fit[:, :2], (x, y), "deviation", head="rms {}", decimals=2),
        Quantity(fit[:, 2], head="Mean redundancy", decimals=3),
        Quantity(fit[:, 3:4], (replace(x, name=""),), "deviation", head="Largest residual{}", decimals=2),
        Quantity(fit[:, 4], head="Largest |w|", decimals=2),
    ]
    tables.append(Table("photos-fit", "Fit of images", columns, note, shown=rows))
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
    terms, used = result._terms(), np.flatnonzero(result.used_points)
    # What makes lengths of angles, near enough to sort by.
    lengths = np.array([6.4e6 if axis.angle else 1.0 for axis in terms.point_axes])
    size = np.where(result.used_points, np.linalg.norm(result.point_sd * lengths, axis=1), np.nan)
    order = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")
    if len(used) <= ALL:
        rows, every = used, True
    else:
        rows, every = chosen_rows(len(terms.points), named, [order])
        rows = rows[result.used_points[rows]]
    if not len(rows):
        return Section("points", "Points", [])
    some = (
        f"{len(rows)} of {len(used)}: those that other tables name, those of the largest sd, and the weakest."
        " The table of points has all."
    )
    by = result.point_sd[used] if terms.split else None
    columns = [*points(result), *plan_deviations(terms, result.point_sd[used])]
    shown = np.searchsorted(used, rows)
    return Section(
        "points", "Points", [Table("points", "Points", columns, "" if every else some, "", by, shown)], intro
    )


def weakest_tables(
    result: AdjustedNetwork, points: Sequence[WeakestPoint], photos: Sequence[WeakestPhoto]
) -> tuple[Table, Table]:
    """Return the points and photos with the weakest determination; without rows if there are no cofactors."""
    called = int if result._terms().identity == "number" else str
    of_points, of_photos = ([each.row for each in things] for things in (points, photos))
    ratio = (
        "The ratio of the standard deviations is in any directions: above 10,000 rays are nearly parallel."
        " The distance is that from the nearest station, in the median of such distances: a point below 0.001"
        " is at the station itself."
    )
    condition = "Condition of the covariance matrix of position and attitude, scaled to a diagonal of ones."
    return (
        Table(
            "weakest-points",
            "Weakest points",
            [
                linked("point", [called(each.point) for each in points], of_points),
                of_each(points, "ratio", head="Largest over smallest sd", figures=4),
                of_each(points, "distance", head="Distance", figures=4),
                of_each(points, "rays", head="Rays", decimals=0),
            ],
            ratio,
        ),
        Table(
            "weakest-photos",
            "Weakest photos",
            [
                linked("photo", [called(each.photo) for each in photos], of_photos),
                of_each(photos, "condition", head="Condition", figures=4),
                of_each(photos, "images", head="Images", decimals=0),
            ],
            condition,
        ),
    )


def linked(kind: str, names: Sequence[str | int], rows: ArrayLike) -> Quantity:
    """Return names of photos or points that lead to their rows."""
    link = Link(kind, np.array(rows, dtype=np.int64))
    return Quantity(names, kind="name", name=kind, member=kind, head=kind.capitalize(), link=link)
