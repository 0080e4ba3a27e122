"""Results in files: tables, also in another system, the adjusted project, and saved results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from photogram.adjustment.options import AdjustOptions, DatumName
from photogram.arguments.arrays import natural_order
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.crs import axes_of, has_place, in_degrees, is_on, to_system, turned_covariances
from photogram.formats.format import FORMATS
from photogram.formats.project import Project, frame_of
from photogram.formats.read_options import ReadOptions
from photogram.io.csv_text import csv_text
from photogram.io.places import Place, one_word
from photogram.io.sheets import workbook
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.attitudes import Attitudes, angles_form
from photogram.network.block import Block
from photogram.network.film_reduction import is_scanned
from photogram.network.geometry import Frame, Spheroid, lengths_of_units
from photogram.network.observations import Control
from photogram.results.features import Features, deviation_quantities, quantity_columns
from photogram.results.footprints import metric_covariances
from photogram.results.result import Result
from photogram.results.result_files import SUMMARY, read_summary
from photogram.results.tables import TABLE_FILES, TABLES
from photogram.show.page import Section, decimals_of
from photogram.show.quantity import Axis, Quantity, Table, chosen, column, frame, named, unit_comments
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.collection.result import AdjustedCollection


def read_result(directory: str | PathLike[str]) -> Result | AdjustedCollection:
    """Read a result from the files of `to_parquet` or `--parquet DIR`.

    Values, residuals and redundancy numbers are identical to the last bit, covariances up to rounding
    (2e-16). Other output, such as the log of data snooping, is not included.

    Parameters
    ----------
    directory
        The folder.

    Raises
    ------
    InputError
        If files are missing, damaged, of another version, or contradict each other.
    ModuleNotFoundError
        If pyarrow is not installed.
    """
    from photogram.collection.result_files import KIND as COLLECTION
    from photogram.collection.saved_result import read_collection_result
    from photogram.results.block_files import KIND as BLOCK
    from photogram.results.saved_block import read_block_result

    readers: Mapping[str, Callable[[Path, Mapping[str, Any]], Result | AdjustedCollection]] = {
        BLOCK: read_block_result,
        COLLECTION: read_collection_result,
    }
    folder = path_of("directory", directory)
    document = read_summary(folder)
    kind = one_word(Place(folder / SUMMARY), "kind of the result", str(document["kind"]), readers)
    try:
        return readers[kind](folder, document)
    except InputError:
        raise
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(phrase("results.contradiction", reason=str(error)), file=folder / SUMMARY) from None


def read_project(path: Path, options: ReadOptions) -> Project:
    """Read the adjusted block of a result, with its adjustment settings."""
    result = read_result(path)
    if not isinstance(result, Result):
        raise InputError(phrase("results.collection"), file=path)
    datums: dict[str, DatumName] = {"inner constraints": "inner", "minimum constraints": "minimum"}
    variances: dict[str, Literal["unity", "redundancy"]] = {"unity": "unity", "redundancy": "redundancy"}
    return Project(
        block=result.restarted(),
        path=path,
        title=FORMATS["results"].title,
        starts=np.array(result.point_positions),
        frame=result.block.frame,
        options=AdjustOptions(
            datum=datums.get(result.datum.kind),
            loss=None if result.loss is None else cast("Any", result.loss[0]),
            unit_variance=variances.get(result.unit_variance, "constrained"),
        ),
        features={} if result.features is None else result.features.definitions,
    )


def adjusted(project: Project, result: Result) -> Project:
    starts = np.where(np.isfinite(result.point_positions), result.point_positions, project.starts)
    return project.replace(block=result.restarted(), starts=starts, lacks=())


def project_files(project: Project, result: Result) -> tuple[dict[str, bytes], list[Phrase]]:
    """Return the tables of a result, the adjusted project in its own format and as tables, and remarks."""
    from photogram.formats import FORMATS, to_files

    after, files, remarks = adjusted(project, result), dict(table_files(result)), []
    own = next((name for name, each in FORMATS.items() if each.title == project.title), "plain")
    for name in dict.fromkeys(("plain", own)):
        folder = "adjusted" if name == "plain" else f"adjusted-{name}"
        form = FORMATS[name]
        made = {}
        try:
            made = dict(to_files(after, name)) if form.write is not None else {}
        except InputError as error:
            if name == own == "plain" and not is_scanned(after.block):
                raise
            remarks.append(phrase("command.not-written", format=form.title, error=error))
        if name != "plain" and form.results is not None:
            made |= form.results(after, result)
        files |= {f"{folder}/{file}": content for file, content in made.items()}
    return files, remarks


def _filled_tables(result: Result) -> Iterator[tuple[str, dict[str, Any], list[str]]]:
    """Yield name, columns and comments on units of tables with rows."""
    for name, kind in {"photos": "photo", "points": "point", "images": "image", **TABLE_FILES}.items():
        columns = frame(table := TABLES[kind](result))
        if len(next(iter(columns.values()))):
            yield name, columns, unit_comments(table)


def table_files(result: Result) -> Mapping[str, bytes]:
    """Return the tables of a result as CSV by file name, without empty tables."""
    tables = _filled_tables(result)
    files = {f"{name}.csv": csv_text(columns, comments) for name, columns, comments in tables}
    if result.films:
        # Film observations in the camera frame, for programs without film models.
        (xy, sd), block = result.refined, result.block
        known = np.flatnonzero(np.isfinite(xy).all(axis=1))
        columns = {
            "photo": [block.photo_ids[row] for row in block.image_photos[known].tolist()],
            "point": [block.point_ids[row] for row in block.image_points[known].tolist()],
            **dict(zip(("x", "y", "sd_x", "sd_y"), np.hstack([xy, sd])[known].T, strict=True)),
        }
        comments = [
            "mm in the frame of the marks, x right and y up on the positive; the lens is not taken out",
            "sd: of the readings; what images of a film, a scanner and a camera have in common is left out",
        ]
        files["refined.csv"] = csv_text(columns, comments)
    if np.isfinite(result.photo_cofactors).any():
        names = ("x", "y", "z", "omega", "phi", "kappa")
        points = np.array(result.block.point_ids, dtype=object)[result.used_points]
        for kind, ids, covariances, own in (
            ("photo", result.block.photo_ids, result.photo_covariances, names),
            ("point", points, result.point_covariances[result.used_points], names[:3]),
        ):
            # Lower triangles row by row, one matrix per line
            pairs = [(i, j) for i in range(len(own)) for j in range(i + 1)]
            packed = {f"c_{own[i]}_{own[j]}": covariances[:, i, j] for i, j in pairs}
            scale, unit = result.covariance_scale, result.block.linear_unit
            comments = [
                f"covariances, scaled by the variance of unit weight {scale!r}; datum: {result.datum}",
                f"units: {unit} for x, y, z" + ", rad for omega, phi, kappa" * (kind == "photo"),
            ]
            files[f"{kind}_covariances.csv"] = csv_text({kind: ids, **packed}, comments)
    return files


def feature_files(features: Features) -> Mapping[str, bytes]:
    quantities = {"features.csv": quantity_columns, "feature_deviations.csv": deviation_quantities}
    tables = {name: frame(columns(features)) for name, columns in quantities.items()}
    return {name: csv_text(columns) for name, columns in tables.items() if columns["feature"]}


def excel_file(result: Result) -> bytes:
    """Return the tables of a result as a workbook, with units in `notes`."""
    tables = list(_filled_tables(result))
    notes = {name: "; ".join(comments) for name, _, comments in tables if comments}
    return workbook({name: columns for name, columns, _ in tables}, notes)


_ANGLES = ("omega", "phi", "kappa")
_LOCAL = ("east", "north", "up")
_METRES = tuple(Axis.of(axis, "m") for axis in _LOCAL)
DEGREE = 180.0 / np.pi  # Degrees per radian
MOST = 500  # Largest number of listed points; tables contain all


@dataclass(frozen=True, eq=False)
class Placed:
    """A result in a coordinate reference system.

    Attributes
    ----------
    result
        The result.
    crs
        The requested system.
    names, units
        Names and units of the three coordinates.
    rows
        (k,) points used in the adjustment.
    photos, points
        (P, 3) and (k, 3) positions: longitude or easting, latitude or northing, height; angles in degrees.
    photo_covariances, point_covariances
        (P, 3, 3) and (k, 3, 3), along east, north and up of the system (grid axes of a projected one), square
        metres.
    photo_turns, point_turns
        (P, 3, 3) and (k, 3, 3) rotations of vectors from the axes of the block to these axes.
    attitudes
        Attitudes of the photos relative to these axes at each photo.
    """

    result: Result
    crs: str
    names: tuple[str, str, str]
    units: tuple[str, str, str]
    rows: Indices
    photos: Floats
    points: Floats
    photo_covariances: Floats
    point_covariances: Floats
    photo_turns: Floats
    point_turns: Floats
    attitudes: Attitudes

    def angles(self) -> tuple[Floats, Floats]:
        """Return (P, 3) omega, phi, kappa relative to the system's axes and standard deviations, radians.

        The sense of the angles is the one of the block.
        """
        kind = angles_form(self.result.block.photo_to_ground)
        if self.attitudes.step_covariances is None:
            return self.attitudes.values(kind), np.full((len(self.photos), 3), np.nan)
        return self.attitudes.values(kind), self.attitudes.standard_deviations(kind)

    def carried(self, xyz: Floats) -> Floats:
        """Transform (n, 3) positions of the block into the system."""
        return _carried(self.result.block, self.crs, check_place(self.result.block, self.crs), xyz)[0]

    def moved(self, places: Floats, steps: Floats) -> Floats:
        """Shift (n, 3) positions of the system by (n, 3) metres east, north, up."""
        if self.names[0] != "longitude":
            return places + steps
        known = np.column_stack([np.radians(places[:, :2]), places[:, 2]])
        lengths = lengths_of_units(known, self.result.block.spheroid or Spheroid.wgs84())
        return places + steps / lengths * [DEGREE, DEGREE, 1.0]

    def control_differences(self) -> tuple[Indices, Floats]:
        """Return rows and (c, 3) differences adjusted minus given of control, metres.

        Rows are among all points. Differences are along east, north and up. Differences of free components
        are 0 before the rotation. Control observed with a covariance matrix follows the other control.
        """
        control, kind = self.result.control, self.result.kinds.get(Control.KIND)
        names, observed = list[str](), np.zeros((0, 3))
        if kind is not None:
            used = np.isfinite(kind.residuals).all(axis=1)
            observations = self.result.block.observations
            names = [observations[row].points[0] for row in kind.rows[used].tolist()]
            observed = -kind.residuals[used]
        ids = {name: row for row, name in enumerate(self.result.block.point_ids)} if names else {}
        rows = np.append(control.rows, np.array([ids[name] for name in names], dtype=np.int64))
        differences = np.vstack([_metric(self.result, control.rows, control.differences), observed])
        places = {row: k for k, row in enumerate(self.rows.tolist())}
        own = self.point_turns[[places[row] for row in rows.tolist()]]
        return rows, _turned(own, differences)

    def differences(self) -> tuple[Indices, Floats]:
        """Return rows and (c, 3) adjusted minus given of check points, metres."""
        result = self.result
        own = result.point_kinds[self.rows] == "check"
        rows = self.rows[own]
        return rows, _turned(self.point_turns[own], _metric(result, rows, result.point_differences[rows]))


def check_place(block: Block, crs: str) -> Frame:
    """Return the frame of a block for results in a system.

    If only the ellipsoid of longitudes and latitudes is known, the requested system defines their datum.
    """
    frame = frame_of(block)
    if not crs:
        return frame
    axes_of(crs)
    if frame.kind == "geographic" and not has_place(frame):
        if not is_on(crs, frame.ellipsoid):
            raise InputError(phrase("crs.ellipsoid", crs=crs, a=frame.ellipsoid[0], b=frame.ellipsoid[1]))
        return replace(frame, crs=crs)
    if not has_place(frame):
        raise InputError(phrase("crs.results-place", crs=crs, frame=frame.phrase))
    if block.linear_unit != "m":
        raise InputError(phrase("crs.metres", crs=crs, unit=block.linear_unit))
    return frame


def placed(result: Result, crs: str = "") -> Placed:
    """Transform a result into a coordinate reference system.

    Parameters
    ----------
    result
        Result of a block in a frame with a known position on the earth.
    crs
        The system: `EPSG:25832`, `EPSG:4979`, `ENU:lat,lon[,h]` ... Heights are ellipsoidal if the system has
        none. Empty: the axes of the block.

    Raises
    ------
    InputError
        If the position of the frame on the earth is unknown, or lengths are not metres. If PROJ does not know
        the system, lacks a grid for heights, or cannot transform a position.
    """
    block = result.block
    rows = np.flatnonzero(result.used_points)
    covariances = metric_covariances(result, photos=True), metric_covariances(result)[rows]
    places = result.photo_positions, result.point_positions[rows]
    frame = check_place(block, crs)
    (photos, photo_turns), (points, point_turns) = (_carried(block, crs, frame, xyz) for xyz in places)
    names, units = ("x", "y", "z"), (block.linear_unit,) * 3
    if crs:
        names, units = axes_of(crs)
    elif block.geographic:
        names, units = ("longitude", "latitude", "height"), ("deg", "deg", block.linear_unit)
    turned = list(map(turned_covariances, (photo_turns, point_turns), covariances))
    attitude_covariances = result.photo_covariances[:, 3:, 3:]
    known = attitude_covariances if np.isfinite(attitude_covariances).all() else None
    own = Attitudes.of(angles_form(block.photo_to_ground), result.photo_attitudes, known)
    return Placed(
        result=result,
        crs=crs,
        names=names,
        units=units,
        rows=rows,
        photos=photos,
        points=points,
        photo_covariances=turned[0],
        point_covariances=turned[1],
        photo_turns=photo_turns,
        point_turns=point_turns,
        attitudes=replace(own, matrices=photo_turns @ own.matrices),
    )


def placed_files(found: Placed) -> dict[str, bytes]:
    ids = np.array(found.result.block.point_ids, dtype=object)
    degrees = tuple(Axis(name, "deg", suffix="_deg") for name in _ANGLES)
    angles = zip(("", "sd"), map(np.degrees, found.angles()), strict=True)
    tables: dict[str, list[Quantity]] = {
        "photos.csv": [
            column("photo", found.result.block.photo_ids),
            *_positions(found, found.photos, found.photo_covariances),
            *(Quantity(values, degrees, "deviation", name) for name, values in angles),
        ],
        "points.csv": _points(found),
    }
    differences = {"control.csv": found.control_differences(), "check_points.csv": found.differences()}
    for name, (rows, vectors) in differences.items():
        if len(rows):
            tables[name] = [column("point", ids[rows]), Quantity(vectors, _METRES, "deviation", "d")]
    comments = [
        f"coordinates in {found.crs}: "
        + ", ".join(f"{name} {unit}" for name, unit in zip(found.names, found.units, strict=True)),
        "sd_ and c_ (covariances, scaled by the variance of unit weight) and all differences are in metres"
        " along east, north and up of this system",
        f"datum: {found.result.datum}",
    ]
    return {name: csv_text(frame(columns), comments) for name, columns in tables.items()}


def _carried(block: Block, crs: str, frame: Frame, xyz: Floats) -> tuple[Floats, Floats]:
    """Return positions in a system, and rotations of vectors."""
    if crs:
        return to_system(crs, xyz, frame)
    return in_degrees(xyz, block.geographic), np.broadcast_to(np.eye(3), (len(xyz), 3, 3))


def _points(found: Placed) -> list[Quantity]:
    result, ids = found.result, np.array(found.result.block.point_ids, dtype=object)
    return [
        column("point", ids[found.rows], "Point", kind="name"),
        column("kind", result.point_kinds[found.rows], "Kind", kind="name"),
        column("rays", result.point_rays[found.rows]),
        *_positions(found, found.points, found.point_covariances),
    ]


def _positions(found: Placed, xyz: Floats, covariances: Floats) -> list[Quantity]:
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    decimals = decimals_of(sd)
    pairs = [(i, j) for i in range(3) for j in range(i + 1)]
    columns = []
    for name, unit, values in zip(found.names, found.units, xyz.T, strict=True):
        axis, own = Axis.of(name.capitalize(), unit), 8 if unit == "deg" else decimals
        columns.append(Quantity(values, (axis,), "deviation", name, head="{}", decimals=own))
    return [
        *columns,
        Quantity(sd, _METRES, "deviation", "sd", head="sd {}", decimals=decimals),
        *(column(f"c_{_LOCAL[i]}_{_LOCAL[j]}", covariances[:, i, j]) for i, j in pairs),
    ]


def _metric(result: Result, rows: Indices, differences: Floats) -> Floats:
    """Return position differences in linear units; 0 for missing values."""
    lengths = lengths_of_units(result.point_positions[rows], result.block.spheroid)
    return np.where(np.isnan(differences), 0.0, differences * lengths)


def _turned(turns: Floats, vectors: Floats) -> Floats:
    return np.asarray(np.einsum("nij,nj->ni", turns, vectors))


def placed_section(found: Placed) -> Section:
    """Return the section of adjusted control and check points in a system.

    Standard deviations and differences from given positions are in metres along east, north and up.
    """
    names, kinds = found.result.block.point_ids, found.result.point_kinds
    own = [k for k, row in enumerate(found.rows.tolist()) if kinds[row] != "pass"]
    own.sort(key=lambda k: natural_order(names[int(found.rows[k])]))
    rows, differences = found.rows[own[:MOST]], dict[int, Floats]()
    for given, steps in (found.differences(), found.control_differences()):
        differences |= zip(given.tolist(), steps, strict=True)
    columns = chosen(_points(found), np.array(own[:MOST], dtype=np.int64))
    decimals = named(columns, "sd").decimals
    steps = np.array([differences[row] for row in rows.tolist()])
    columns.append(Quantity(steps, _METRES, "deviation", head="d {}", decimals=decimals))
    more = f"; {len(own) - MOST} more there." if len(own) > MOST else "."
    note = f"d: adjusted minus given. Tables of all photos and points are in `in_crs`{more}"
    title = f"Control and check points in {found.crs}"
    return Section("in-crs", title, [Table("", title, columns, note)] if own else [])
