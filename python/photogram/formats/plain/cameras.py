"""The tables of cameras (lenses, rolling shutters, line sensors) and of knots of B-spline lens models."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import ContradictionError, InputError
from photogram.formats.images import from_tables, in_unit, to_tables
from photogram.formats.plain.film_tables import certified, read_certificates
from photogram.formats.plain.tables import Tables, columns_of, columns_of_records, made, signs_in_files
from photogram.formats.plain.unknowns import read_covariances
from photogram.formats.project import Size
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import scaled
from photogram.io.places import Place, at_place, image_size
from photogram.messages import unknown_name
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.equivalent_cameras import focal_length_message, with_one_focal_length
from photogram.network.moving_photos import LineSensor, Shutter
from photogram.network.trajectories import Readout
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.film import Certificate


LINE = "line"  # The model of a line sensor with the lens `brown`
OF_LINES = ("x0", "y0", "s0")  # Columns of a line sensor that some models have as parameters
_PITCH = ("pitch_x", "pitch_y")
Exposure = Shutter | LineSensor | None


def _counted(direction: str) -> int:
    """Return the index of the image coordinate along the readout direction."""
    return 1 if direction in ("down", "up") else 0


def picture_edges(camera: Camera, direction: str, extent: Floats) -> Floats:
    """Return (2,) first and last image coordinate of an image along a direction.

    `extent` is (2,) width and height in the unit of the camera; NaN if unknown. Pixels that count down begin
    at the corner, all others at the centre.
    """
    axis = _counted(direction)
    length = float(extent[axis])
    if camera.unit == "px" and camera.image_y == "down":
        edges = [0.0, length]
    else:
        edges = [-length / 2, length / 2]
        if axis == 1 and camera.image_y == "up":
            edges.reverse()
    return np.array(edges[::-1] if direction in ("up", "left") else edges)


def of_cameras(block: Block, cameras: Sequence[Camera], which: Sequence[int]) -> list[Exposure]:
    """Return the shutter or line sensor of each camera of a block; None without."""
    of_photos = {each.photo: each.line_sensor or each.shutter for each in block.timed}
    found: dict[int, Exposure] = {}
    for photo, row in zip(block.photo_ids, which, strict=True):
        own = of_photos.get(photo)
        if found.setdefault(row, own) != own:
            raise InputError(phrase("plain.several-exposures", camera=cameras[row].title))
    return [found.get(row) for row in range(len(cameras))]


def exposure_cells(
    own: Exposure, camera: Camera, size: Size | None, pixel_mm: float | None, image_y: str
) -> dict[str, Any]:
    """Return the cells of the shutter or line sensor of a camera."""
    if isinstance(own, LineSensor):
        if not own.is_straight:
            raise InputError(phrase("plain.bent-line", camera=camera.title))
        cells = {name: float(getattr(own, name)) for name in OF_LINES}
        return cells | dict(zip(_PITCH, map(float, own.pitch), strict=True))
    if own is None or not isinstance(readout := own.readout, Readout):
        return {}
    found: dict[str, Any] = {"readout": readout.value, "sd_readout": float(readout.deviations[0])}
    found |= {"readout_direction": own.direction}
    unit = 1.0 if camera.unit == "px" else pixel_mm or math.nan
    # Size and direction may suffice.
    if size is None or picture_edges(camera, own.direction, np.array(size) * unit).tolist() != [*own.edges]:
        edges = np.array(own.edges, dtype=float)
        there = to_tables(image_y, camera, size, np.column_stack([edges, edges]))
        found |= zip(
            ("readout_begin", "readout_end"), there[:, _counted(own.direction)].tolist(), strict=True
        )
    return found if readout.name == camera.name else {**found, "shutter": readout.name}


_MODELS = dict(_photocore.camera_models())
OTHER_LENS = 5.0  # Difference of principal distances (mm) that indicates another lens than the certificate
_SD = ("sd_radial", "sd_tangential")
_DISTANCES = ("c", "f", "fx", "fy")
SMALLEST_DISTANCE = 0.1  # Smallest principal distance, relative to the image width


class TableCamera(NamedTuple):
    camera: Camera
    size: Size | None
    pixel_mm: float | None
    for_each: str  # Photos that share it: all, or each photo or group
    weights_given: bool
    line: LineSensor | None
    shutter: Shutter | None


class Cameras(NamedTuple):
    """The rows of the table of cameras, and certificates of cameras of films by name."""

    rows: list[TableCamera]
    certificates: Mapping[str, Certificate]

    @property
    def cameras(self) -> list[Camera]:
        return [each.camera for each in self.rows]


def read_cameras(tables: Tables) -> Cameras:
    table = tables.read("cameras")
    if table is None:
        raise InputError(phrase("error.missing", name="cameras.csv"), file=tables.settings.path)
    if not table.count:
        raise table.head.error(phrase("error.empty-file", content="cameras"))
    certificates, covariances = read_certificates(tables), read_covariances(tables)
    rows, in_mm = list[TableCamera](), list[str]()
    for row, cells in enumerate(tables.records("cameras")):
        own = _Row(tables, table, row, cells, bool(covariances.names("camera", cells["camera"])))
        parts, converted = own.divisor()
        in_mm += [own.name] * converted
        with at_place(table.at(row)):
            certificate = own.certificate(certificates)
            camera = certified(tables, own.name, own.model, certificate) if certificate else own.camera(parts)
        further = cells.get("pixel_mm"), cells.get("for_each", "all"), "weights" in cells
        rows.append(TableCamera(camera, own.size, *further, own.line, own.shutter(camera)))
    if both := [name for name in in_mm if covariances.names("camera", name)]:
        raise table.head.error(phrase("plain.mm-covariances", camera=both[0]))
    if in_mm:
        tables.remark("plain.lengths-in-mm", table.path, names=in_mm)
    cameras = with_knots(tables, covariances.cameras([each.camera for each in rows]))
    rows = [each._replace(camera=camera) for each, camera in zip(rows, cameras, strict=True)]
    return Cameras(rows, certificates)


class _Row:
    """A row of the table, with existing numbers by column name."""

    def __init__(
        self, tables: Tables, table: ColumnTable, row: int, cells: Mapping[str, Any], is_correlated: bool
    ) -> None:
        self.tables, self.table, self.row, self.cells = tables, table, row, cells
        self.is_correlated = is_correlated  # Whether the table of covariances contains parameters
        self.name, self.image = cells["camera"], tables.settings.image
        self.size: Size | None = None
        if {"width", "height"} <= cells.keys():
            self.size = image_size(table.at(row), cells["width"], cells["height"])
        self.line, self.model = self._line_sensor(), cells.get("model", "").lower()
        self.values = {column: value for column, value in cells.items() if column in _ALL}
        self.deviations = {name[3:]: value for name, value in cells.items() if name.startswith("sd_")}
        if self.line is not None:
            # The columns of a line sensor are not parameters of its lens.
            self.model = "brown" if self.model == LINE else self.model
            own = {name.lower() for name, _ in _MODELS[self.model][1]} if self.model in _MODELS else set()
            if both := own.intersection(OF_LINES):
                raise table.cell_error(row, min(both), "plain.line-parameter", model=self.model)
            if unknown := [column for column in OF_LINES if self.deviations.get(column)]:
                raise table.cell_error(row, f"sd_{unknown[0]}", "plain.line-sd")
            self.values = {name: value for name, value in self.values.items() if name not in OF_LINES}

    def _line_sensor(self) -> LineSensor | None:
        table, row, cells = self.table, self.row, self.cells
        pitches = [cells.get(name, 0.0) for name in _PITCH]
        if not cells.keys() & set(_PITCH):
            if cells.get("model", "").lower() == LINE:
                raise table.cell_error(row, "pitch_x", "error.empty")
            return None
        if not any(pitches):
            raise table.cell_error(row, "pitch_x, pitch_y", "plain.pitch")
        if not cells.keys() & {"s0", "width"}:
            raise table.cell_error(row, "s0", "plain.s0")
        numbers = np.array([*pitches, *(cells.get(name, 0.0) for name in OF_LINES[:2])])
        *pitch, x0, y0 = scaled(numbers, 1e-3 if self.image == "um" else 1.0).tolist()
        return LineSensor((pitch[0], pitch[1]), cells.get("s0", cells.get("width", 0) / 2), x0, y0)

    def shutter(self, camera: Camera) -> Shutter | None:
        table, row, cells, settings = self.table, self.row, self.cells, self.tables.settings
        if "readout" not in cells:
            if cells.keys() & {"readout_direction", "shutter"} or cells.get("sd_readout"):
                raise table.cell_error(row, "readout", "error.empty")
            return None
        direction, pixels = cells.get("readout_direction", "down"), self.image == "px"
        given = np.array([[cells.get(f"readout_{end}", np.nan)] * 2 for end in ("begin", "end")])
        if np.isnan(given).all():
            extent = np.array([cells.get(name, np.nan) for name in ("width", "height")], dtype=float)
            unit = 1.0 if pixels else cells.get("pixel_mm", np.nan)
            edges = picture_edges(camera, direction, extent * unit)
        else:
            there = in_unit(settings, given, pixels=pixels and settings.image_y == "down")
            own = made(table, row, from_tables, settings, camera, self.size, there)
            edges = own[:, _counted(direction)]
        if np.isnan(edges).any():
            raise table.error(row, phrase("plain.picture-edges"))
        title, sd, value = cells.get("shutter", camera.name), cells.get("sd_readout", 0.0), cells["readout"]
        readout = self.tables.unknown(table, row, "shutter", Readout, title, value=value, sd=sd)
        return made(table, row, Shutter, readout, tuple(edges.tolist()), direction)

    def divisor(self) -> tuple[float, bool]:
        """Return the divisor to camera units, and whether the row is in mm."""
        parts = 1000.0 if self.image == "um" else 1.0
        if self.size is None or self.line is not None:
            return parts, False
        pixel, width = self.cells.get("pixel_mm", math.nan), self.size[0]
        least = SMALLEST_DISTANCE * width * (1.0 if self.image == "px" else pixel * parts)
        small = [name for name in _DISTANCES if abs(self.values.get(name, math.inf)) < least]
        if not small:
            return parts, False
        value = self.values[small[0]]
        of_mm = [abs(self.values[name]) / pixel for name in _DISTANCES if name in self.values]
        in_mm = self.image == "px" and all(each >= SMALLEST_DISTANCE * width for each in of_mm)
        if in_mm and not {"cx", "cy"} & self.values.keys():
            return pixel, True
        remedy = "in-mm" if in_mm else "in-px" if self.image == "px" else "in-other"
        fields = {"value": value, "unit": self.image, "least": least, "width": width}
        remedies = {"remedy": phrase(f"plain.{remedy}", pixels=value / pixel, pixel=pixel)}
        raise self.table.cell_error(self.row, small[0], "plain.principal-distance", **fields, **remedies)

    def certificate(self, certificates: Mapping[str, Certificate]) -> Certificate | None:
        """Return the certificate that defines the camera; None if the table defines it."""
        certificate = certificates.get(self.name)
        if certificate is None or certificate.c is None:
            return None
        if self.values or self.deviations or "calibration" in self.cells:
            c = abs(self.values.get("c", certificate.c))
            if abs(c - certificate.c) > OTHER_LENS:
                message = phrase("plain.other-lens", camera=self.name, c=c, certificate=certificate.c)
                raise ContradictionError.of(self.table.error(self.row, message))
            self.tables.remark("plain.marks-only", self.table.path, camera=self.name)
            return None
        if self.is_correlated:
            raise self.table.error(self.row, phrase("plain.certificate-covariance", camera=self.name))
        return certificate

    def _calibrated(self) -> Camera:
        """Return a camera with parameters and covariances of its stellar calibration."""
        from photogram.stellar.cameras import camera_from

        if self.model or self.values or self.deviations or self.is_correlated:
            raise self.table.error(self.row, phrase("plain.calibrated-camera", camera=self.name))
        found = camera_from(self.table.path.parent / self.cells["calibration"], self.name)
        if (found.unit == "px") != (self.image == "px"):
            fields = {"camera": self.name, "unit": found.unit}
            raise self.table.error(self.row, phrase("plain.calibration-unit", **fields))
        return found

    def camera(self, parts: float) -> Camera:
        """Return the camera; `parts` are the units of the table in a unit of the camera."""
        if "calibration" in self.cells:
            return self._calibrated()
        known, table, row, size, image = self.values, self.table, self.row, self.size, self.image
        model = self.model or ("brown" if "c" in known and not known.keys() & {"f", "fx"} else "pinhole")
        if model not in _MODELS:
            raise table.unknown_error(row, "model", "camera model", model, _MODELS)
        powers = dict(_MODELS[model][1])
        own = {name.lower(): name for name in powers}
        if size is None and "w" in own:
            need = {"name": f"the model {model}", "other": "width and height"}
            raise table.error(row, phrase("error.requires", **need))
        # A single focal length applies to both axes.
        focal = ("fx", "fy") if "f" not in own and "fx" in own else ("f",)
        parameters, deviations = (
            {name: value for k, value in each.items() for name in (focal if k == "f" else (k,))}
            for each in (known, self.deviations)
        )
        if strange := [name for name in parameters if name not in own and parameters[name] != 0]:
            raise table.error(row, unknown_name(f"parameter of the model {model}", strange[0], powers))
        values, sd = (
            {own[k]: v / parts ** powers[own[k]] for k, v in each.items() if k in own}
            for each in (parameters, deviations)
        )
        signs = signs_in_files([*values]).tolist()
        values = {name: sign * values[name] for name, sign in zip(values, signs, strict=True)}
        if size is not None and image == "px":
            if "w" in own:
                values |= {own["w"]: float(size[0]), own["h"]: float(size[1])}
            elif "cx" in own:
                values = {own["cx"]: size[0] / 2, own["cy"]: size[1] / 2} | values
        elif "cx" in own and image != "px":
            values = {own["cx"]: 0.0, own["cy"]: 0.0} | values
        constants = [*powers][len(powers) - _MODELS[model][2] :]
        camera = Camera(
            model,
            values,
            {name: own_sd for name, own_sd in sd.items() if name not in constants},
            name=self.name,
            unit="px" if image == "px" else "mm",
            weights=self.cells.get("weights", "corrected"),
        )
        if not self.deviations.get("f") or "fx" not in own:
            return camera
        single = with_one_focal_length(camera, size if image == "px" else None)
        message = focal_length_message(camera, single)
        self.tables.remark("plain.focal-length", table.path, names=[self.name], message=message)
        return single


_ALL = frozenset(name.lower() for facts in _MODELS.values() for name, _ in facts[1])


def knots_table(cameras: Sequence[Camera]) -> dict[str, Any]:
    """Return the columns of the knots of cameras, row by row; empty without knots."""
    return columns_of_records(
        {"camera": each.name, "i": i, "j": j}
        | columns_of(("dx", "dy"), each.knots[j, i])
        | columns_of(_SD, each.knot_sd[j, i])
        for each in cameras
        if each.knots is not None and each.knot_sd is not None
        for j, i in np.ndindex(each.knots.shape[:2])
    )


def with_knots(tables: Tables, cameras: Sequence[Camera]) -> list[Camera]:
    """Return cameras with the knots of the table; missing knots are 0 and fixed."""
    table = tables.rows("knots")
    numbers = {each.name: np.zeros((*each.knots.shape[:2], 4)) for each in cameras if each.knots is not None}
    seen = set[tuple[str, int, int]]()
    for row, cells in enumerate(tables.records("knots", defaults=True)):
        name, i, j = cells["camera"], cells["i"], cells["j"]
        if name not in numbers:
            raise table.unknown_error(row, "camera", "splined camera", name, numbers)
        rows, count, _ = numbers[name].shape
        if not (i in range(count) and j in range(rows)):
            fields = {"camera": name, "columns": count, "rows": rows, "i": i, "j": j}
            raise table.error(row, phrase("plain.knot", **fields))
        if (name, i, j) in seen:
            raise table.error(row, phrase("error.repeated", kind="knot", name=f"{i:g}, {j:g}"))
        seen.add((name, i, j))
        numbers[name][j, i] = [cells[column] for column in ("dx", "dy", *_SD)]
    with at_place(Place(tables.settings.path)):
        return [
            each.replace(knots=own[:, :, :2], knot_sd=own[:, :, 2:])
            if (own := numbers.get(each.name)) is not None
            else each
            for each in cameras
        ]
