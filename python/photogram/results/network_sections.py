"""Sections on control, check points, other observations, photos and points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.results import network_tables
from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import point_axes
from photogram.results.tables import check_points, observations
from photogram.show.forms import unit_written
from photogram.show.page import Layers, Part, Section, Text, about
from photogram.show.quantity import Quantity, Table, for_people, named

if TYPE_CHECKING:
    from photogram import Result

WORST = 10
NEAR = 1e-3  # Distance of points listed first from a station, relative to the median distance


@np.errstate(all="ignore")
def weakest_points(result: AdjustedNetwork) -> Table:
    """Return points with the largest sd ratios (1 with a fixed component), and those near a station."""
    network = result._plot_data()
    stations, points = network.plan.photos, network.plan.points
    lengths = network.lengths(np.arange(len(points)))
    cofactors = result.point_cofactors * lengths[:, :, np.newaxis] * lengths[:, np.newaxis]
    known = np.isfinite(cofactors).all(axis=(1, 2)) & result.used_points
    ratio = np.full(len(known), np.nan)
    free = known & np.isinf(result.point_given_sd).all(axis=1)
    ratio[known] = 1.0
    ratio[free] = np.sqrt(_condition(cofactors[free], 3))
    # Distances of points from the nearest station, over their median.
    used = result.used_images & ~network.scanned[result.given.image_photos]
    own = result.image_points[used]
    of_images = points[own] - stations[result.given.image_photos[used]]
    nearest = np.full(len(points), np.inf)
    np.minimum.at(nearest, own, np.linalg.norm(of_images, axis=1))
    seen = np.isfinite(nearest)
    distance = np.where(seen, nearest / np.median(nearest[seen]) if seen.any() else np.nan, np.nan)
    order = np.lexsort((distance, -ratio))
    near = np.flatnonzero(distance < NEAR)
    worst = order[~np.isnan(ratio[order])][:WORST]
    chosen = [*near[np.argsort(distance[near])].tolist(), *worst.tolist()]
    rows = np.array(list(dict.fromkeys(chosen))[:WORST], dtype=np.int64)
    columns = [
        network_tables.names(result._terms, "point", rows, "point"),
        Quantity(ratio[rows], member="ratio", head="Largest over smallest sd", figures=4),
        Quantity(distance[rows], member="distance", head="Distance", figures=4),
        Quantity(result.point_rays[rows], member="rays", head="Rays", decimals=0),
    ]
    return Table("weakest.points", "Weakest points", columns, about("weakest-points"))


@np.errstate(all="ignore")
def weakest_photos(result: AdjustedNetwork) -> Table:
    """Return photos with the largest condition numbers of their free unknowns, the worst first."""
    all_poses, count = result._plot_data().poses, len(result.given.photo_ids)
    images = np.bincount(result.given.image_photos[result.used_images], minlength=count)
    ranks = (np.diagonal(result.photo_cofactors, axis1=1, axis2=2)[:, :6] > 0).sum(axis=1)
    known = (images > 0) & np.isfinite(all_poses).all(axis=(1, 2)) & (ranks > 0)
    poses = all_poses[known]
    variances = np.diagonal(poses, axis1=1, axis2=2)
    sd = np.sqrt(np.where(variances > 0, variances, 1.0))
    condition = _condition(poses / (sd[:, :, np.newaxis] * sd[:, np.newaxis, :]), ranks[known])
    order = np.argsort(-condition, kind="stable")[:WORST]
    rows = np.flatnonzero(known)[order]
    columns = [
        network_tables.names(result._terms, "photo", rows, "photo"),
        Quantity(condition[order], member="condition", head="Condition", figures=4),
        Quantity(images[rows], member="images", head="Images", decimals=0),
    ]
    return Table("weakest.photos", "Weakest photos", columns, about("weakest-photos"))


def _condition(matrices: Floats, ranks: Indices | int) -> Floats:
    """Return eigenvalue ratios of (n, k, k) matrices, of their `ranks` largest eigenvalues."""
    values = np.linalg.eigvalsh(matrices)
    largest = values[:, -1]
    smallest = np.take_along_axis(values, values.shape[1] - np.reshape(ranks, (-1, 1)), axis=1)[:, 0]
    found: Floats = np.where(smallest > np.finfo(float).eps * largest, largest / smallest, np.inf)
    return found


ALL = 200  # Number up to which all photos or points are listed
SOME = 100  # Rows of longer tables, in addition to items in other tables
COMPONENTS = 120  # Rows of a table of components
IMAGES = 1_000  # Image observations of a text report


def component_table(
    key: str,
    title: str,
    columns: Sequence[Quantity],
    there: Bools,
    tests: Floats,
    deviations: Floats | None = None,
) -> Table:
    """Return components with the largest of (n, k) test values; `there` are the existing ones."""
    places = np.argwhere(there)
    sizes = np.abs(tests[there])
    rows = np.sort(np.argsort(np.where(np.isnan(sizes), 1.0, -sizes), kind="stable")[:COMPONENTS])
    note = "" if len(rows) == len(places) else about("components.largest", n=len(rows), all=len(places))
    by = None if deviations is None else np.where(there, deviations, np.nan)
    return Table(key, title, columns, note, deviations=by, shown=places[rows])


def control_section(result: AdjustedNetwork, free: Sequence[Quantity] = ()) -> Section:
    """Return control: prior, posterior, difference, test; `free` are free components."""
    columns, own = network_tables.control(result), result.control
    held = (own.sd == 0).all(axis=1)
    there, sd = np.isfinite(own.sd) & ~held[:, np.newaxis], result.point_sd[own.rows]
    parts: list[Part] = [component_table("control", "Control points", columns, there, own.standardized, sd)]
    if free:
        parts.append(_compared("unheld", "Components of control that are not held", for_people(free)))
    if held.any():
        fixed = [str(name) for name in np.asarray(columns[0].values)[held]]
        parts.append(Text(about("control.fixed", n=len(fixed), names=fixed)))
    return Section("control", "Control points", parts, about("control"))


def check_section(result: Result) -> Section:
    columns = check_points(result)
    table = _compared("check_points", "Check points one by one", columns)
    statistic, p = named(columns, "statistic"), named(columns, "probability")
    law = "T" if result.unit_variance == "unity" else "F"
    tests = for_people(
        [columns[0], replace(statistic, head=law, decimals=2), replace(p, head="p", figures=2)]
    )
    rows = np.sort(np.argsort(np.nan_to_num(p.values, nan=2.0), kind="stable")[: COMPONENTS // 3])
    together = Table("check-tests", "Tests of all components of a point together", tests, shown=rows)
    parts = [_check_summary(result), table, together] if table.visible else [table]
    intro = about("check-points")
    checks = result.check_points
    if checks.assumed.any():
        assumed = [result.block.point_ids[row] for row in checks.rows[checks.assumed].tolist()]
        intro += f" {about('check-points.assumed', n=len(assumed), names=assumed)}"
    return Section("check-points", "Check points", parts, intro)


@np.errstate(all="ignore")
def _check_summary(result: Result) -> Table:
    axes, checks = point_axes(result.block), result.check_points
    factors = np.array([axis.factor for axis in axes])
    d, sd = checks.differences * factors, np.hypot(checks.sd, checks.given_sd) * factors
    some = np.flatnonzero(np.isfinite(d).any(axis=0))
    d, sd = d[:, some], sd[:, some]
    known = np.isfinite(d)
    count = known.sum(axis=0)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.where(known, values, 0.0).sum(axis=0) / count)

    largest = np.where(known, np.abs(d), -1.0).argmax(axis=0)
    components = [f"{axes[k].name}, {unit_written(axes[k].small)}" for k in some.tolist()]
    columns = [
        Quantity(components, kind="name", head="Component"),
        Quantity(count, head="Points", decimals=0),
        Quantity(mean(d), head="Mean difference"),
        Quantity(np.sqrt(mean(d**2)), head="rms difference"),
        Quantity(d[largest, np.arange(len(some))], head="Largest"),
        Quantity(np.sqrt(mean(sd**2)), head="rms of sd"),
        Quantity(np.sqrt(mean((d / sd) ** 2)), head="rms of test values", decimals=2),
    ]
    return Table("check-summary", "Check points together", columns, about("check-summary"))


def _compared(key: str, title: str, columns: Sequence[Quantity]) -> Table:
    tests = next(column.values for column in columns if column.head == "Test value")
    there = np.isfinite(named(columns, "d").values)
    return component_table(key, title, columns, there, tests, named(columns, "sd").values)


def stations_section(result: AdjustedNetwork) -> Section:
    tables: list[Table] = []
    layers, own = result._terms.layers, result.stations
    there, sd = np.isfinite(own.sd), result.photo_sd[own.rows]
    for caption, of in layers.items():
        columns = [
            network_tables.part(column, of) if column.axes else column
            for column in network_tables.stations(result)
        ]
        key, title = f"stations-{caption.lower()}", f"{caption} of photos"
        tables.append(component_table(key, title, columns, there[:, of], own.standardized[:, of], sd[:, of]))
    intro = about("stations", layers=[caption.lower() for caption in layers])
    return Section("stations", "Observed photos", [Layers("stations-layers", tables)], intro)


def beside_section(result: Result) -> Section:
    tables = []
    for kind, observed in result.kinds.items():
        if observed.used:
            key, title = f"observations-{kind}", kind[:1].upper() + kind[1:]
            there, columns = np.isfinite(observed.residuals), observations(observed)
            tables.append(component_table(key, title, columns, there, observed.standardized))
    parts = [Layers("beside-layers", tables)]
    return Section("observations", "Other observations", parts, about("observations"))


def images_section(result: AdjustedNetwork) -> Section:
    columns = network_tables.images(result)
    *_, residuals, redundancy, tests = columns
    sizes = np.nan_to_num(np.abs(tests.values)).max(axis=1, initial=0.0)
    rows = np.arange(len(sizes))
    if len(sizes) > IMAGES:
        rows = np.sort(np.argpartition(-sizes, IMAGES)[:IMAGES])
    note = "" if len(rows) == len(sizes) else about("images.largest", n=len(rows), all=len(sizes))
    columns[2:] = [
        replace(residuals, head="Residual {}", decimals=2),
        replace(redundancy, head="Redundancy {}"),
        replace(tests, head="w {}"),
    ]
    if result.loss:
        columns.append(Quantity(result.image_weights[result.used_images], member="weight_factor"))
    table = Table("observations", "Image observations", columns, note, shown=rows)
    return Section("images", "Image observations", [table], about("images"))


def _chosen_rows(
    kind: str, every: Indices, others: Iterable[int], orders: Sequence[Indices]
) -> tuple[Indices, str]:
    """Return listed photos or points: those of other tables, then the worst in each order; and a note."""
    if len(every) <= ALL:
        return every, ""
    rows = dict.fromkeys(others)
    for order in orders:
        rows |= dict.fromkeys(order[: max(SOME // len(orders), 1)].tolist())
    shown = np.intersect1d(every, np.array(list(rows), dtype=np.int64))
    return shown, about(f"{kind}.chosen", n=len(shown), all=len(every))


def photos_section(result: AdjustedNetwork, others: Iterable[int], intro: str = "") -> Section:
    """Return photos, first `others`: unknowns, and the fit of their images, in layers."""
    terms = result._terms
    fit = fit_of_images(result, result.given.image_photos, len(terms.photos))
    orders = [np.argsort(-np.nan_to_num(column, nan=-1.0), kind="stable") for column in fit.T[[3, 4]]]
    rows, note = _chosen_rows("photos", np.arange(len(terms.photos)), others, orders)
    own, *_, values, sd = network_tables.photos(result)
    tables = []
    for caption, of in terms.layers.items():
        columns = [own, network_tables.part(values, of), network_tables.part(sd, of)]
        columns += network_tables.plan_deviations(terms, result.photo_sd) if of.start == 0 else []
        by = result.photo_sd[:, of] if terms.split else None
        tables.append(Table(f"photos-{caption.lower()}", caption, columns, note, "", by, rows))
        own = replace(own, link=None)  # each name has one link target
    x, y = terms.image_axes
    columns = [
        own,
        Quantity(fit[:, 5].astype(int), head="Images"),
        Quantity(fit[:, :2], (x, y), "deviation", head="rms {}", decimals=2),
        Quantity(fit[:, 2], head="Mean redundancy", decimals=3),
        Quantity(fit[:, 3:4], (replace(x, name=""),), "deviation", head="Largest residual{}", decimals=2),
        Quantity(fit[:, 4], head="Largest |w|", decimals=2),
    ]
    tables.append(Table("photos-fit", "Fit of images", columns, note, shown=rows))
    return Section("photos", "Photos", [Layers("photos-layers", tables)], intro)


@np.errstate(all="ignore")
def fit_of_images(result: AdjustedNetwork, of: Indices, count: int) -> Floats:
    """Return (n, 6) rms x, y, mean redundancy, longest residual, largest |w|, images of owners."""
    used = result.used_images
    own = of[used]
    images = np.bincount(own, minlength=count)
    residuals = result.residuals[used]
    found = np.full((count, 6), np.nan)
    found[:, 5] = images
    for axis in (0, 1):
        found[:, axis] = np.sqrt(np.bincount(own, residuals[:, axis] ** 2, count) / images)
    found[:, 2] = np.bincount(own, 0.5 * np.add(*result.redundancy[used].T), count) / images
    for column, values in (
        (3, np.hypot(*residuals.T)),
        (4, np.nan_to_num(np.fmax(*np.abs(result.standardized[used]).T))),
    ):
        largest = np.zeros(count)
        np.maximum.at(largest, own, values)
        found[:, column] = np.where(images > 0, largest, np.nan)
    return found


def points_section(result: AdjustedNetwork, others: Iterable[int], intro: str = "") -> Section:
    """Return points with their standard deviations, first `others`."""
    terms, used = result._terms, np.flatnonzero(result.used_points)
    # An approximate number of metres per radian is sufficient for sorting.
    lengths = np.array([6.4e6 if axis.angle else 1.0 for axis in terms.point_axes])
    size = np.where(result.used_points, np.linalg.norm(result.point_sd * lengths, axis=1), np.nan)
    order = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")
    rows, note = _chosen_rows("points", used, others, [order])
    by = result.point_sd[used] if terms.split else None
    columns = [
        *network_tables.points(result),
        *network_tables.plan_deviations(terms, result.point_sd[used]),
        Quantity(result.point_covariances[used], member="covariance"),
    ]
    table = Table("points", "Points", columns, note, "", by, np.searchsorted(used, rows))
    return Section("points", "Points", [table], intro)
