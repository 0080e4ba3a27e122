"""Writer of the plain project; reading its files gives the same block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.images import by_camera, to_tables
from photogram.formats.models import correlated_control, known_cameras, known_points
from photogram.formats.plain.boards import ASSUMED, REGULARISED, TIMES, boards_table
from photogram.formats.plain.cameras import Exposure, exposure_cells, knots_table, of_cameras
from photogram.formats.plain.films import WrittenFilms
from photogram.formats.plain.observations import observation_tables
from photogram.formats.plain.rigs import Rigs, line_times_table, moving_columns
from photogram.formats.plain.schema import AXES, OPK, TABLES, deviation_columns
from photogram.formats.plain.settings import KEYS, LENGTHS, VERSION, Settings, asked_files, key_tables
from photogram.formats.plain.statement_tables import COVERS
from photogram.formats.plain.tables import (
    columns_of,
    columns_of_records,
    correlations,
    places_written,
    signs_in_files,
)
from photogram.formats.plain.trajectories import smoothness_beside, smoothness_table, trajectory_tables
from photogram.formats.plain.unknowns import covariance_tables
from photogram.formats.project import Project, Size
from photogram.io.csv_text import csv_text
from photogram.io.files import read_text
from photogram.io.numbers import MATRIX_ROUNDING, degrees_typed
from photogram.io.toml import quoted_text, toml_text, with_comments
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.film_reduction import camera_unit
from photogram.network.moving_photos import LineSensor
from photogram.network.observations import Control, Position
from photogram.words import phrase


def cannot_hold(project: Project) -> list[str]:
    """Return the parts of a project that the tables cannot contain."""
    block = project.block
    found = [] if block.refraction is None else ["refraction"]
    if sums := sum(place is None for _, place in smoothness_beside(block)):
        found.append(f"{sums} sums of coefficients that are no neighbours, or too many")
    cameras, which = known_cameras(block)
    lost = Rigs(block, [cameras[row].name for row in which], {}).lost
    if lost:
        found.append(f"{lost} bases of sensors that took no photo")
    observed = [each.point for each in block.observations.of_type(Control)]
    held = np.flatnonzero(np.isfinite(block.point_sd).any(axis=1)).tolist()
    twice = {block.point_ids[row] for row in held}.intersection(observed)
    if again := len(observed) - len(set(observed)) + len(twice):
        found.append(f"{again} second positions of points: the table of control has a row for each")
    return found


def write(project: Project) -> Mapping[str, bytes]:
    block = project.block
    cameras, photo_cameras = known_cameras(block)
    rigs = Rigs(block, [cameras[row].name for row in photo_cameras], _times_of(project))
    exposures = of_cameras(block, cameras, photo_cameras)
    films = WrittenFilms(project, [cameras[row].name for row in photo_cameras])
    lines = np.array([isinstance(each, LineSensor) for each in exposures])[photo_cameras]
    image_y = _image_y(project, cameras, exposures)
    lines_alone = camera_unit(block) != "px" and bool(lines[block.image_photos].all())
    names = ["column", "row"] if image_y == "down" or lines_alone or films.pixels else ["x", "y"]
    # Samples and lines, and readings of films, are unchanged.
    plain = lines | np.array([name in films.films for name in block.photo_ids])
    tables = {
        "cameras": camera_table(project, cameras, exposures, image_y),
        "photos": _photos(project, [cameras[row].name for row in photo_cameras], rigs)
        | films.photo_columns(),
        "images": _images(project, names, cameras, photo_cameras, plain, image_y),
        "points": _points(project),
        "control": control_table(project),
        **trajectory_tables(block),
        "smoothness": smoothness_table(block),
        "line_times": line_times_table(block),
        **observation_tables(block),
        **rigs.tables(block),
        **films.tables(),
        **covariance_tables(block, cameras, rigs.title, films.covariances()),
        "boards": boards_table(project.boards, block, project.details.get(REGULARISED)),
        "knots": knots_table(cameras),
        "lengths": columns_of_records(
            {name: each.get(name) for name in TABLES["lengths"].columns}
            for each in project.statement.get("lengths", ())
        ),
    }
    files = {f"{name}.csv": csv_text(columns) for name, columns in tables.items() if columns}
    settings = _settings(project, image_y, films).encode()
    return {"project.toml": settings, **files, **asked_files(project.statement)}


def _image_y(project: Project, cameras: Sequence[Camera], exposures: Sequence[Exposure]) -> str:
    if camera_unit(project.block) != "px":
        return "up"
    sizes, _ = _pictures(project, cameras)
    frames = [row for row, each in enumerate(exposures) if not isinstance(each, LineSensor)]
    ups = {cameras[row].image_y for row in frames}
    if ups == {"down"} or None not in [sizes[row] for row in frames]:
        return "down"
    if "down" in ups:
        raise InputError(phrase("plain.both-origins"))
    return "up"


def _pictures(project: Project, cameras: Sequence[Camera]) -> tuple[list[Size | None], list[float | None]]:
    if not project.block.cameras:
        # Principal distances are not cameras of the project.
        return [None] * len(cameras), [None] * len(cameras)
    sizes: list[Size | None] = list(project.sizes)
    for row, each in enumerate(cameras):
        if "w" in each.names:
            sizes[row] = round(each.parameters["w"]), round(each.parameters["h"])
    return sizes, list(project.pixel_mm)


def _settings(project: Project, image_y: str, films: WrittenFilms) -> str:
    block, frame, options, spheroid = project.block, project.frame, project.options, project.block.spheroid
    unit = block.linear_unit if block.linear_unit in LENGTHS else "m"
    settings = project.details.get("settings")
    values: dict[str, Any] = {
        "format": VERSION,
        "name": block.title,
        "frame.crs": frame.crs or None,
        "frame.ellipsoid": None if spheroid is None else (spheroid.a, spheroid.b),
        "length": unit,
        "angle": "deg",
        "image": camera_unit(block),
        "image_y": image_y,
        "rotation": "photo_to_object" if block.photo_to_ground else None,
        "interior": "before" if films.before else None,
    }
    values |= {f"frame.{name}": getattr(frame, name) for name in ("kind", "origin")}
    names = [each.field for each in KEYS if each.field.startswith("options.")]
    values |= {name: getattr(options, name.removeprefix("options.")) for name in names}
    values["options.loss"] = options.loss or "none"
    if isinstance(settings, Settings) and settings.times:
        values |= {"time_origin": settings.time_origin, "time_scale": settings.time_scale}
    features = {quoted_text(name): {kind: points} for name, (kind, points) in project.features.items()}
    text = toml_text(key_tables(values, project.statement, unit) | {"features": features})
    if isinstance(settings, Settings) and settings.path.suffix == ".toml" and settings.path.is_file():
        return with_comments(text, read_text(settings.path))
    return text


def camera_table(
    project: Project, cameras: Sequence[Camera], exposures: Sequence[Exposure] = (), image_y: str = "up"
) -> dict[str, Any]:
    """Return the columns of the cameras of a project, with their shutters or line sensors."""
    # Columns ignore case: B1 of one model and b1 of another share a column.
    spelled = {name.lower(): name for each in reversed(cameras) for name in reversed(each.names)}
    pairs = [list(zip(each.names, each.deviations.tolist(), strict=True)) for each in cameras]
    weighted = {name.lower() for own in pairs for name, sd in own if sd}
    rows, more = list[dict[str, Any]](), list[dict[str, Any]]()
    pictures = zip(*_pictures(project, cameras), exposures or [None] * len(cameras), strict=True)
    for camera, deviations, (size, pixel_mm, exposure) in zip(cameras, pairs, pictures, strict=True):
        cells: dict[str, Any] = {"camera": camera.name, "model": camera.model}
        cells |= zip(("width", "height"), size or (None, None), strict=True)
        cells |= {"pixel_mm": pixel_mm, "weights": camera.weights if camera.weights != "corrected" else None}
        names = [name for name in camera.names if name not in ("w", "h")]
        for name, sign in zip(names, signs_in_files(names).tolist(), strict=True):
            cells[spelled[name.lower()]] = sign * camera.parameters[name]
        own = {f"sd_{spelled[name.lower()]}": sd for name, sd in deviations if name.lower() in weighted}
        more.append(own | exposure_cells(exposure, camera, size, pixel_mm, image_y))
        rows.append(cells)
    return columns_of_records(cells | own for cells, own in zip(rows, more, strict=True))


def _photos(project: Project, cameras: list[str], rigs: Rigs) -> dict[str, Any]:
    block = project.block
    positions, sd = _given(block, "position")
    attitudes, angle_sd = _given(block, "attitude")
    columns: dict[str, Any] = {"photo": block.photo_ids, "camera": cameras}
    columns |= columns_of(AXES, places_written(block, positions))
    columns |= columns_of(OPK, degrees_typed(attitudes, MATRIX_ROUNDING))
    for names, values in ((AXES, sd), (OPK, degrees_typed(angle_sd))):
        if np.isfinite(values).any():
            columns |= columns_of(deviation_columns(names), values)
    drifts = any(isinstance(each, Position) and each.drift is not None for each in block.observations)
    times: Mapping[Any, float | None] = _times_of(project)
    if drifts:
        times = {each.photo: each.time for each in block.observations if isinstance(each, Position)}
    if times and not block.timed:
        columns["time"] = [times.get(photo) for photo in block.photo_ids]
    return columns | moving_columns(block, rigs)


def _times_of(project: Project) -> Mapping[str, float]:
    return project.details.get(TIMES, {}) if project.boards else {}


def _given(block: Block, what: str) -> tuple[Floats, Floats]:
    """Return photo values (observed if weighted) and standard deviations."""
    initial, sd = getattr(block, f"photo_{what}s"), getattr(block, f"photo_{what}_sd")
    observed = getattr(block, f"photo_{what}s_observed")
    return (initial if observed is None else np.where(np.isfinite(sd), observed, initial)), sd


def _images(
    project: Project,
    names: list[str],
    cameras: Sequence[Camera],
    photo_cameras: Sequence[int],
    plain: Bools,
    image_y: str,
) -> dict[str, Any]:
    """Return image columns; omitted observations are last."""
    block, left = project.block, project.unused
    photos, points = np.array(block.photo_ids, dtype=object), np.array(block.point_ids, dtype=object)
    places = {name: row for row, name in enumerate(block.photo_ids)}
    kept = [row for row, name in enumerate(left.photos) if name in places]
    of_photos = np.append(block.image_photos, [places[left.photos[row]] for row in kept]).astype(np.int64)
    which = np.where(plain, -1, photo_cameras)[of_photos]
    sizes, _ = _pictures(project, cameras)
    xy = by_camera(
        np.vstack([block.image_xy, left.xy[kept]]),
        which,
        lambda row, own: to_tables(image_y, cameras[row], sizes[row], own),
    )
    columns: dict[str, Any] = {
        "photo": photos[of_photos],
        "point": np.append(points[block.image_points], [left.points[row] for row in kept]),
        names[0]: xy[:, 0],
        names[1]: xy[:, 1],
    }
    sd = np.vstack([block.image_sd, left.sd[kept]])
    assumed = bool(project.boards) and bool(project.details.get(ASSUMED))
    level = np.round(np.log2(sd[:, 0])) if assumed else sd[:, 0]
    if assumed and np.array_equal(2.0**level, sd[:, 0]):
        columns["level"] = level.astype(np.int64)
    elif (sd[:, 0] == sd[:, 1]).all():
        columns["sd"] = sd[:, 0]
    else:
        columns |= columns_of(deviation_columns(names), sd)
    if kept:
        columns["use"] = [""] * len(block.image_xy) + ["off"] * len(kept)
    return columns


def control_table(project: Project) -> dict[str, Any]:
    block, known = project.block, known_points(project)
    if not known.rows:
        return {}
    positions, sd, names = known.positions, known.sd, [block.point_ids[row] for row in known.rows]
    columns: dict[str, Any] = {"point": names} | columns_of(AXES, places_written(block, positions))
    # Only known coordinates of a control point are written with an infinite standard deviation: free.
    columns |= columns_of(deviation_columns(AXES), np.where(np.isinf(sd) & np.isnan(positions), np.nan, sd))
    columns |= correlations(known.covariances, AXES)
    columns["use"] = ["check" if check else "control" for check in known.checks]
    if vegetated := project.statement.get("vegetated"):
        there = [name in vegetated and check for name, check in zip(names, known.checks, strict=True)]
        columns["cover"] = [COVERS[1] if each else None for each in there]
    return columns


def _points(project: Project) -> dict[str, Any]:
    block = project.block
    held: Bools = np.asarray(np.isfinite(block.point_positions).any(axis=1))
    full = correlated_control(block)
    own = [row for row, name in enumerate(block.point_ids) if not held[row] and name not in full]
    if not own:
        return {}
    starts = places_written(block, project.starts[own])
    return {"point": [block.point_ids[row] for row in own], **columns_of(AXES, starts)}
