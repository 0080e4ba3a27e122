"""Writer of adjusted control networks, support data and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import orjson

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.csm.cubes import is_cube
from photogram.formats.csm.isd import Polynomials, angle_axes, of_angles, to_angles, to_quaternions
from photogram.formats.csm.photos import SupportedImage, to_camera, trajectory_of
from photogram.formats.csm.reading import UNITS, isd_of
from photogram.formats.isis.network import HEADER, LABEL_BYTES, MESSAGE, PLACES, ControlNetwork, is_binary
from photogram.formats.isis.outcome import Image, Outcome, contents_of, jigsaw_files
from photogram.formats.project import Project
from photogram.io.json import read_json
from photogram.io.pvl import Group, Value, label_text
from photogram.io.tree import Tree
from photogram.network.trajectories import Basis, Coefficient, Polynomial
from photogram.results.result import Result
from photogram.results.trajectories import AdjustedTrajectory
from photogram.words import phrase

_VERSION = 5
_END = "End_Object\nEnd\n"
_UPPER = np.triu_indices(3)


def _header(network: ControlNetwork) -> list[tuple[str, Value]]:
    return [(key, text) for key, name in HEADER.items() if (text := getattr(network, name)) is not None]


def binary_network(network: ControlNetwork) -> bytes:
    """Return a network as a binary file of version 5.

    Fields of points and measures are written as they were read, except changed columns.

    Raises
    ------
    InputError
        If columns are inconsistent, or a value that was read from text cannot be written to a binary network.
        The message names the value and the point.
    """
    points = _photocore.control_point_messages(*network.columns())
    texts = [getattr(network, name) for name in MESSAGE]
    radii = network.radii.tolist()
    header = _photocore.control_header_message(texts, len(network.points), radii, network.header_rest)
    counts: list[tuple[str, Value]] = [
        ("NumberOfPoints", len(network.points)),
        ("NumberOfMeasures", len(network.measures)),
        ("Version", _VERSION),
    ]
    sizes = (LABEL_BYTES, len(header), LABEL_BYTES + len(header), len(points))
    places: list[tuple[str, Value]] = [*zip(PLACES, sizes, strict=True)]
    info = [*_header(network), *counts, *network.others.items]
    inside = [Group("Core", "object", items=places), Group("ControlNetworkInfo", "group", items=info)]
    buffer = Group("ProtoBuffer", "object", inside=[*inside, *network.others.inside])
    label = label_text(Group("", "label", inside=[buffer])).encode()
    if len(label) > LABEL_BYTES:
        raise InputError(phrase("isis.label", n=len(label), size=LABEL_BYTES))
    return label.ljust(LABEL_BYTES, b"\0") + header + points


def network_text(network: ControlNetwork) -> bytes:
    """Return a network as text of version 5.

    Raises
    ------
    InputError
        If columns are inconsistent, or a value that was read from a binary network cannot be written as text.
        The message names the value and the point.
    """
    if network.header_rest:
        raise InputError(phrase("isis.fields"))
    points = _photocore.control_point_text(*network.columns())
    items = _header(network)
    if network.radii.size:
        items.append(("TargetRadii", list[Value](network.radii.tolist())))
    items += [("Version", _VERSION), *network.others.items]
    own = replace(network.others, name="ControlNetwork", kind="object", items=items)
    head = label_text(Group("", "label", inside=[own])).removesuffix(_END)
    return head.encode() + points + _END.encode()


def results(project: Project, result: Result) -> Mapping[str, bytes]:
    """Return the files of an adjusted network by name."""
    outcome = Outcome(contents_of(project.details), result)
    path = outcome.contents.path
    files = dict(jigsaw_files(outcome))
    files[path.name] = (binary_network if is_binary(path) else network_text)(_updated_network(outcome))
    names: dict[str, int] = {}
    for image in outcome.contents.different:
        content = updated_support(image, result.trajectories[image.solving.trajectory.name])
        if content is None:
            continue
        count = names[image.path.name] = names.get(image.path.name, 0) + 1
        folder = "support" if count == 1 else f"support-{count}"
        files[f"{folder}/{image.path.name}"] = content
    return files


def _updated_network(outcome: Outcome) -> ControlNetwork:
    """Return a network with adjusted coordinates, covariances and residuals.

    Ignored points and measures are unchanged. A point is rejected if all of its measures are rejected.
    """
    network = outcome.contents.network
    points, measures, ignored = network.points, network.measures, network.is_ignored
    used = np.flatnonzero(outcome.result.used_points)
    rows = outcome.point_rows[used]
    adjusted, covariance = np.array(points.adjusted), np.array(points.adjusted_covariance)
    adjusted[rows] = outcome.xyz[used]
    covariance[rows] = outcome.covariances[used][:, _UPPER[0], _UPPER[1]]
    residuals = np.column_stack([measures.sample_residual, measures.line_residual])
    residuals[~ignored] = np.nan
    taken = outcome.result.used_images
    residuals[outcome.measure_rows[taken]] = outcome.residuals[taken]
    counts = ~np.isnan(outcome.contents.starts[:, 0])
    out = counts.copy()
    out[rows] = False
    rejected = np.where(counts, out, points.rejected)
    points = replace(points, adjusted=adjusted, adjusted_covariance=covariance, rejected=rejected)
    sample, line = residuals.T
    rejected = np.where(ignored, measures.rejected, outcome.rejected)
    measures = replace(measures, sample_residual=sample, line_residual=line, rejected=rejected)
    return replace(network, points=points, measures=measures)


CLOSE = 0.01  # Largest difference (pixels) between projections with the new tables and with the trajectory
GRID = 32  # Number of samples, and of lines, for the comparison: about a thousand points
HALVINGS = 8  # Largest number of halvings of the intervals of a table


def updated_support(image: Image, adjusted: AdjustedTrajectory) -> bytes | None:
    """Return support data with adjusted tables; None for a (binary) cube.

    Positions, velocities, quaternions and angular velocities are at the times of the records. The intervals
    are halved until linear interpolation projects a thousand points within :data:`CLOSE`; otherwise an error
    is raised. All other contents are unchanged.
    """
    if is_cube(image.path):
        return None
    corrected = _Corrected(image, adjusted)
    truth = _adjusted_image(image, adjusted)
    samples, lines = (np.linspace(1.0, size, GRID) for size in image.supported.isd.size)
    rows, columns = np.meshgrid(lines, samples)
    ground = truth.to_ground(rows.ravel(), columns.ravel())
    seen = truth.to_image(ground)
    for halvings in range(HALVINGS + 1):
        document = corrected.document(halvings)
        isd = isd_of(Tree(document, image.path))
        apart = SupportedImage(isd, "updated", "isis", "isis").to_image(ground) - seen
        if not np.nanmax(np.abs(apart), initial=0.0) > CLOSE:
            return orjson.dumps(document, option=orjson.OPT_INDENT_2)
    raise InputError(phrase("isis.tables", limit=CLOSE, n=HALVINGS), file=image.path)


def _adjusted_image(image: Image, adjusted: AdjustedTrajectory) -> SupportedImage:
    own, over = adjusted.given, image.solving.over
    table = trajectory_of(image.supported.isd, own.name, interpolation="isis").table
    taken: tuple[str, ...] = ()
    if own.position is not None and not over[0]:
        taken += ("times", "positions", "velocities", "interpolation")
    if own.rotation is not None and not over[1]:
        taken += ("attitude_times", "attitudes", "attitude_interpolation")
    table = replace(table, **{name: getattr(own.table, name) for name in taken})
    changes: dict[str, Any] = {"table": table}
    for name, value in (("position", adjusted.position), ("rotation", adjusted.rotation)):
        if (basis := getattr(own, name)) is not None:
            changes[name] = replace(basis, value=value, sd=0.0)
    return SupportedImage(image.supported.isd, own.name, "isis", "isis", replace(own, **changes))


class _Corrected:
    """The tables of an image with its corrections, at any times."""

    def __init__(self, image: Image, adjusted: AdjustedTrajectory) -> None:
        self.original, self.over = image.supported.isd, image.solving.over
        own, solving = adjusted.given, image.solving
        self.places = _total(own.position, own.coefficients[0], solving.position, adjusted.position)
        self.angles = _total(own.rotation, own.coefficients[1], solving.angles, adjusted.rotation)
        self.table = replace(trajectory_of(self.original, own.name, interpolation="isis"), body=None)
        self.source = read_json(image.path).value

    def document(self, halvings: int) -> dict[str, Any]:
        """Return the document with corrected tables of halved intervals; one record has no velocity."""
        found = dict(self.source)
        if self.places is not None:
            own, times = found["instrument_position"], _halved(self.original.position.times, halvings)
            before = self._flown(times)[0] if self.over[0] else np.zeros((len(times), 3))
            unit = UNITS[own.get("unit", "km")]
            own = own | {"positions": ((self.places.at(times) + before) / unit).tolist()}
            if len(times) > 1:
                known = _given(own, "velocities", times)
                known = np.gradient(before / unit, times, axis=0) if known is None else known
                speeds = self.places.rates(times) / unit
                own["velocities"] = (speeds + known if self.over[0] else speeds).tolist()
            found["instrument_position"] = own | {"ephemeris_times": times.tolist()}
        if self.angles is not None:
            own, times = found["instrument_pointing"], _halved(self.original.pointing.times, halvings)
            angles = to_angles(self._flown(times)[1]) if self.over[1] else np.zeros((len(times), 3))
            matrices = of_angles(angles + self.angles.at(times))
            constant = np.reshape(own.get("constant_rotation", np.eye(3)), (3, 3))
            own = own | {"quaternions": to_quaternions(constant.T @ matrices).tolist()}
            if len(times) > 1:
                own["angular_velocities"] = self._turning(self.angles, angles, own, times).tolist()
            found["instrument_pointing"] = own | {"ephemeris_times": times.tolist()}
        return found

    def _turning(self, total: Polynomials, before: Floats, own: Mapping[str, Any], times: Floats) -> Floats:
        """Return angular velocities along inertial axes; `before` are angles without the polynomials."""
        rates = total.rates(times)
        if self.over[1]:
            known = _given(own, "angular_velocities", times)
            if known is None:
                rates += np.gradient(before, times, axis=0)
            else:
                rates += np.linalg.solve(angle_axes(before), known[:, :, np.newaxis])[:, :, 0]
        return np.asarray(np.einsum("nij,nj->ni", angle_axes(before + total.at(times)), rates))

    def _flown(self, times: Floats) -> tuple[Floats, Floats]:
        """Return the positions, and matrices inertial to camera, of the original tables."""
        places, turned, *_ = self.table.flown(times, *np.zeros((2, 0, 3)))
        return places, to_camera(self.original, turned.reshape(-1, 3, 3))


def _given(own: Mapping[str, Any], name: str, times: Floats) -> Floats | None:
    """Return (n, 3) record values, interpolated linearly at times; None if missing."""
    if not own.get(name):
        return None
    known, values = np.array(own["ephemeris_times"]), np.array(own[name])
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def _halved(times: Floats, halvings: int) -> Floats:
    """Return times of intervals divided into 2^halvings equal parts."""
    parts = 2**halvings
    places = np.arange((len(times) - 1) * parts + 1) / parts
    return np.asarray(np.interp(places, np.arange(len(times)), times))


def _total(
    basis: Basis | None, given: Sequence[Coefficient], begun: Floats, adjusted: Floats
) -> Polynomials | None:
    """Return adjusted polynomials; None without polynomials."""
    if not isinstance(basis, Polynomial) or basis.reference is None or basis.scale is None:
        return None
    total = begun.copy()
    total[:, : len(given)] += (adjusted - np.array([each.position for each in given])).T
    return Polynomials(total, basis.reference, basis.scale)
