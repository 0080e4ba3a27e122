"""Adjusted control networks: results in pixels and body axes, rejection, and files of jigsaw."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.arrays import rows_of_each
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.formats.csm.isd import to_angles
from photogram.formats.csm.photos import SupportedImage, to_camera
from photogram.formats.isis.network import POINT_TYPES, ControlNetwork
from photogram.formats.isis.solving import PARAMETERS, Settings, Solving
from photogram.formats.project import Project
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.geometry import Cartesian, local_frames
from photogram.network.motion import about, focal_images
from photogram.network.trajectories import Trajectory
from photogram.results.footprints import metric_covariances
from photogram.results.result import Result
from photogram.results.trajectories import AdjustedTrajectory
from photogram.show.forms import table_text
from photogram.show.page import Column, Table
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Outcome:
    contents: PlanetaryContents
    result: Result

    @cached_property
    def point_rows(self) -> Indices:
        """(n,) the network point of each point of the block."""
        places = {name: row for row, name in enumerate(self.contents.network.points.ids)}
        return np.array([places[name] for name in self.result.block.point_ids], dtype=np.int64)

    @cached_property
    def image_serials(self) -> Indices:
        """(m,) serial number of each observation, as index in the measures of the network."""
        block, contents = self.result.block, self.contents
        rows = {serial: row for row, serial in enumerate(contents.network.measures.serials)}
        of_photo = [rows[contents.images[name].serial] for name in block.photo_ids]
        return np.array(of_photo, dtype=np.int64)[block.image_photos]

    @cached_property
    def rows(self) -> dict[Image, Indices]:
        """The block observations that are measures in each image of the network."""
        serials = self.contents.network.measures.serials
        own = dict(zip(serials, rows_of_each(self.image_serials, len(serials)), strict=True))
        return {image: own[image.serial] for image in self.contents.different}

    @cached_property
    def keys(self) -> Indices:
        """(M,) numbers of image and point of the measures of the network."""
        network = self.contents.network
        return network.measures.serial.astype(np.int64) * len(network.points) + network.point_of_measure

    @cached_property
    def measure_rows(self) -> Indices:
        """(m,) network measure of each observation: first of its point in the image."""
        counting = np.flatnonzero(~self.contents.network.is_ignored)
        known, first = np.unique(self.keys[counting], return_index=True)
        own = self.image_serials * len(self.contents.network.points)
        own += self.point_rows[self.result.block.image_points]
        return np.asarray(counting[first[np.searchsorted(known, own)]])

    @cached_property
    def rejected(self) -> Bools:
        """(M,) measures of the network that are not ignored and were rejected."""
        used = self.keys[self.measure_rows[self.result.used_images]]
        return np.asarray(~self.contents.network.is_ignored & ~np.isin(self.keys, used))

    @cached_property
    def residuals(self) -> Floats:
        """(m, 2) measured minus computed sample and line, in pixels."""
        found = np.full((len(self.result.residuals), 2), np.nan)
        for image, mine in self.rows.items():
            isd = image.supported.isd
            turned = np.linalg.inv(isd.detector.planes["isis"].matrix)
            found[mine] = self.result.residuals[mine] * isd.axes[:2] @ turned.T / isd.detector.summing
        return found

    @cached_property
    def focal(self) -> Floats:
        """(m, 2) measured x and y without distortion, in camera axes, millimetres."""
        found = focal_images(self.result.block).copy()
        for image, mine in self.rows.items():
            found[mine] *= image.supported.isd.axes[:2]
        return found

    @cached_property
    def xyz(self) -> Floats:
        """(n, 3) adjusted points, fixed to the body, metres; NaN if omitted."""
        return Cartesian(self.result.block.spheroid).positions(np.array(self.result.point_positions))

    @cached_property
    def latitudes(self) -> Floats:
        """(n, 3) latitude, longitude from 0 (radians), and radius (metres)."""
        return spherical(self.xyz)

    @cached_property
    def corrections(self) -> Floats:
        """(n, 3) corrections of latitude, longitude and radius, metres."""
        latitude, _, radius = self.latitudes.T
        change = self.latitudes - spherical(self.contents.starts[self.point_rows])
        # Differences across the prime meridian.
        change[:, 1] = (change[:, 1] + np.pi) % (2 * np.pi) - np.pi
        metres = np.column_stack([radius, radius * np.cos(latitude), np.ones_like(radius)])
        return np.asarray(change * metres)

    @cached_property
    def covariances(self) -> Floats:
        """(n, 3, 3) a-posteriori covariances of X, Y, Z, square metres."""
        own, axes = metric_covariances(self.result), self.axes
        return own if self.result.block.spheroid is None else axes.transpose(0, 2, 1) @ own @ axes

    @property
    def axes(self) -> Floats:
        """(n, 3, 3) east, north and up at the points, as rows."""
        return local_frames(self.latitudes[:, [1, 0, 2]])


def spherical(xyz: Floats) -> Floats:
    """Return (n, 3) latitudes, longitudes from 0, and radii of (n, 3) X, Y, Z."""
    radius = np.linalg.norm(xyz, axis=1)
    latitude = np.arctan2(xyz[:, 2], np.hypot(xyz[:, 0], xyz[:, 1]))
    return np.column_stack([latitude, np.arctan2(xyz[:, 1], xyz[:, 0]) % (2 * np.pi), radius])


DETAILS = "control network"
PITCHES = 1.4  # Standard deviation of image coordinates, in pixels of the detector


@dataclass(frozen=True, eq=False)
class Image:
    """An image of a network: serial number, file, support data, parameters."""

    serial: str
    path: Path
    supported: SupportedImage
    solving: Solving

    @property
    def pitch(self) -> float:
        """The side of a detector pixel in millimetres."""
        (x, y), _ = self.supported.isd.detector.planes["isis"].matrix.T
        return float((x * x + y * y) ** 0.5)


@dataclass(frozen=True, eq=False)
class PlanetaryContents:
    """A network as read, its images by photo name, and its settings.

    `starts` are (N, 3) initial X, Y, Z of all its points in metres; NaN for ignored ones.
    """

    network: ControlNetwork
    path: Path
    images: Mapping[str, Image]
    settings: Settings
    starts: Floats

    @property
    def different(self) -> list[Image]:
        """The images, each once: a push frame camera has several photos in one image."""
        return list(dict.fromkeys(self.images.values()))


def contents_of(details: Mapping[str, Any]) -> PlanetaryContents:
    found = details.get(DETAILS)
    if not isinstance(found, PlanetaryContents):
        raise InputError(phrase("isis.project"))
    return found


NORMAL = 1.4826  # Standard deviation of normal errors, in median absolute deviations
FEWEST = 2  # Smallest number of remaining measures of a point
FAINT = 1e6
"""Factor of the standard deviations of rejected measures, so that residuals can be computed for a possible
reinstatement.
"""
MOST_ROUNDS = 30


def rejecting(project: Project, adjust: Callable[..., Result]) -> Callable[..., Result]:
    """Return a call that adjusts a control network with rejection.

    Adjustment and rejection or reinstatement of measures (:func:`flagged`) alternate until nothing changes.
    The last adjustment is without the rejected measures.
    """
    contents = contents_of(project.details)
    if not contents.settings.rejects:
        return adjust

    def rejected(block: Block, **options: Any) -> Result:
        if not isinstance(block, Block):
            raise InputError(phrase("isis.rejection-poses"))
        multiplier = contents.settings.multiplier
        out = np.zeros(len(block.image_xy), dtype=bool)
        for rounds in count(1):
            sd = block.image_sd * np.where(out, FAINT, 1.0)[:, np.newaxis]
            result = adjust(block.replace(image_sd=sd), **options)
            if not result.converged:
                return result
            residuals = Outcome(contents, result).residuals
            lengths = np.where(result.used_images, np.hypot(*residuals.T), np.nan)
            limit = rejection_limit(lengths[~out], multiplier)
            now = flagged(lengths, out, block.image_points, limit)
            if (now == out).all():
                break
            out = now
            if rounds == MOST_ROUNDS:
                raise AdjustmentError(phrase("isis.rejection-rounds", n=rounds))
        if out.any():
            images = ("image_photos", "image_points", "image_xy", "image_sd")
            kept = {name: getattr(block, name)[~out] for name in images}
            result = adjust(block.replace(**kept), **options)
        counts = {"n": int(out.sum()), "total": len(out), "rounds": rounds, "least": FEWEST}
        remark = Message.of("isis.rejected", **counts, multiplier=multiplier, factor=NORMAL, limit=limit)
        return replace(result, messages=[remark, *result.messages])

    return rejected


def rejection_limit(lengths: Floats, multiplier: float) -> float:
    median = float(np.nanmedian(lengths))
    return median + multiplier * NORMAL * float(np.nanmedian(np.abs(lengths - median)))


def flagged(lengths: Floats, out: Bools, points: Indices, limit: float) -> Bools:
    """Return which measures to reject after an adjustment, as in jigsaw.

    A rejected measure remains rejected while its residual exceeds the limit. Otherwise the longest residual
    of a point is rejected if it exceeds the limit and two measures remain. `lengths` are (m,) of residuals,
    NaN if unused; `out` (m,) which were rejected before; `points` (m,) the point of each.
    """
    long = lengths > limit
    stay = out & long
    count = int(points.max(initial=-1)) + 1
    left = np.bincount(points[np.isfinite(lengths)], minlength=count)
    left -= np.bincount(points[stay], minlength=count)
    # Sorted by length: the last of each point is its longest.
    fresh = np.flatnonzero(long & ~out)
    order = fresh[np.lexsort((lengths[fresh], points[fresh]))]
    last = np.append(points[order][1:] != points[order][:-1], True)[: len(order)]
    longest = order[last]
    stay[longest[left[points[longest]] > FEWEST]] = True
    return stay


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
    different, flown = outcome.contents.different, outcome.result.trajectories
    images = {image: parameters(image, flown[image.solving.trajectory.name]) for image in different}
    # Images with fixed poses have fewer coefficients.
    names, rows = [each[:2] for each in max(images.values(), key=len)], []
    for image, own in images.items():
        cells = {each[:2]: each[3:] for each in own}
        of_names = [cells.get(name, (None,) * len(_CELLS)) for name in names]
        rows.append([str(image.path), *_rms(outcome, image), *sum(of_names, ())])
    heads = [("Image", "Filename"), *(("rms", f"{what} res") for what in ("sample", "line", "total"))]
    heads += [(f"{name}(t{power})", what) for name, power in names for what in _CELLS]
    points = _points(outcome)
    return {
        "images.csv": _table(list(zip(heads, zip(*rows, strict=True), strict=True))),
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
    rows = outcome.rows[image]
    residuals = outcome.residuals[rows[outcome.result.used_images[rows]]]
    squares = (residuals**2).mean(axis=0) if len(residuals) else np.full(2, np.nan)
    return list(np.sqrt([*squares, squares.mean()]))


def _triple(what: str, names: Sequence[str], units: str, values: Floats) -> list[tuple[Any, Floats]]:
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
    covariances, axes = outcome.covariances[used], outcome.axes[used]
    along = axes @ covariances @ axes.transpose(0, 2, 1)
    local, variances = (np.maximum(np.einsum("nkk->nk", own), 0.0) for own in (along, covariances))
    squares = (outcome.residuals[outcome.result.used_images] ** 2).mean(axis=1)
    counts = np.bincount(taken, minlength=len(block.point_ids))[used]
    sums = np.bincount(taken, squares, minlength=len(block.point_ids))[used]
    return [
        (("", "Point", "Label"), [network.points.ids[row] for row in rows.tolist()]),
        (("", "Point", "Status"), [POINT_TYPES[each].upper() for each in network.points.types[rows]]),
        (("", "Accepted", "Measures"), counts),
        (("", "Rejected", "Measures"), rejected[rows]),
        (("", "Residual", "RMS"), np.sqrt(sums / np.maximum(counts, 1))),
        *_triple("3-d", _AXES, "dd dd km", degrees),
        *_triple("Sigma", _AXES, "m m m", np.sqrt(local)[:, [1, 0, 2]]),
        *_triple("Correction", _AXES, "m m m", outcome.corrections[used]),
        *_triple("Coordinate", "XYZ", "km km km", outcome.xyz[used] / KM),
        *_triple("Sigma", "XYZ", "m m m", np.sqrt(variances)),
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
    made = []
    for head, values in columns:
        cells = [f"{each:.10f}" if isinstance(each, float) else str(each) for each in values]
        is_text = len(values) > 0 and isinstance(values[0], str)
        made.append(Column(" ".join(head).strip(), cells, text=is_text))
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
                deviation = float(sd[k, axis] * unit)
                free = repr(apriori) if np.isfinite(apriori) else "FREE", deviation
                weights = free if apriori else ("N/A", "N/A")
                found.append((name, k, _UNITS[part], initial, change, initial + change, *weights))
    return found
