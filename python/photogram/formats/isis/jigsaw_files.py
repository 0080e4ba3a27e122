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
from photogram.formats.isis.settings import PARAMETERS, Settings
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.network.motion import about
from photogram.network.trajectories import Trajectory
from photogram.results.trajectories import AdjustedTrajectory

KM = 1000.0
_WORDS = {"first": "ANGLES", "second": "VELOCITIES", "third": "ACCELERATIONS", "all": "ALL", "none": "NONE"}
_AXES = ("Latitude", "Longitude", "Radius")
_CELLS = ("initial", "correction", "final", "apriori sigma", "adj sigma")
_PARAMETER = "{:>6} {:>14}{:>22}{:>22}{:>22}{:>18}{:>18}"
_COEFFICIENTS = (("X", "Y", "Z"), ("RA", "DEC", "TWIST"))
_UNITS = ("km", "deg")


def jigsaw_files(outcome: Outcome) -> Mapping[str, bytes]:
    """Return the files by their names."""
    parts = (_head, _results, _image_summary, _images, _points_summary, _points)
    return {
        "images.csv": _table_of_images(outcome),
        "points.csv": _table_of_points(outcome),
        "residuals.csv": _table_of_residuals(outcome),
        "bundleout.txt": "".join(f"{line}\n" for part in parts for line in part(outcome)).encode(),
    }


def _rms(residuals: Floats) -> Floats:
    """Return (3,) root mean squares of (n, 2) residuals: samples, lines, both."""
    if not len(residuals):
        return np.full(3, np.nan)
    squares = (residuals**2).mean(axis=0)
    return np.sqrt([squares[0], squares[1], squares.mean()])


_Head = tuple[str, ...]  # The lines of the header of a column


def _table(columns: Sequence[tuple[_Head, Any]]) -> bytes:
    """Return a table with a header of several lines."""
    lines = [",".join(line) for line in zip(*(head for head, _ in columns), strict=True)]
    _, rows = csv_text({str(k): column for k, (_, column) in enumerate(columns)}).split(b"\n", 1)
    return ("\n".join(lines) + "\n").encode() + rows


def _triple(what: str, names: Sequence[str], units: str, values: Floats) -> list[tuple[_Head, Floats]]:
    """Return three columns of (n, 3) values."""
    heads = zip(names, units.split(), strict=True)
    return [((what, name, f"({unit})"), column) for (name, unit), column in zip(heads, values.T, strict=True)]


def _table_of_images(outcome: Outcome) -> bytes:
    used = outcome.result.used_images
    trajectories = outcome.result.trajectories
    found = {
        image: {
            (each.name, each.power): each
            for each in parameters(image, trajectories[image.solving.trajectory.name])
        }
        for image in outcome.contents.different
        if image.solving.trajectory.name in trajectories
    }
    names = max((list(own) for own in found.values()), key=len)
    rows = []
    for image, own in found.items():
        mine = outcome.rows[image]
        cells: list[Any] = [str(image.path), *_rms(outcome.residuals[mine[used[mine]]]).tolist()]
        for each in (own.get(name) for name in names):
            # Images with fixed poses have fewer coefficients.
            cells += each.cells if each else [None] * len(_CELLS)
        rows.append(cells)
    heads = [("Image", "Filename"), *(("rms", f"{what} res") for what in ("sample", "line", "total"))]
    heads += [(f"{name}(t{power})", what) for name, power in names for what in _CELLS]
    return _table(list(zip(heads, zip(*rows, strict=True), strict=True)))


