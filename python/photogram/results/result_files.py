"""Reading and writing of results as files: common tables of networks.

`docs/results.md` describes the files. Arrays with a row for every photo, point or image are columns of a
table; all other data are in `summary.json`. Classes of results declare their columns as :class:`Part`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import orjson

from photogram import _photocore
from photogram.errors import InputError
from photogram.io.column_table import NameColumn
from photogram.io.json import holding, read_json
from photogram.io.parquet import Column, Sheet, packed, parquet_content, read_sheet, unpacked
from photogram.io.seals import SEAL, check_seal, check_sealed, recorded, seal
from photogram.io.structure import Decoder, Encoder
from photogram.io.writing import Content
from photogram.lazy_dataclasses import dataclass
from photogram.network.geometry import Frame
from photogram.results.network import AdjustedNetwork
from photogram.show.quantity import Quantities
from photogram.words import phrase

FORMAT = 2
SUMMARY = "summary.json"
_STATE = "state"
_READ = ("photos", "points", "images", _STATE)  # Tables that are read; the others are for users
TRIANGLE = "covariances, lower triangle row by row, scaled by the variance of unit weight"
REDUNDANCY = "redundancy number of {} as an observation; 0 unless weighted"
GIVEN_SD = "standard deviation of {} that was given: infinite free, 0 fixed"
_ROWS = ("photo_ids", "point_ids", "image_photos", "image_points")
"""Fields of the given network that are defined by the names in the tables."""


@dataclass(frozen=True)
class Part:
    """An array of a result, or of the given network, as columns of a table."""

    field: str  # Path of the attribute, such as `block.image_xy`
    # Names of columns, or of the components of a matrix or list
    names: tuple[str, ...]
    units: tuple[str, ...]
    description: str  # Description of all columns; `{}` is the name of the component
    # `columns`; `matrix`: lower triangles of symmetric matrices, which are cofactors in the result and scaled
    # in the table; `list`: one cell for each row; `derived`: columns that are not read again
    form: str = "columns"
    prefix: str = ""  # Prefix of the names of columns; the name of the one column of a matrix or list

    def columns(self, result: AdjustedNetwork) -> list[Column]:
        array: Any = attrgetter(self.field)(result)
        if array is None:
            return []
        if self.form == "matrix":
            triangles, units = packed(array) * result.covariance_scale, " ".join(self.units)
            unit = f"products of {units}" if len({*self.units}) > 1 else f"{self.units[0]}2"
            return [Column(self.prefix, triangles, unit, self.description, self.names)]
        if self.form == "list":
            if not len(array):
                return []
            cells = array.transpose(1, 0, 2).reshape(array.shape[1], -1)
            return [Column(self.prefix, cells, " ".join(self.units), self.description, self.names)]
        parts = array.T if array.ndim == 2 else [array]
        return [
            Column(self.prefix + name, part, unit, self.description.format(name))
            for name, unit, part in zip(self.names, self.units, parts, strict=True)
        ]

    def array(self, sheet: Sheet, scale: float) -> np.ndarray | None:
        """Return the array from a table; None if it was None."""
        if self.form == "matrix":
            k = len(self.names)
            return unpacked(_divided(sheet.numbers(self.prefix, k * (k + 1) // 2), scale))
        if self.form == "list":
            if self.prefix not in sheet.columns:
                return np.zeros((0, sheet.rows, len(self.names)))
            cells = sheet.numbers(self.prefix, -len(self.names))
            return np.ascontiguousarray(cells.reshape(len(cells), -1, len(self.names)).transpose(1, 0, 2))
        own = [self.prefix + name for name in self.names]
        if not any(name in sheet.columns for name in own):
            return None
        parts = [sheet.numbers(name) for name in own]
        return np.array(parts[0]) if len(own) == 1 else np.column_stack(parts)


def _divided(products: np.ndarray, scale: float) -> np.ndarray:
    """Return quotients that reproduce products exactly when multiplied by scale."""
    near: np.ndarray = products / scale
    found = near
    for direction in (-np.inf, np.inf):
        beside = np.nextafter(near, direction)
        found = np.where((found * scale != products) & (beside * scale == products), beside, found)
    return found


def point_parts(given: str, names: tuple[str, ...], units: tuple[str, ...]) -> list[Part]:
    """Return the stored arrays of points; `given` is the name of the adjusted network."""
    sd = "standard deviation of {}"
    return [
        Part("point_rays", ("rays",), ("1",), "number of images; 0 for points left out"),
        Part("point_positions", names, units, "adjusted {}"),
        Part("point_sd", names, units, sd, "derived", "sd_"),
        Part("point_cofactors", names, units, TRIANGLE, "matrix", "covariance"),
        Part("point_redundancy", names, ("1",) * 3, REDUNDANCY, prefix="redundancy_"),
        Part(f"{given}.point_positions", names, units, "{} as it was given", prefix="given_"),
        Part(f"{given}.point_sd", names, units, GIVEN_SD, prefix="given_sd_"),
    ]


def image_parts(given: str, unit: str) -> list[Part]:
    """Return the stored arrays of images; `given` is the name of the adjusted network."""
    both, units, plain = ("x", "y"), (unit, unit), ("1", "1")
    return [
        Part(f"{given}.image_xy", both, units, "measured {}"),
        Part(f"{given}.image_sd", both, units, "standard deviation of {} a priori", prefix="sd_"),
        Part("residuals", both, units, "residual of {}, observed minus computed", prefix="residual_"),
        Part("redundancy", both, plain, "redundancy number of {}", prefix="redundancy_"),
        Part(
            "standardized",
            both,
            plain,
            "residual of {} over its standard deviation, a priori unit weight; NaN without redundancy",
            prefix="test_",
        ),
        Part("image_weights", ("weight",), ("1",), "factor by which a robust loss has changed the weight"),
    ]


@dataclass(frozen=True, eq=False)
class Saved:
    folder: Path  # Its path
    summary: Mapping[str, Any]  # The document
    decoder: Decoder  # Decoder of the document
    sheets: Mapping[str, Sheet]  # The tables of photos, points and images

    def arrays(
        self, parts: Mapping[str, Sequence[Part]], given: str
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        own: dict[str, Any] = {}
        others: dict[str, Any] = {}
        variance = self.summary["variance_of_unit_weight"]
        scale = 1.0 if variance is None else float(variance)
        for table, each in ((table, each) for table, own_parts in parts.items() for each in own_parts):
            if each.form != "derived":
                found = each.array(self.sheets[table], scale)
                name = each.field.removeprefix(f"{given}.")
                (own if name == each.field else others)[name] = found
        return own, others

    def members(self, name: str, kind: type) -> dict[str, Any]:
        """Return the fields of a class from the document: `result` or given network."""
        return self.decoder.fields(self.summary["kept"][name], kind)

    def state(self) -> _photocore.BlockState:
        unknowns = read_sheet(self.folder / f"{_STATE}.parquet").numbers("unknown")
        rest = self.decoder.value(self.summary["kept"][_STATE])
        with holding("state of an adjustment", self.folder / SUMMARY):
            return _photocore.BlockState(unknowns.tolist(), *rest)


_RENAMED = {"standardized": "test", "d": "difference"}  # Names in Parquet


def sheet(table: Quantities) -> list[Column]:
    """Return Parquet columns: angles in radians, lower-case names, separate units."""
    found = []
    for each in table:
        if each.name is None:
            continue
        name = _RENAMED.get(each.name, each.name)
        if each.kind == "name":
            values: Any = np.asarray(each.values)
            if values.dtype.kind not in "iu":  # Numbers of photos and points are not repeated texts
                few, rows = np.unique(values.astype(str), return_inverse=True)
                values = NameColumn(few.tolist(), rows)
            found.append(Column(name, values, "", each.about))
        elif each.single:
            unit = "1" if each.kind == "number" else "as the column unit says"
            found.append(Column(name, np.asarray(each.values), unit, each.about.removesuffix(": {}")))
        else:
            for axis, column in zip(each.axes, each.values.T, strict=True):
                own = f"{name}_{axis.name.lower()}".removeprefix("_")
                unit = "1" if each.kind == "number" else axis.unit
                found.append(Column(own, column, unit, each.about.format(axis.name)))
    return found


def written(
    result: AdjustedNetwork,
    kind: str,
    given: str,
    parts: Mapping[str, Sequence[Part]],
    leading: Mapping[str, Sequence[Column]],
    tables: Mapping[str, Sequence[Column]],
    frame: Frame,
    summary: Mapping[str, Any],
) -> dict[str, Content]:
    """Return the files of a result.

    `kind` identifies the reader, `given` is the field of the adjusted network. `parts` belong to the tables
    of photos, points and images, after the `leading` names. `tables` are additional ones for users, and
    `summary` is the first data for a reader.
    """
    unknowns, *state = result.state.__getnewargs__()
    place = {"kind": frame.kind, "crs": frame.crs, "origin": frame.origin}
    about = {
        "photogram.version": _photocore.__version__,
        "photogram.format": str(FORMAT),
        "photogram.frame": json.dumps(place),
        "photogram.variance_of_unit_weight": repr(result.variance_of_unit_weight),
        "photogram.scaled": "covariance",
    }
    sheets: dict[str, Sequence[Column]] = {
        table: [*leading[table], *(column for each in own for column in each.columns(result))]
        for table, own in parts.items()
    }
    core = Column("unknown", np.array(unknowns), "", "adjusted unknowns in the order of the core")
    sheets |= {**tables, _STATE: [core]}
    names = {part.field for own in parts.values() for part in own if part.form != "derived"}
    encoder = Encoder()
    inner = [name.removeprefix(f"{given}.") for name in names if name.startswith(f"{given}.")]
    kept = {
        given: encoder.fields(getattr(result, given), [*inner, *_ROWS]),
        "result": encoder.fields(result, [*names, given, _STATE]),
        _STATE: encoder.value(state),
    }
    document = {
        "program": f"photogram {_photocore.__version__}",
        "format": FORMAT,
        "kind": kind,
        "variance_of_unit_weight": result.variance_of_unit_weight,
        **summary,
        "input": _digest(result, given, parts, kept[given]),
        "kept": kept,
    }
    seals: dict[str, str] = {}
    files: dict[str, Content] = {
        f"{table}.parquet": recorded(seals, table, parquet_content(columns, about))
        for table, columns in sheets.items()
    }

    def last(file: BinaryIO) -> None:
        document["tables"] = seals
        document[SEAL] = seal(document)
        file.write(orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE))

    # It is written last, because it contains the checksums of all other files.
    files[SUMMARY] = last
    return files


def _digest(result: AdjustedNetwork, given: str, parts: Mapping[str, Sequence[Part]], rest: Any) -> str:
    digest = hashlib.sha256(orjson.dumps(rest))
    adjusted = getattr(result, given)
    own = [each.field for one in parts.values() for each in one if each.field.startswith(f"{given}.")]
    for name in (*_ROWS, *(each.removeprefix(f"{given}.") for each in own)):
        if (values := getattr(adjusted, name, None)) is not None:
            texts = isinstance(values, list)
            digest.update(orjson.dumps(values) if texts else np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def read_saved(folder: Path, classes: Iterable[type], document: Mapping[str, Any]) -> Saved:
    """Read the tables of a folder; refuse missing, damaged or other tables."""
    tables = document["tables"]
    for name in dict.fromkeys((*_READ, *tables)):
        check_seal(folder / f"{name}.parquet", tables.get(name), SUMMARY)
    sheets = {name: read_sheet(folder / f"{name}.parquet") for name in _READ[:-1]}
    return Saved(folder, document, Decoder(classes, folder / SUMMARY), sheets)


def read_summary(folder: Path) -> Mapping[str, Any]:
    """Read the document of a folder; refuse missing, other and later ones."""
    path = folder / SUMMARY
    document = read_json(path).value
    if not isinstance(document, dict) or not {"kind", "format", "kept", "tables"} <= document.keys():
        raise InputError(phrase("adjusted.summary"), file=path)
    if document["format"] != FORMAT:
        raise InputError(
            phrase("error.version", version=str(document["format"]), versions=[FORMAT]), file=path
        )
    check_sealed(document, path)
    return document


def rows_of(names: NameColumn, known: Sequence[str], path: Path) -> np.ndarray:
    """Return the index of the known name in each row of a column; refuse others."""
    places = {name: row for row, name in enumerate(known)}
    try:
        codes = np.array([places[name] for name in names.names], dtype=np.int64)
    except KeyError as error:
        raise InputError(phrase("adjusted.name", name=error.args[0]), file=path) from None
    found: np.ndarray = codes[names.rows] if len(codes) else np.zeros(0, dtype=np.int64)
    return found
