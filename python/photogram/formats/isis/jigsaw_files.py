"""Result files of jigsaw: `bundleout.txt` and CSV tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.csm.isd import to_angles
from photogram.formats.csm.photos import to_camera
from photogram.formats.isis.network import POINT_TYPES
from photogram.formats.isis.outcome import Image, Outcome
from photogram.formats.isis.solving import PARAMETERS
from photogram.io.csv_text import csv_text
from photogram.network.motion import about
from photogram.network.trajectories import Trajectory
from photogram.results.trajectories import AdjustedTrajectory
from photogram.show.forms import table_text
from photogram.show.page import Column, Table

KM = 1000.0
_AXES = ("Latitude", "Longitude", "Radius")
_CELLS = ("initial", "correction", "final", "apriori sigma", "adj sigma")
_COEFFICIENTS = (("X", "Y", "Z"), ("RA", "DEC", "TWIST"))
_UNITS = ("km", "deg")

_Coefficient = tuple[str, int, str, float, float, float, str, float | str]
"""Name, power, unit (km or degrees), initial value, correction, final value; a-priori standard deviation in
metres or degrees, `N/A` if fixed, `FREE` if free; a-posteriori one in the unit, `N/A` if fixed.
"""
_Columns = Sequence[tuple[tuple[str, ...], Any]]  # Columns with the lines of their header


def jigsaw_files(outcome: Outcome) -> Mapping[str, bytes]:
    """Return the files by their names."""
    images = {
        image: parameters(image, outcome.result.trajectories[image.solving.trajectory.name])
        for image in outcome.contents.different
    }
    points = _points(outcome)
    return {
        "images.csv": _table(_images(outcome, images)),
        "points.csv": _table(points),
        "residuals.csv": _table(_residuals(outcome)),
        "bundleout.txt": "".join(f"{line}\n" for line in _report(outcome, images, points)).encode(),
    }


def _table(columns: _Columns) -> bytes:
    """Return a CSV table with a header of several lines."""
    lines = [",".join(line) for line in zip(*(head for head, _ in columns), strict=True)]
    _, rows = csv_text({str(k): column for k, (_, column) in enumerate(columns)}).split(b"\n", 1)
    return ("\n".join(lines) + "\n").encode() + rows


def _rms(outcome: Outcome, image: Image) -> list[float]:
    """Return root mean square residuals of an image: samples, lines, both."""
    rows = outcome.rows[image]
    residuals = outcome.residuals[rows[outcome.result.used_images[rows]]]
    if not len(residuals):
        return [np.nan] * 3
    squares = (residuals**2).mean(axis=0)
    return list(np.sqrt([*squares, squares.mean()]))


def _images(outcome: Outcome, images: Mapping[Image, list[_Coefficient]]) -> _Columns:
    # Images with fixed poses have fewer coefficients.
    names = [each[:2] for each in max(images.values(), key=len)]
    rows = []
    for image, own in images.items():
        cells = {each[:2]: each[3:] for each in own}
        of_names = [cells.get(name, (None,) * len(_CELLS)) for name in names]
        rows.append([str(image.path), *_rms(outcome, image), *sum(of_names, ())])
    heads = [("Image", "Filename"), *(("rms", f"{what} res") for what in ("sample", "line", "total"))]
    heads += [(f"{name}(t{power})", what) for name, power in names for what in _CELLS]
    return list(zip(heads, zip(*rows, strict=True), strict=True))


def _triple(what: str, names: Sequence[str], units: str, values: Floats) -> list[tuple[Any, Floats]]:
    """Return three columns of (n, 3) values."""
    heads = zip(names, units.split(), strict=True)
    return [((what, name, f"({unit})"), column) for (name, unit), column in zip(heads, values.T, strict=True)]


def _points(outcome: Outcome) -> _Columns:
    network, block = outcome.contents.network, outcome.result.block
    used = np.flatnonzero(outcome.result.used_points)
    rows = outcome.point_rows[used]
    rejected = np.bincount(network.point_of_measure[outcome.rejected], minlength=len(network.points))
    taken = block.image_points[outcome.result.used_images]
    places = outcome.latitudes[used]
    degrees = np.column_stack([np.rad2deg(places[:, :2]), places[:, 2] / KM])
    variances = np.einsum("nkk->nk", outcome.covariances[used])
    return [
        (("", "Point", "Label"), [network.points.ids[row] for row in rows.tolist()]),
        (("", "Point", "Status"), [POINT_TYPES[each].upper() for each in network.points.types[rows]]),
        (("", "Accepted", "Measures"), np.bincount(taken, minlength=len(block.point_ids))[used]),
        (("", "Rejected", "Measures"), rejected[rows]),
        (("", "Residual", "RMS"), outcome.point_rms[used]),
        *_triple("3-d", _AXES, "dd dd km", degrees),
        *_triple("Sigma", _AXES, "m m m", outcome.local_sigmas[used]),
        *_triple("Correction", _AXES, "m m m", outcome.corrections[used]),
        *_triple("Coordinate", "XYZ", "km km km", outcome.xyz[used] / KM),
        *_triple("Sigma", "XYZ", "m m m", np.sqrt(np.maximum(variances, 0.0))),
    ]


def _residuals(outcome: Outcome) -> _Columns:
    """Return columns of used measures, then rejected ones without residuals."""
    network, images = outcome.contents.network, {each.serial: each for each in outcome.contents.different}
    measures, used = network.measures, outcome.result.used_images
    rejected = np.flatnonzero(outcome.rejected)
    rows = np.concatenate([outcome.measure_rows[used], rejected])
    serials = [measures.serials[row] for row in measures.serial[rows].tolist()]
    found = np.column_stack([outcome.focal, outcome.residuals])[used]
    found = np.vstack([found, np.full((len(rejected), 4), np.nan)])
    points = [network.points.ids[row] for row in network.point_of_measure[rows].tolist()]
    return [
        (("", "Point", "Label"), points),
        (("", "Image", "Filename"), [str(images[serial].path) for serial in serials]),
        (("", "Image", "Serial Number"), serials),
        (("x image", "coordinate", "(mm)"), found[:, 0]),
        (("y image", "coordinate", "(mm)"), found[:, 1]),
        (("Measured", "Sample", "(pixels)"), measures.sample[rows]),
        (("Measured", "Line", "(pixels)"), measures.line[rows]),
        (("sample", "residual", "(pixels)"), found[:, 2]),
        (("line", "residual", "(pixels)"), found[:, 3]),
        (("Residual Vector", "Magnitude", "(pixels)"), np.hypot(*found[:, 2:].T)),
        (("", "", "Rejected"), [""] * (len(rows) - len(rejected)) + ["*"] * len(rejected)),
    ]


def _report(outcome: Outcome, images: Mapping[Image, list[_Coefficient]], points: _Columns) -> Iterator[str]:
    """Yield the lines of `bundleout.txt`."""
    network, settings = outcome.contents.network, outcome.contents.settings
    facts: dict[str, dict[str, object]] = {
        "JIGSAW: BUNDLE ADJUSTMENT": {
            "Network Id": network.network_id or "",
            "Network Filename": outcome.contents.path,
            "Network Description": network.description or "",
            "Target": network.target or "",
            "Linear Units": "kilometers",
            "Angular Units": "decimal degrees",
        },
        "INPUT: SETTINGS": {name: own.text(settings, name) for name, own in PARAMETERS.items()},
        "JIGSAW: RESULTS": _counts(outcome),
    }
    for title, values in facts.items():
        yield from _title(title)
        yield from (f"{name:>40}: {value}" for name, value in values.items())
    yield from _title("IMAGE MEASURES SUMMARY")
    used = outcome.result.used_images
    counts = [int(used[outcome.rows[image]].sum()) for image in images]
    sizes = zip(*(_rms(outcome, image) for image in images), strict=True)
    heads = (("rms sample",), ("rms line",), ("rms",))
    columns = [(("Measures",), counts), *zip(heads, sizes, strict=True)]
    yield from _lines([*columns, (("Image Serial Number",), [image.serial for image in images])])
    yield from _title("IMAGE EXTERIOR ORIENTATION")
    for image, own in images.items():
        yield f"Image Full File Name: {image.path}"
        yield f"Image Serial Number: {image.serial}"
        name, power, unit, *cells = zip(*own, strict=True)
        units = [f"({each}{f'/t^{k}' if k else ''})" for each, k in zip(unit, power, strict=True)]
        names = [(head,) for head in ("Image", "", *_CELLS)]
        yield from [*_lines(list(zip(names, (name, units, *cells), strict=True))), ""]
    yield from [*_title("POINTS"), *_lines(points)]


def _title(text: str) -> list[str]:
    return ["", text, "=" * len(text), ""]


def _lines(columns: _Columns) -> list[str]:
    """Return a table as text, with ten decimals."""
    made = [
        Column(
            " ".join(head).strip(),
            [f"{each:.10f}" if isinstance(each, float) else str(each) for each in values],
            text=isinstance(values[0], str) if len(values) else False,
        )
        for head, values in columns
    ]
    return table_text(Table("", made))


def _counts(outcome: Outcome) -> dict[str, object]:
    result = outcome.result
    used, rejected = int(result.used_images.sum()), int(outcome.rejected.sum())
    coefficients = [each.given.coefficients for each in result.trajectories.values()]
    sd = np.array([sd for own in coefficients for part in own for each in part for sd in each.deviations])
    points = result.block.point_sd[result.used_points]
    weighted = int(((points > 0) & np.isfinite(points)).sum()) + 3 * len(result.block.observations)
    variance = result.variance_of_unit_weight
    return {
        "Images": len(outcome.contents.different),
        "Points": int(result.used_points.sum()),
        "Total Measures": used + rejected,
        "Total Observations": 2 * (used + rejected),
        "Good Observations": 2 * used,
        "Rejected Observations": 2 * rejected,
        "Constrained Point Parameters": weighted,
        "Constrained Image Parameters": int(((sd > 0) & np.isfinite(sd)).sum()),
        "Unknowns": int((sd > 0).sum() + (points > 0).sum()),
        "Degrees of Freedom": f"{result.degrees_of_freedom:g}",
        "Iterations": len(result.iterations),
        "Status": result.status,
        "Sigma0": "N/A" if variance is None else f"{np.sqrt(variance):.10f}",
        "Ignored Points": int(outcome.contents.network.points.ignore.sum()),
    }


def parameters(image: Image, adjusted: AdjustedTrajectory) -> list[_Coefficient]:
    """Return the coefficients of an image that are free or of degree 0."""
    solving, own = image.solving, adjusted.given
    # The inertial position and angles at the centre of the tables
    isd, still = image.supported.isd, Trajectory(own.name, own.table)
    tables = (isd.position.times, isd.pointing.times)
    (places, _), (_, turned) = (about(still, float(times[0] + times[-1]) / 2) for times in tables)
    angles = to_angles(to_camera(isd, turned[np.newaxis]))[0]
    degrees = float(np.rad2deg(1.0))
    kinds = (
        (own.coefficients[0], adjusted.position, adjusted.position_sd, solving.position, places, 1 / KM),
        (own.coefficients[1], adjusted.rotation, adjusted.rotation_sd, solving.angles, angles, degrees),
    )
    found = list[_Coefficient]()
    for part, (coefficients, values, sd, begun, middle, unit) in enumerate(kinds):
        given = np.array([each.deviations for each in coefficients]).reshape(-1, 3)
        start = np.array([each.position for each in coefficients]).reshape(-1, 3)
        solved = int(given.any(axis=1).sum())
        for axis, name in enumerate(_COEFFICIENTS[part]):
            if not solved:
                initial = float(middle[axis] * unit)
                found.append((name, 0, _UNITS[part], initial, 0.0, initial, "N/A", "N/A"))
            for k in range(solved):
                initial = float(begun[axis, k] * unit)
                change = float(values[k, axis] - start[k, axis]) * unit
                apriori = float(given[k, axis] * (degrees if part else 1.0))
                text = "N/A" if apriori == 0 else repr(apriori) if np.isfinite(apriori) else "FREE"
                deviation = "N/A" if apriori == 0 else float(sd[k, axis] * unit)
                numbers = (initial, change, initial + change, text, deviation)
                found.append((name, k, _UNITS[part], *numbers))
    return found