def _table_of_points(outcome: Outcome) -> bytes:
    network, block = outcome.contents.network, outcome.result.block
    used = np.flatnonzero(outcome.result.used_points)
    rows = outcome.point_rows[used]
    rejected = np.bincount(network.point_of_measure[outcome.rejected], minlength=len(network.points))
    taken = block.image_points[outcome.result.used_images]
    places = outcome.latitudes[used]
    degrees = np.column_stack([np.rad2deg(places[:, :2]), places[:, 2] / KM])
    variances = np.einsum("nkk->nk", outcome.covariances[used])
    return _table(
        [
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
    )


def _table_of_residuals(outcome: Outcome) -> bytes:
    """Return the table of used measures, then rejected ones without residuals."""
    network, images = outcome.contents.network, {each.serial: each for each in outcome.contents.different}
    measures, used = network.measures, outcome.result.used_images
    rejected = np.flatnonzero(outcome.rejected)
    rows = np.concatenate([outcome.measure_rows[used], rejected])
    serials = [measures.serials[row] for row in measures.serial[rows].tolist()]
    found = np.column_stack([outcome.focal, outcome.residuals])[used]
    found = np.vstack([found, np.full((len(rejected), 4), np.nan)])
    points = [network.points.ids[row] for row in network.point_of_measure[rows].tolist()]
    return _table(
        [
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
    )


def _title(text: str) -> list[str]:
    return ["", text, "=" * len(text), ""]


def _facts(title: str, facts: Mapping[str, object]) -> list[str]:
    return [*_title(title), *(f"{name:>40}: {value}" for name, value in facts.items())]


def _head(outcome: Outcome) -> Iterator[str]:
    network, settings = outcome.contents.network, outcome.contents.settings
    yield from _facts(
        "JIGSAW: BUNDLE ADJUSTMENT",
        {
            "Network Id": network.network_id or "",
            "Network Filename": outcome.contents.path,
            "Network Description": network.description or "",
            "Target": network.target or "",
            "Linear Units": "kilometers",
            "Angular Units": "decimal degrees",
        },
    )
    yield from _facts("INPUT: SETTINGS", {name: _setting(settings, name) for name in PARAMETERS})


def _setting(settings: Settings, name: str) -> str:
    """Return the value of a setting in the words of jigsaw."""
    parameter = PARAMETERS[name]
    value = getattr(settings, parameter.field)
    if parameter.place is not None:
        value = value[parameter.place]
    if isinstance(value, bool):
        return "YES" if value else "NO"
    if parameter.field == "positions" and value == "first":
        return "POSITION"
    return "NONE" if value is None else _WORDS.get(value, str(value).upper())


def _results(outcome: Outcome) -> Iterator[str]:
    result, network = outcome.result, outcome.contents.network
    used, rejected = int(result.used_images.sum()), int(outcome.rejected.sum())
    coefficients = [each.given.coefficients for each in result.trajectories.values()]
    given = [each.deviations for own in coefficients for part in own for each in part]
    sd = np.concatenate([np.zeros(0), *given])
    points = result.block.point_sd[result.used_points]
    weighted = int(((points > 0) & np.isfinite(points)).sum()) + 3 * len(result.block.observations)
    variance = result.variance_of_unit_weight
    yield from _facts(
        "JIGSAW: RESULTS",
        {
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
            "Ignored Points": int(network.points.ignore.sum()),
        },
    )


def _image_summary(outcome: Outcome) -> Iterator[str]:
    used = outcome.result.used_images
    yield from _title("IMAGE MEASURES SUMMARY")
    yield f"{'Measures':>9}{'rms sample':>14}{'rms line':>14}{'rms':>14}  Image Serial Number"
    for image in outcome.contents.different:
        mine = outcome.rows[image][used[outcome.rows[image]]]
        sizes = "".join(f"{each:14.6f}" for each in _rms(outcome.residuals[mine]))
        yield f"{len(mine):9d}{sizes}  {image.serial}"


def _images(outcome: Outcome) -> Iterator[str]:
    yield from _title("IMAGE EXTERIOR ORIENTATION")
    trajectories = outcome.result.trajectories
    for image in outcome.contents.different:
        yield f"Image Full File Name: {image.path}"
        yield f"Image Serial Number: {image.serial}"
        yield _PARAMETER.format("Image", "", "Initial", "Total", "Final", "Initial", "Final")
        yield _PARAMETER.format("", "", "Value", "Correction", "Value", "Accuracy", "Accuracy")
        for own in parameters(image, trajectories[image.solving.trajectory.name]):
            unit = own.unit if own.power == 0 else f"{own.unit}/t^{own.power}"
            values = [f"{value:.10f}" for value in (own.initial, own.correction, own.final)]
            sigma = "N/A" if own.apriori == 0 else f"{own.adjusted:.10f}"
            yield _PARAMETER.format(own.name, f"({unit})", *values, own.apriori_text, sigma)
        yield ""


def _points_summary(outcome: Outcome) -> Iterator[str]:
    yield from _title("POINTS SUMMARY")
    yield (
        f"{'Label':<32}{'Status':>12}{'Rays':>6}{'RMS':>12}{'Latitude':>16}{'Longitude':>16}{'Radius':>16}"
        f"{'Sigma lat':>14}{'Sigma lon':>14}{'Sigma rad':>14}"
    )
    yield f"{'':<66}{'(dd)':>12}{'(dd)':>16}{'(km)':>16}{'(m)':>14}{'(m)':>14}{'(m)':>14}"
    for name, status, row in _rows_of_points(outcome):
        latitude, longitude, radius = outcome.latitudes[row]
        sigmas = "".join(f"{each:14.6f}" for each in outcome.local_sigmas[row])
        yield (
            f"{name:<32}{status:>12}{outcome.result.point_rays[row]:6d}{outcome.point_rms[row]:12.6f}"
            f"{np.rad2deg(latitude):16.10f}{np.rad2deg(longitude):16.10f}{radius / KM:16.8f}{sigmas}"
        )


def _rows_of_points(outcome: Outcome) -> Iterator[tuple[str, str, int]]:
    """Yield name, status and row of the used points."""
    types = outcome.contents.network.points.types
    for row in np.flatnonzero(outcome.result.used_points).tolist():
        status = POINT_TYPES[types[outcome.point_rows[row]]].upper()
        yield outcome.result.block.point_ids[row], status, row


def _points(outcome: Outcome) -> Iterator[str]:
    yield from _title("POINTS DETAIL")
    units = np.array([np.rad2deg(1.0), np.rad2deg(1.0), 1 / KM])
    for name, status, row in _rows_of_points(outcome):
        yield f"Label: {name}"
        yield f"Status: {status}"
        yield f"Rays: {outcome.result.point_rays[row]}"
        yield f"{'':>14}{'Initial':>20}{'Correction (m)':>18}{'Final':>20}{'Sigma (m)':>16}"
        before, after = outcome.before[row] * units, outcome.latitudes[row] * units
        columns = (before, outcome.corrections[row], after, outcome.local_sigmas[row])
        for axis, *own in zip(_AXES, *columns, strict=True):
            yield "{:>14}{:20.10f}{:18.6f}{:20.10f}{:16.8f}".format(axis.upper(), *own)
        yield ""


@dataclass(frozen=True)
class Parameter:
    """A coefficient of an image, X, Y, Z in km or angles in degrees.

    `apriori` is the a-priori standard deviation in metres or degrees: 0 if fixed, infinite if free;
    `adjusted` is the a-posteriori one in the unit.
    """

    name: str
    power: int
    unit: str
    initial: float
    correction: float
    apriori: float
    adjusted: float

    @property
    def cells(self) -> list[Any]:
        """The cells of a table, see `_CELLS`."""
        adjusted = "N/A" if self.apriori == 0 else repr(self.adjusted)
        return [self.initial, self.correction, self.final, self.apriori_text, adjusted]

    @property
    def apriori_text(self) -> str:
        """The a-priori standard deviation: FREE, N/A (fixed) or a number."""
        if self.apriori == 0:
            return "N/A"
        return repr(self.apriori) if np.isfinite(self.apriori) else "FREE"

    @property
    def final(self) -> float:
        """The adjusted value."""
        return self.initial + self.correction


def parameters(image: Image, adjusted: AdjustedTrajectory) -> list[Parameter]:
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
    found = []
    for part, (coefficients, values, sd, begun, middle, unit) in enumerate(kinds):
        given = np.array([each.deviations for each in coefficients]).reshape(-1, 3)
        start = np.array([each.position for each in coefficients]).reshape(-1, 3)
        solved = int(given.any(axis=1).sum())
        for axis, name in enumerate(_COEFFICIENTS[part]):
            if not solved:
                found.append(Parameter(name, 0, _UNITS[part], float(middle[axis] * unit), 0.0, 0.0, 0.0))
            for k in range(solved):
                change = float(values[k, axis] - start[k, axis])
                apriori = given[k, axis] * (degrees if part else 1.0)
                numbers = (begun[axis, k] * unit, change * unit, apriori, sd[k, axis] * unit)
                found.append(Parameter(name, k, _UNITS[part], *map(float, numbers)))
    return found
