"""Certificate files (docs/certificates.md): TOML, or the table `fiducials` of plain projects.

TOML coordinates are rotated so that the data strip is at the left.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from photogram.arguments.arrays import matrix_fault
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.distances import Crossing, MarkDistance, RightAngle
from photogram.film.lens_table import SEMI_DIAGONALS, RadialTable, Tangential, of_semi_diagonals
from photogram.film.marks import SD_PLACE, DataStrip, by_side, marks_in_use, turned, turned_name
from photogram.io.delimited import read_columns
from photogram.io.places import at_place
from photogram.io.toml import TomlTree, read_document
from photogram.messages import unknown_name
from photogram.statistics.fits import Fit
from photogram.words import phrase

UM = 1e-3
SD_DISTANCE = 0.002
SD_DISTORTION_UM = 1.5
SD_TANGENTIAL_UM = 2.0
LARGEST = 1e4  # millimetres

_KEYS = (
    *("camera", "type", "date", "data_strip", "unit", "c", "sd_c", "principal_point", "autocollimation"),
    *("symmetry", "sd_principal_point", "sd_fiducials", "sd_distances", "sd_design", "radial_coefficients"),
    *("fiducials", "distances", "design", "lines", "radial", "tangential", "tangential_sign"),
)


def read_toml(path: Path) -> dict[str, Any]:
    """Return the fields of a certificate from a TOML file.

    InputError: if the file cannot be read or contains unknown or invalid entries.
    """
    table = read_document(path, {"certificate": _KEYS})["certificate"]
    table.get("unit", "mm").choice(("mm",))
    strip = table.get("data_strip", "left").choice(get_args(DataStrip))
    frame = _Frame(cast(DataStrip, strip), table.source.lines)
    found: dict[str, Any] = {
        "name": table.get("camera", path.stem).word(),
        "camera_type": table.get("type", "").text(),
        "day": table["date"].day() if "date" in table else None,
        "c": abs(table["c"].number(-LARGEST, LARGEST)) if "c" in table else None,
        "reference": table.get("principal_point", "fiducial-centre").choice(REFERENCES),
        "autocollimation": frame.place(table, "autocollimation"),
        "symmetry": frame.place(table, "symmetry"),
        "places": frame.places(table.table("fiducials")),
        "distances": frame.distances(
            table.table("distances"), table.get("sd_distances", SD_DISTANCE).positive()
        ),
        "design": frame.places(table.table("design")),
        "lines": frame.lines(table),
        "typed": frame.typed,
        "file": path,
    }
    found |= {field: table[key].positive() for field, key in _DEVIATIONS.items() if key in table}
    if found["c"] == 0:
        raise table["c"].error(phrase("error.positive", value=0.0))
    found |= _radial(table, found["c"], frame)
    found["tangential"] = _tangential(table, found["c"], found.get("radial"), frame)
    return found


_DEVIATIONS = {name: name for name in ("sd_c", "sd_principal_point", "sd_design")}
_DEVIATIONS["sd_places"] = "sd_fiducials"  # Keys by field
REFERENCES = ("fiducial-centre", "autocollimation", "symmetry")  # Possible origins of coordinates


class _Frame:
    def __init__(self, data_strip: DataStrip, lines: Sequence[str]) -> None:
        self.data_strip, self.typed = data_strip, dict[str, str]()
        content = tomllib.loads("\n".join(lines), parse_float=str)
        self._typed: Mapping[str, Any] = content["certificate"]

    def mark(self, name: str) -> str:
        return turned_name(by_side(name), self.data_strip)

    def place(self, table: TomlTree, key: str) -> tuple[float, float] | None:
        if key not in table:
            return None
        x, y = turned(_numbers(table, key, 2), self.data_strip).tolist()
        return x, y

    def places(self, table: TomlTree) -> dict[str, tuple[float, float]]:
        found: dict[str, tuple[float, float]] = {}
        section = table.name.rpartition(".")[2]
        for key in table.value:
            name, place = self.mark(key), self.place(table, key)
            if name in found:
                raise table[key].error(phrase("error.repeated", kind="mark", name=name))
            assert place is not None
            found[name] = place
            if section == "fiducials":
                x, y = (_text(each) for each in self._typed[section][key])
                if self.data_strip == "top":
                    x, y = (y[1:] if y.startswith("-") else f"-{y.removeprefix('+')}"), x
                self.typed |= {f"{name}.x": x, f"{name}.y": y}
        return found

    def distances(self, table: TomlTree, sd: float) -> tuple[MarkDistance, ...]:
        found: dict[frozenset[str], MarkDistance] = {}
        for key in table.value:
            parts = [self.mark(part) for part in key.split("-")]
            if len(parts) != 2 or not all(parts) or parts[0] == parts[1]:
                raise table[key].error(phrase("films.pair-of-marks", value=key))
            distance = MarkDistance(parts[0], parts[1], table[key].positive(), sd)
            if distance.length > LARGEST:
                raise table[key].error(phrase("error.most", high=LARGEST, value=distance.length))
            if frozenset(parts) in found:
                raise table[key].error(phrase("error.repeated", kind="distance", name=distance.name))
            found[frozenset(parts)] = distance
            self.typed[distance.name] = _text(self._typed["distances"][key])
        return tuple(found.values())

    def lines(self, table: TomlTree) -> tuple[RightAngle | Crossing, ...]:
        found: list[RightAngle | Crossing] = []
        for line in table.get("lines", []):
            line.only(("marks", "angle", "sd_angle_arcmin", "place", "sd_place"))
            names = [self.mark(each) for each in line["marks"].words()]
            if len(names) != 4 or len(set(names)) < 4:
                raise line["marks"].error(phrase("films.four-marks", names=names))
            marks = (names[0], names[1], names[2], names[3])
            if "sd_angle_arcmin" in line:
                sd = math.radians(line["sd_angle_arcmin"].positive() / 60)
                angle = math.radians(line.get("angle", 90.0).number(1, 179))
                found.append(RightAngle(marks, sd, angle))
            if "sd_place" in line:
                place = self.place(line, "place") or (0.0, 0.0)
                found.append(Crossing(marks, line["sd_place"].positive(), place))
            if not {"sd_angle_arcmin", "sd_place"} & line.value.keys():
                raise line["marks"].error(phrase("films.line-without-sd"))
        return tuple(found)


def _text(value: Any) -> str:
    return str(value).replace("_", "")


def _numbers(table: TomlTree, key: str, *counts: int) -> Floats:
    return np.array(table[key].numbers(*counts))


def _sign(table: TomlTree, key: str) -> int:
    value = table.at(key).value
    if value not in (1, -1) or isinstance(value, bool):
        raise table.at(key).error(phrase("films.sign", value=str(value)))
    return int(value)


def _angles(own: TomlTree, c: float) -> Floats:
    """Return angles from the axis (rad) given in degrees or as radii in mm."""
    if ("angle" in own) == ("radius" in own):
        raise own.at("angle").error(phrase("error.exclusive", first="angle", second="radius"))
    key = "angle" if "angle" in own else "radius"
    values = _numbers(own, key)
    if key == "radius":
        values = np.degrees(np.arctan2(values, c))
    if (wrong := values[~((values > 0) & (values < 90))]).size:
        raise own[key].error(phrase("films.angles", value=float(wrong[0])))
    return np.radians(values)


def _radial(table: TomlTree, c: float | None, frame: _Frame) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if "radial_coefficients" in table:
        found["radial_coefficients"] = tuple(_numbers(table, "radial_coefficients").tolist())
    if "radial" not in table:
        return found
    own = table.table("radial")
    own.only(("angle", "radius", "distortion", "sign", "sd_um", "correlation", *SEMI_DIAGONALS))
    if c is None:
        raise own.at("distortion").error(phrase("error.requires", name="distortion", other="c"))
    angle = _angles(own, c)
    correlation = own.get("correlation", 0.0).number(0.0, 0.999)
    outwards = UM * _sign(own, "sign") if "sign" in own else UM
    if "distortion" in own:
        values = outwards * _numbers(own, "distortion", len(angle))
        sd = UM * own.get("sd_um", SD_DISTORTION_UM).positive()
        return found | {"radial": RadialTable(angle, values, sd, correlation)}
    singly = {frame.mark(name): outwards * _numbers(own, name, len(angle)) for name in SEMI_DIAGONALS}
    with at_place(own.at("ll")):
        given = UM * own["sd_um"].positive() if "sd_um" in own else None
        mean, sd, remarks = of_semi_diagonals(angle, singly, given)
    return found | {"radial": RadialTable(angle, mean, sd, correlation), "remarks": tuple(remarks)}


def _tangential(
    table: TomlTree, c: float | None, radial: RadialTable | None, frame: _Frame
) -> Tangential | None:
    if "tangential" not in table:
        return None
    sign = _sign(table, "tangential_sign")
    own = table.table("tangential")
    own.only(("J1", "phi0", "angle", "radius", "displacement", "sd_um"))
    phi0 = math.radians(own["phi0"].number()) + (math.pi / 2 if frame.data_strip == "top" else 0.0)
    sd = UM * own.get("sd_um", SD_TANGENTIAL_UM).positive()
    if "J1" in own:
        if radial is None or c is None:
            raise own["J1"].error(phrase("error.requires", name="J1", other="the table radial"))
        edge = c * math.tan(float(radial.angle.max()))
        return Tangential(own["J1"].number(), phi0, sign, sd / edge**2)
    if c is None:
        raise own.at("displacement").error(phrase("error.requires", name="displacement", other="c"))
    angle = _angles(own, c)
    values = UM * _numbers(own, "displacement", len(angle))
    # The profile P(r) = J1 r^2
    fit = Fit.of(values, sd**2 * np.eye(len(angle)), (c * np.tan(angle))[:, np.newaxis] ** 2)
    return Tangential(float(fit.parameters[0]), phi0, sign, math.sqrt(float(fit.cofactors[0, 0])))


_NUMBERS = ("x", "y", "sd_x", "sd_y")
_COLUMNS = ("camera", "fiducial", *_NUMBERS, "use")


def read_table(path: Path, camera: str | None) -> dict[str, Any]:
    """Return the fields of a certificate from a table of fiducial marks.

    Marks with `use` off are not used. A table `covariances` in the same folder (`kind, name, first, second,
    covariance`; kind `fiducials`) replaces standard deviations. InputError: if the file cannot be read, has
    missing or unknown columns, or contains several cameras and none is chosen.
    """
    table = read_columns(path, known=_COLUMNS, numbers=_NUMBERS)
    table.require("camera", "fiducial", "x", "y")
    if unknown := [each for each in table.columns if each not in _COLUMNS]:
        raise table.head.error(unknown_name("column", unknown[0], _COLUMNS))
    cameras = table.names("camera")
    if camera is None and len(cameras.names) > 1:
        raise InputError(phrase("films.choose-camera", cameras=cameras.names), file=table.path)
    name = cameras.names[0] if camera is None and cameras.names else camera
    if name is None or name not in cameras.names:
        raise InputError(unknown_name("camera", str(name), cameras.names), file=table.path)
    marks = [by_side(mark) for mark in table.texts("fiducial")]
    in_use = marks_in_use(table.with_texts("fiducial", marks), [name])
    on = {mark: row for (_, mark), row in in_use.items()}
    xy = table.given(("x", "y"))
    sd = table.vectors(("sd_x", "sd_y"), SD_PLACE)
    for row in on.values():
        if not (sd[row] > 0).all():
            message = phrase("error.positive", value=float(sd[row].min()))
            raise table.error(row, phrase("error.at", what="sd_x, sd_y", message=message))
    typed = {f"{mark}.{axis}": table.texts(axis)[row] for mark, row in on.items() for axis in "xy"}
    rows = np.flatnonzero(cameras.rows == cameras.names.index(name)).tolist()
    off = [marks[row] for row in rows if row not in on.values()]
    deviations = sd[[*on.values()]].ravel()
    return {
        "name": name,
        "places": {mark: tuple(xy[row].tolist()) for mark, row in on.items()},
        "covariance": _covariance(path.with_name("covariances.csv"), name, [*typed], deviations),
        "typed": typed,
        "file": path,
        "remarks": (phrase("films.marks-off", marks=off),) if off else (),
    }


def _covariance(path: Path, camera: str, fields: list[str], sd: Floats) -> Floats:
    """Return the covariance matrix (mm^2) of the file, or of standard deviations."""
    found = np.diag(sd**2)
    if not path.exists():
        return found
    table = read_columns(path, known=("kind", "name"), numbers=("covariance",))
    table.require("kind", "name", "first", "second", "covariance")
    values = table.numbers("covariance").tolist()
    texts = (table.texts(column) for column in ("kind", "name", "first", "second"))
    for row, (kind, name, *pair) in enumerate(zip(*texts, strict=True)):
        if kind != "fiducials" or name != camera:
            continue
        for word in pair:
            if word not in fields:
                raise table.error(row, unknown_name("coordinate", word, fields))
        if math.isnan(values[row]):
            raise table.cell_error(row, "covariance", "error.empty")
        i, j = map(fields.index, pair)
        found[i, j] = found[j, i] = values[row]
    if fault := matrix_fault(found, singular=True):
        raise InputError(fault, file=path)
    return found
