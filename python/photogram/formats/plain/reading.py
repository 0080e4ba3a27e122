"""Reader of the plain project (docs/formats/plain-tables.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from photogram.arguments.arrays import matrix_fault
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.names import NamedValues
from photogram.formats.plain import SETTINGS
from photogram.formats.plain.boards import ASSUMED, REGULARISED, TIMES, read_boards
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.films import on_film, read_scanned
from photogram.formats.plain.observations import Known, read_observations
from photogram.formats.plain.photos import (
    Images,
    ImageSource,
    images_of,
    mounted_halves,
    read_photos,
    spread_over_photos,
    with_seams,
)
from photogram.formats.plain.rigs import placed, read_frames, read_rigs, read_timed, times_of
from photogram.formats.plain.schema import AXES, SD_AXES, TABLES
from photogram.formats.plain.settings import read_settings, unread_tables
from photogram.formats.plain.statement_tables import asked_of, read_cover
from photogram.formats.plain.tables import Tables, Transform, check_rows, covariances_of
from photogram.formats.plain.trajectories import read_trajectories
from photogram.formats.plain.unknowns import read_covariances
from photogram.formats.project import Project, Unused
from photogram.formats.read_options import ReadOptions
from photogram.io.column_table import ColumnTable
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.geometry import Spheroid
from photogram.network.observations import Control, Observation, Observations
from photogram.results.features import named_points
from photogram.words import Phrase, option_sd, phrase

DIFFER = 1e-6  # Largest difference of the positions of a point in two tables


def read(path: Path, options: ReadOptions) -> Project:
    """Read the project of a folder, or of a file of settings."""
    settings = read_settings(path / SETTINGS if path.is_dir() else path, options)
    project, _ = read_tables(Tables(settings, unread_tables(settings)), options)
    return project


def read_tables(tables: Tables, options: ReadOptions) -> tuple[Project, ImageSource]:
    settings = tables.settings
    if "images" not in settings.tables:
        raise InputError(phrase("error.missing", name="images.csv"), file=settings.path)
    tables, seams = with_seams(tables)
    transform = Transform(settings, tables.messages)
    if options.cameras is not None:
        files = {**settings.tables, "cameras": options.cameras}
        tables = replace(tables, settings=replace(settings, tables=files))
    cameras, covariances = read_cameras(tables), read_covariances(tables)
    trajectories = read_trajectories(tables)
    control = tables.read("control")
    # A frame without origin is defined by control, which is therefore transformed first.
    given = None if control is None else read_control(tables, control, transform)
    photos = read_photos(tables, transform, cameras)
    rigs = read_rigs(tables)
    timed = read_timed(tables, photos, cameras, trajectories, rigs)
    geographic = transform.frame.kind == "geographic"
    spheroid = Spheroid(*transform.frame.ellipsoid) if geographic else None
    photos = placed(photos, timed, spheroid)
    images = images_of(tables, tables.rows("images"), photos)
    block = BlockBuilder(settings.path, "plain project")
    places, control_rows, known = _add_points(block, tables, transform, images, given)
    scanned = read_scanned(tables, images, known, photos, cameras, covariances)
    cameras = on_film(cameras, photos, scanned, tables.messages)
    cameras, photo_cameras = spread_over_photos(cameras, photos)
    source = ImageSource(tables, photos, cameras, np.asarray(photo_cameras), scanned.photos)
    xy, sd = source.converted(images)
    for row, own in enumerate(cameras.rows):
        block.camera(own.camera, own.size, own.pixel_mm, key=row)
    block.photos(photos.names, photo_cameras, photos.centres, photos.matrices)
    block.position_sd, block.attitude_sd = photos.position_sd, photos.attitude_sd
    owners = {each.name: row for row, each in enumerate(cameras.cameras)}
    owners |= dict(zip(photos.taken, photo_cameras, strict=True))
    block.rigs(read_frames(tables, rigs, photos), owners)
    block.mounts = mounted_halves(seams, block.mounts, timed, photos.names)
    known_objects = Known(places, photos.rows, photos.table.numbers("time").tolist(), trajectories)
    observations = Observations.of(read_observations(tables, transform, known_objects, rigs))
    boards, bends, regularise = read_boards(tables)
    if trajectories and transform.frame != settings.frame:
        message = phrase("plain.trajectory-frame", frame=str(transform.frame))
        raise InputError(message, file=settings.path)
    assumed = not images.sd_given
    block.images(images.photos, images.points, xy, sd)
    controlled = [] if given is None else given.observed
    block.observations = [observations, *photos.observed, *controlled, *scanned.observations]
    block.frame, block.messages = transform.frame, list(tables.messages)
    if assumed and sd is not None:
        block.lacks.append(Phrase("read.levels", {"number": 1.0, "option": option_sd("images")}))
    project = block.project(
        title=settings.name,
        passages=[*scanned.scans, *bends],
        timed=timed,
        options=settings.options,
        linear_unit=settings.length,
        spheroid=spheroid,
        photo_to_ground=settings.attitude == "omega_phi_kappa" and settings.rotation == "photo_to_object",
        details={
            "settings": settings,
            ASSUMED: assumed,
            REGULARISED: regularise,
            TIMES: times_of(tables, "frames") | times_of(tables, "photos"),
            **scanned.inside,
        },
    ).replace(
        sd_taken=True,
        boards=boards,
        unused=_unused(source, images.left) if boards and images.left is not None else Unused(),
        features=settings.features,
        control_crs=settings.crs.get("control", ""),
        statement=asked_of(tables, places, frozenset() if given is None else given.vegetated),
    )
    if priors := covariances.priors(project.block.unknowns):
        every = Observations.of([observations, *priors, *block.observations[1:]])
        project = project.replace(block=project.block.replace(observations=every))
    for name, (_, wanted) in settings.features.items():
        with at_place(Place(settings.path), f"[features] {name}"):
            named_points(wanted, block.point_ids)
    if control is not None and given is not None:
        from photogram.formats.control import check_systems

        check_systems(project, settings, control, control_rows, control.vectors(AXES), free=False)
    return project, source


def _unused(source: ImageSource, left: Images) -> Unused:
    """Return the omitted image observations of a board."""
    xy, sd = source.converted(left)
    return Unused(
        photos=tuple(source.photos.names[row] for row in left.photos.tolist()),
        points=tuple(left.point_names[row] for row in left.points.tolist()),
        xy=xy,
        sd=np.ones_like(xy) if sd is None else sd,
    )


@dataclass(frozen=True)
class _Given:
    """Control and check points: fixed, weighted, checked or correlated."""

    table: ColumnTable
    names: list[str]
    positions: Floats
    sd: Floats
    check_sd: Floats
    observed: list[Observation]
    vegetated: frozenset[str]


def read_control(tables: Tables, table: ColumnTable, transform: Transform) -> _Given:
    names = table.names_once("point")
    values = table.vectors(AXES)
    uses = table.words("use", TABLES["control"].words["use"])
    sd = table.vectors(SD_AXES, infinite=True)
    stray = ~np.isnan(sd) & np.isnan(values)
    if stray.any():
        row, k = np.argwhere(stray)[0].tolist()
        raise table.cell_error(row, SD_AXES[k], "plain.sd-alone", value=AXES[k])
    check = np.array([each == "check" for each in uses], dtype=bool)[:, np.newaxis]
    sd = tables.deviations(table, "control", SD_AXES)
    if "check" in tables.settings.sd:
        sd = np.where(check, tables.deviations(table, "check", SD_AXES), sd)
    is_control = np.array([each == "control" for each in uses], dtype=bool)
    without_sd = is_control & (np.isnan(sd) & ~np.isnan(values)).any(axis=1)
    for code, wrong in (("no-coordinates", np.isnan(values).all(axis=1)), ("control-sd", without_sd)):
        if wrong.any():
            row = int(np.argmax(wrong))
            raise table.error(row, phrase(f"plain.{code}", point=names[row]))
    sd = np.where(np.isnan(sd) | np.isnan(values), np.inf, sd)
    covariances = covariances_of(np.where(np.isinf(sd), 0.0, sd), table)
    values, turned = transform.positions("control", values, covariances, table)
    # Standard deviations are along the axes of the frame, without correlations.
    tilted = (turned != turned * np.eye(3)).any(axis=(1, 2))[:, np.newaxis]
    own = np.where(tilted, np.sqrt(np.diagonal(turned, axis1=1, axis2=2)), sd)
    check_sd = np.where(check & np.isfinite(sd), own, np.nan)
    held, observed = np.where(is_control[:, np.newaxis], sd, np.inf), list[Observation]()
    # Rotation does not change an isotropic covariance matrix.
    isotropic = (covariances == covariances[:, :1, :1] * np.eye(3)).all(axis=(1, 2))
    correlated = (turned * (1 - np.eye(3))).any(axis=(1, 2)) & np.isfinite(sd).all(axis=1)
    for row in np.flatnonzero(is_control & correlated & ~isotropic).tolist():
        if fault := matrix_fault(turned[row]):
            raise table.error(row, fault)
        observed.append(Control(names[row], values[row], covariance=(turned[row] + turned[row].T) / 2))
        held[row] = np.inf
    off = np.array([use == "off" for use in uses], dtype=bool)[:, np.newaxis]
    values = np.where(off, np.nan, values)
    vegetated = read_cover(table, names, uses)
    return _Given(table, names, values, held, check_sd, observed, vegetated)


def _add_points(
    block: BlockBuilder, tables: Tables, transform: Transform, images: Images, control: _Given | None
) -> tuple[Mapping[str, int], Indices, Floats]:
    """Add all points; return rows by name, rows of control, and (n, 3) observed or initial positions."""
    table = tables.read("points")
    own = table.names_once("point") if table is not None else []
    listed = [*(control.names if control else ()), *own]
    few = None if own else set(listed)
    rows_of_names = {name: row for row, name in enumerate(images.point_names) if few is None or name in few}
    others = [name for name in dict.fromkeys(listed) if name not in rows_of_names]
    names = [*images.point_names, *others]
    rows_of_names |= zip(others, range(len(images.point_names), len(names)), strict=True)
    starts = np.full((len(names), 3), np.nan)
    positions, sd, check_sd = starts.copy(), np.full((len(names), 3), np.inf), starts.copy()
    if table is not None:
        rows = np.array([rows_of_names[name] for name in own], dtype=np.int64)
        given = table.vectors(AXES)
        own_sd = tables.deviations(table, "points", SD_AXES, math.inf)
        given, _ = transform.positions("points", given, None, table)
        starts[rows] = given
        held: Bools = np.asarray(np.isfinite(own_sd).any(axis=1))
        alone = (np.isfinite(own_sd) & np.isnan(given)).any(axis=1)
        check_rows(table, alone, phrase("plain.sd-alone", value="x, y, z"))
        positions[rows] = np.where(held[:, np.newaxis], given, np.nan)
        sd[rows] = own_sd
    rows = np.array([rows_of_names[name] for name in control.names] if control else [], dtype=np.int64)
    if control is not None:
        apart = np.abs(starts[rows] - control.positions)
        if (apart > DIFFER).any():
            row, k = np.argwhere(apart > DIFFER)[0].tolist()
            fields = {"point": control.names[row], "axis": AXES[k], "difference": float(apart[row, k])}
            raise control.table.error(row, phrase("plain.other-position", **fields))
        positions[rows], sd[rows], check_sd[rows] = control.positions, control.sd, control.check_sd
        positions[[rows_of_names[each.points[0]] for each in control.observed]] = np.nan
        starts[rows] = np.where(np.isnan(control.positions), starts[rows], control.positions)
    complete = len(rows_of_names) == len(names)
    places = rows_of_names if complete else NamedValues(names, range(len(names)))
    block.points(names, starts, point_positions=positions, point_sd=sd, point_check_sd=check_sd)
    return places, rows, np.where(np.isfinite(positions), positions, starts)
