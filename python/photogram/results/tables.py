"""The tables of results: named columns.

Every column that has a unit other than the linear unit of the object space says it in its name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.network.block import ATTITUDE_COLUMNS, position_columns
from photogram.results.features import Features
from photogram.results.network import AdjustedNetwork, Observed
from photogram.results.result import Result
from photogram.show.ways import columns_of

__all__ = ["images", "named", "observed", "table"]


@columns_of.register(Result)
def table(result: Result, what: str) -> dict[str, Any]:
    """Return the columns of one kind of thing: `_TABLES` lists them."""
    return _TABLES[what](result)


def _photos(result: Result) -> dict[str, Any]:
    """`photo`, position, attitude, and `sd_` of each; angles in degrees."""
    names = [*position_columns(result.block), *ATTITUDE_COLUMNS]
    values = np.hstack([result.photo_positions, result.photo_attitudes])
    photos = _ids(result.block.photo_ids)
    return {"photo": photos, **named(names, values), **named(names, result.photo_sd, "sd_")}


def _points(result: Result) -> dict[str, Any]:
    """`point`, `kind`, `rays`, coordinates, and `sd_` of each; angles in degrees."""
    used, names = result.used_points, position_columns(result.block)
    return {
        "point": _ids(result.block.point_ids)[used],
        "kind": result.point_kinds[used],
        "rays": result.point_rays[used],
        **named(names, result.point_positions[used]),
        **named(names, result.point_sd[used], "sd_"),
    }


def _images(result: Result) -> dict[str, Any]:
    """Residuals in the unit of image coordinates, redundancy numbers, standardized residuals."""
    block, used = result.block, result.used_images
    return {
        "photo": _ids(block.photo_ids)[block.image_photos[used]],
        "point": _ids(block.point_ids)[block.image_points[used]],
        **images(result, block.image_unit),
    }


def _check_points(result: Result) -> dict[str, Any]:
    """`d_`, adjusted minus given; standard deviations of both (`sd_`, `given_sd_`); test and probability."""
    checks, names = result.check_points, position_columns(result.block)
    statistic, p = checks.statistics
    return {
        "point": _ids(checks.names),
        **named(names, checks.differences, "d_"),
        **named(names, checks.sd, "sd_"),
        **named(names, checks.given_sd, "given_sd_"),
        "assumed": checks.assumed,
        "statistic": statistic,
        "probability": p,
    }


def _control(result: Result) -> dict[str, Any]:
    control = result.control
    points = _ids(result.block.point_ids)[control.rows]
    return {"point": points, **observed(position_columns(result.block), control)}


def _stations(result: Result) -> dict[str, Any]:
    stations = result.stations
    names = [*position_columns(result.block), *ATTITUDE_COLUMNS]
    return {"photo": _ids(result.block.photo_ids)[stations.rows], **observed(names, stations)}


def _beside_images(result: Result) -> dict[str, Any]:
    """Name what there is of each component: one row; what was not observed or left out has none."""
    rows = [
        (each.kind, each.names[i], each.components[k], each.units[k], *(values[i, k] for values in numbers))
        for each in result.kinds.values()
        for numbers in [(each.sd, each.residuals, each.redundancy, each.standardized)]
        for i, k in np.argwhere(~np.isnan(each.residuals)).tolist()
    ]
    names = ("kind", "of", "component", "unit", "sd", "residual", "redundancy", "standardized")
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def _cameras(result: Result) -> dict[str, Any]:
    """Name what there is of each parameter: `sd_given` is infinite for free ones and 0 for those held."""
    rows = [
        (each.name, each.camera.model, name, each.camera.unit_of(name), *numbers)
        for each in result.cameras
        for name, *numbers in zip(
            each.names,
            each.given.values,
            each.given.deviations,
            each.values,
            each.sd,
            each.redundancy,
            strict=True,
        )
    ]
    names = ("camera", "model", "parameter", "unit", "given", "sd_given", "value", "sd", "redundancy")
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def _unknowns(result: Result) -> dict[str, Any]:
    """Name what there is of each component: `sd_given` is infinite for free ones and 0 for those held."""
    rows = [
        (each.kind, each.name, component, unit, *numbers)
        for each in result.unknowns
        for component, unit, *numbers in zip(
            each.components,
            each.units,
            each.given.deviations,
            each.values,
            each.change,
            each.sd,
            each.redundancy,
            each.standardized,
            strict=True,
        )
    ]
    names = ("kind", "unknown", "component", "unit", "sd_given", "value", "change", "sd", "redundancy")
    return {name: [row[k] for row in rows] for k, name in enumerate((*names, "standardized"))}


def _features(result: Result) -> dict[str, Any]:
    """`value`, `sd`, `k`, and `expanded`, k times sd, of each quantity."""
    return (result.features or Features(())).columns()


def _deviations(result: Result) -> dict[str, Any]:
    """Distances of points from their features, in each direction, with `sd`."""
    return (result.features or Features(())).deviation_columns()


_TABLES: dict[str, Callable[[Result], dict[str, Any]]] = {
    "photo": _photos,
    "point": _points,
    "image": _images,
    "check": _check_points,
    "control": _control,
    "station": _stations,
    "observation": _beside_images,
    "camera": _cameras,
    "unknown": _unknowns,
    "feature": _features,
    "deviation": _deviations,
}


def images(result: AdjustedNetwork, unit: str) -> dict[str, Any]:
    """Name what there is of the image observations that took part."""
    used = result.used_images
    return {
        **named((f"residual_x_{unit}", f"residual_y_{unit}"), result.residuals[used]),
        **named(("redundancy_x", "redundancy_y"), result.redundancy[used]),
        **named(("standardized_x", "standardized_y"), result.standardized[used]),
    }


def observed(names: Sequence[str], given: Observed) -> dict[str, Any]:
    """Name what there is of observed components: differences and `sd_` in their units, plain numbers without.

    Differences are adjusted minus given, as of check points, and test values have their sign. Where `sd_`
    is 0 a component is fixed, where it is infinite it is not observed.
    """
    plain = [name.removesuffix("_deg").removesuffix("_rad").removesuffix("_px") for name in names]
    return {
        **named(names, given.differences, "d_"),
        **named(names, given.sd, "sd_"),
        **named(plain, given.redundancy, "redundancy_"),
        **named(plain, given.tests, "standardized_"),
    }


def named(names: Sequence[str], values: Floats, prefix: str = "") -> dict[str, Any]:
    """Name the columns of an array, in degrees where the name says so."""
    with np.errstate(over="ignore"):  # infinite then
        return {
            prefix + name: np.degrees(column) if name.endswith("_deg") else column
            for name, column in zip(names, values.T, strict=True)
        }


def _ids(names: Sequence[str]) -> NDArray[np.object_]:
    return np.array(names, dtype=object)
