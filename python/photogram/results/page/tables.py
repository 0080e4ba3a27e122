"""Tables of a block: control, check points, observations beside images, photos, points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.results.kinds import ObservedKind
from photogram.results.network import Observed
from photogram.results.page.frame import block_frame, degrees
from photogram.results.page.observed import LISTED, Links, observed_table
from photogram.results.result import Result
from photogram.results.weakest import weakest_photos, weakest_points
from photogram.show.angles import ARCSEC
from photogram.show.page import Cell, Column, Layers, Row, Section, Table

__all__ = [
    "beside_section",
    "check_section",
    "control_section",
    "photos_section",
    "points_section",
    "stations_section",
]

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


def control_section(result: Result) -> Section:
    """Return control: prior, posterior, difference, test."""
    block, frame = result.block, block_frame(result)
    table = observed_table(
        "Control points",
        "point",
        block.point_ids,
        frame,
        result.control,
        block.point_positions,
        result.point_positions,
        result.point_sd,
    )
    unheld = np.isfinite(block.point_positions) & ~np.isfinite(block.point_sd)
    unheld &= np.isfinite(block.point_sd).any(axis=1, keepdims=True) & result.used_points[:, np.newaxis]
    others = _compared(result, unheld, "Components of control that are not held")
    intro = (
        "What was given for the control points, and what the adjustment made of it. A component with a"
        " redundancy"
        " number near 0 is not checked by the rest of the network: an error of it goes into the result"
        " unseen."
    )
    return Section("control", "Control points", [each for each in (table, others) if each], intro)


def check_section(result: Result) -> Section:
    """Return check points with what they say as a whole."""
    check = (result.used_points & (result.point_kinds == "check"))[:, np.newaxis] & np.isfinite(
        result.point_differences
    )
    table = _compared(result, check, "Check points one by one")
    parts = [_check_summary(result, check), table] if table else []
    intro = (
        "Points with known coordinates that took no part in the adjustment: the independent proof of"
        " its accuracy."
        " The test value is the difference over its standard deviation: that of the adjusted coordinate and"
        " that of the given one together."
    )
    return Section("check-points", "Check points", parts, intro)


def _check_summary(result: Result, check: np.ndarray) -> Table:
    frame, checks = block_frame(result), result.check_points
    check, all_differences = check[checks.rows], checks.differences
    sd = np.hypot(checks.sd, checks.given_sd)
    rows: list[Row] = []
    for k, (name, unit, factor) in enumerate(zip(frame.names, frame.units, frame.factors, strict=True)):
        own = check[:, k]
        if not own.any():
            continue
        differences, deviations = all_differences[own, k] * factor, sd[own, k] * factor
        with np.errstate(all="ignore"):
            tests = differences / deviations
            rows.append(
                [
                    f"{name}, {unit}",
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


def _compared(result: Result, which: np.ndarray, caption: str) -> Table | None:
    """Return supplied and adjusted coordinates of chosen components."""
    places = np.argwhere(which)
    if not len(places):
        return None
    block, frame = result.block, block_frame(result)
    differences, sd, checks = result.point_differences, result.point_sd, result.check_points
    given_sd = np.full_like(sd, np.nan)
    given_sd[checks.rows] = checks.given_sd
    with np.errstate(all="ignore"):
        tests = (differences / np.hypot(sd, np.nan_to_num(given_sd)))[tuple(places.T)]
    chosen = np.sort(np.argsort(-np.nan_to_num(np.abs(tests), nan=-1.0), kind="stable")[:LISTED])
    own = np.where(which, sd, np.nan)
    values, few = frame.value_decimals(own), [count + 1 for count in frame.decimals(own)]
    rows: list[Row] = []
    mixed = len(set(frame.units)) > 1
    for (point, k), test in zip(places[chosen].tolist(), tests[chosen].tolist(), strict=True):
        factor = float(frame.factors[k])
        rows.append(
            [
                Links.point(block.point_ids[point], point),
                f"{frame.names[k]}, {frame.units[k]}" if mixed else frame.names[k],
                frame.cell(k, float(block.point_positions[point, k]), values[k]),
                frame.cell(k, float(result.point_positions[point, k]), values[k]),
                frame.difference(k, float(differences[point, k]), few[k]),
                float(sd[point, k]) * factor,
                float(given_sd[point, k]) * factor,
                test,
            ]
        )
    unit = "" if mixed else frame.units[0]
    columns = (
        Column("Point", text=True),
        Column("Component", text=True),
        Column("Given", unit, decimals=max(values)),
        Column("Adjusted", unit, decimals=max(values)),
        Column("Adjusted - given", unit, decimals=max(few)),
        Column("sd adjusted", unit, figures=3),
        Column("sd given", unit, figures=3),
        Column("Test value", decimals=2),
    )
    note = (
        "" if len(rows) == len(places) else f"The {len(rows)} of {len(places)} with the largest test values."
    )
    return Table(caption, columns, rows, note)


def stations_section(result: Result) -> Section:
    """Return positions and attitudes of photos as observations."""
    block, given = result.block, result.stations
    if not len(given.rows):
        return Section("stations", "Observed photos", [])
    found = []
    for part, frame, caption in (
        (slice(0, 3), block_frame(result), "Positions"),
        (slice(3, 6), degrees(), "Attitudes"),
    ):
        own = Observed(
            given.rows,
            given.residuals[:, part],
            given.sd[:, part],
            given.redundancy[:, part],
            given.standardized[:, part],
        )
        adjusted = np.hstack([result.photo_positions, result.photo_attitudes])[:, part]
        observed = adjusted + result.photo_residuals[:, part]
        found.append(
            observed_table(
                f"{caption} of photos",
                "photo",
                block.photo_ids,
                frame,
                own,
                observed,
                adjusted,
                result.photo_sd[:, part],
            )
        )
    tables = [each for each in found if each]
    parts = [Layers("stations-layers", tables)] if len(tables) > 1 else tables
    return Section(
        "stations",
        "Observed photos",
        parts,
        "Positions and attitudes that were given with standard deviations.",
    )


def beside_section(result: Result) -> Section:
    """Return observations beside images, kind by kind."""
    tables = [_kind_table(each) for each in result.kinds.values() if each.used]
    parts = [Layers("beside-layers", tables)] if len(tables) > 1 else tables
    intro = "Observations beside images: observed minus adjusted, with their tests."
    return Section("observations", "Other observations", parts, intro)


def _kind_table(kind: ObservedKind) -> Table:
    places = np.argwhere(np.isfinite(kind.residuals))
    tests = np.nan_to_num(np.abs(kind.standardized[tuple(places.T)]), nan=-1.0)
    chosen = np.sort(np.argsort(-tests, kind="stable")[:LISTED])
    units = ["″" if unit == "rad" else unit for unit in kind.units]
    factors = [1.0 / ARCSEC if unit == "rad" else 1.0 for unit in kind.units]
    rows: list[Row] = [
        [
            kind.names[i],
            kind.components[k],
            float(kind.residuals[i, k]) * factors[k],
            float(kind.sd[i, k]) * factors[k],
            units[k],
            float(kind.redundancy[i, k]),
            float(kind.standardized[i, k]),
        ]
        for i, k in places[chosen].tolist()
    ]
    columns = (
        Column("Of", text=True),
        Column("Component", text=True),
        Column("Residual", figures=3),
        Column("sd given", figures=3),
        Column("Unit", text=True),
        Column("Redundancy", decimals=3),
        Column("Test value w", decimals=2),
    )
    note = (
        "" if len(rows) == len(places) else f"The {len(rows)} of {len(places)} with the largest test values."
    )
    return Table(kind.kind[:1].upper() + kind.kind[1:], columns, rows, note)


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


def photos_section(result: Result, named: Iterable[int]) -> Section:
    """Return photos: positions, attitudes, and how their images fit, in layers."""
    block = result.block
    used = result.used_images
    photos = block.image_photos[used]
    images = np.bincount(photos, minlength=len(block.photo_ids))
    fit = _fit_of_photos(result)
    weak = [block.photo_ids.index(each.photo) for each in weakest_photos(result)]
    condition = {each.photo: each.condition for each in weakest_photos(result)}
    orders = [np.argsort(-np.nan_to_num(column, nan=-1.0), kind="stable") for column in fit.T[[3, 4]]]
    rows, every = chosen_rows(len(block.photo_ids), [*weak, *named], orders)
    note = (
        ""
        if every
        else f"{len(rows)} of {len(block.photo_ids)}: those that other tables name, the largest"
        " residuals and test values, and the weakest. The table of photos has all."
    )
    place, turn = block_frame(result), degrees()
    sd = result.photo_sd
    tables = []
    for frame, values, deviations, caption in (
        (place, result.photo_positions, sd[:, :3], "Positions"),
        (turn, result.photo_attitudes, sd[:, 3:], "Attitudes"),
    ):
        decimals = frame.value_decimals(deviations)
        few = frame.decimals(deviations)
        body: list[Row] = [
            [
                Cell(block.photo_ids[row], id=f"photo-{row}" if frame is place else ""),
                *frame.cells(values[row], decimals),
                *frame.differences(deviations[row]),
            ]
            for row in rows.tolist()
        ]
        tables.append(
            Table(
                caption,
                [Column("Photo", text=True), *frame.values(decimals), *frame.deviations(few)],
                body,
                note,
            )
        )
    unit, factor = ("µm", 1000.0) if block.image_unit == "mm" else ("px", 1.0)
    columns = (
        Column("Photo", text=True),
        Column("Images", decimals=0),
        Column("rms x", unit, decimals=2),
        Column("rms y", unit, decimals=2),
        Column("Mean redundancy", decimals=3),
        Column("Largest residual", unit, decimals=2),
        Column("Largest |w|", decimals=2),
        Column("Condition of the pose", figures=3),
    )
    body = [
        [
            block.photo_ids[row],
            int(images[row]),
            *(float(each) * factor for each in fit[row, :2]),
            float(fit[row, 2]),
            float(fit[row, 3]) * factor,
            float(fit[row, 4]),
            condition.get(block.photo_ids[row]),
        ]
        for row in rows.tolist()
    ]
    tables.append(
        Table(
            "Fit of images",
            columns,
            body,
            f"{note} {CONDITION_NOTE}".strip(),
        )
    )
    return Section("photos", "Photos", [Layers("photos-layers", tables)], _datum(result))


def _datum(result: Result) -> str:
    return (
        f"Coordinates and standard deviations refer to the datum that is {result.datum}."
        if not result.datum.is_chosen
        else f"Datum: {result.datum}."
    )


@np.errstate(all="ignore")
def _fit_of_photos(result: Result) -> Floats:
    """Return (P, 5) rms x and y, mean redundancy, longest residual, largest |w| of images of photos."""
    used = result.used_images
    photos, count = result.block.image_photos[used], len(result.block.photo_ids)
    images = np.bincount(photos, minlength=count)
    residuals = result.residuals[used]
    found = np.full((count, 5), np.nan)
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


def points_section(result: Result, named: Iterable[int]) -> Section:
    """Return points with their standard deviations."""
    block, frame, kinds = result.block, block_frame(result), result.point_kinds
    ranks = {name: row for row, name in enumerate(block.point_ids)}
    weak = {ranks[each.point]: each for each in weakest_points(result)}
    deviations = result.point_sd
    size = np.where(result.used_points, np.linalg.norm(deviations * _lengths(result), axis=1), np.nan)
    order = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")
    used = np.flatnonzero(result.used_points)
    if len(used) <= ALL:
        rows, every = used, True
    else:
        rows, every = chosen_rows(len(block.point_ids), [*weak, *named], [order])
        rows = rows[result.used_points[rows]]
    decimals, few = frame.value_decimals(deviations[used]), frame.decimals(deviations[used])
    body: list[Row] = [
        [
            Cell(block.point_ids[row], id=f"point-{row}"),
            str(kinds[row]),
            int(result.point_rays[row]),
            *frame.cells(result.point_positions[row], decimals),
            *frame.differences(deviations[row]),
            weak[row].ratio if row in weak else None,
        ]
        for row in rows.tolist()
    ]
    columns = [
        Column("Point", text=True),
        Column("Kind", text=True),
        Column("Rays", decimals=0),
        *frame.values(decimals),
        *frame.deviations(few),
        Column("Largest over smallest sd", figures=3),
    ]
    few_of = f"{len(rows)} of {len(used)}: those that other tables name, those of the largest sd"
    note = f"{'' if every else few_of + ', and the weakest. The table of points has all. '}{RATIO_NOTE}"
    return Section("points", "Points", [Table("Points", columns, body, note)] if body else [], _datum(result))


def _lengths(result: Result) -> Floats:
    """Return what makes lengths of standard deviations, near enough to sort by."""
    if result.block.geographic:
        return np.array([6.4e6, 6.4e6, 1.0])
    return np.ones(3)
