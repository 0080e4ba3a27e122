"""Reading a plain project: tables with a file of settings (docs/formats.md has the schema)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.columns import PLAIN
from photogram.formats.format import Wishes
from photogram.formats.images import from_corner
from photogram.formats.plain.cameras import Cameras, read_cameras, spread_over_photos
from photogram.formats.plain.covariances import read_covariances
from photogram.formats.plain.observed import read_observations
from photogram.formats.plain.rigs import read_frames, read_rigs
from photogram.formats.plain.schema import ANGLES, AXES
from photogram.formats.plain.settings import Settings, read_settings, unread_tables
from photogram.formats.plain.statement_tables import asked_of, read_cover
from photogram.formats.plain.tables import Tables, covariances_of, indices_of
from photogram.formats.plain.transform import Transform
from photogram.formats.project import Project, assembled
from photogram.formats.rigging import mounted
from photogram.io.delimited import ColumnTable
from photogram.messages import Message, listed, quoted
from photogram.network.geometry import Spheroid
from photogram.network.observations import Attitude, Control, Observation
from photogram.results.features import named_points

__all__ = [
    "SETTINGS",
    "Images",
    "Photos",
    "image_coordinates",
    "read",
    "read_control",
    "read_images",
    "read_photos",
    "read_tables",
]

SETTINGS = "project.toml"
DIFFER = 1e-6
"""What the positions of a point in two tables may differ by."""
_SD = tuple(f"sd_{axis}" for axis in AXES)
_USES = ("control", "check", "off")


def read(path: Path, wishes: Wishes) -> Project:
    """Read the project of a folder, or of a file of settings.

    Raises
    ------
    InputError
        A table that cannot be read or is missing, cells that are at fault, names that do not belong together.
    """
    settings = read_settings(path / SETTINGS if path.is_dir() else path)
    settings = replace(settings, sd={**settings.sd, **wishes.sd})
    if wishes.columns != PLAIN:
        settings = replace(settings, columns={**settings.columns, "control": wishes.columns})
    return read_tables(Tables(settings, unread_tables(settings)), wishes)


def read_tables(tables: Tables, wishes: Wishes) -> Project:
    """Read the tables of a project.

    Raises
    ------
    InputError
        As :func:`read`.
    """
    settings = tables.settings
    if "images" not in settings.tables:
        raise InputError("has no table of images (images.csv)", file=settings.path)
    transform = Transform(settings, tables.messages)
    cameras = read_cameras(tables if wishes.cameras is None else _with_cameras(tables, wishes.cameras))
    control = _control_table(tables)
    # The frame is settled by control where it has no origin: it is the first that is carried over.
    given = None if control is None else read_control(tables, control, transform)
    photos = read_photos(tables, transform, cameras)
    images = read_images(tables, photos)
    points = _points(tables, transform, images, given)
    rigs = read_rigs(tables, [each.name for each in cameras.cameras])
    cameras, photo_cameras = spread_over_photos(cameras, photos.cameras, photos.names, photos.groups)
    xy, sd = image_coordinates(settings, images, cameras, np.asarray(photo_cameras))
    mounts, stands = mounted(
        read_frames(tables, rigs, photos.names, photos.taken), photos.names, photos.centres, photos.matrices
    )
    places = {name: row for row, name in enumerate(photos.names)}
    observations: list[Observation] = read_observations(
        tables,
        transform,
        places,
        photos.times.tolist(),
        {name: row for row, name in enumerate(points.names)},
        rigs,
    )
    unknowns = [unknown for each in observations for unknown in each.unknowns if unknown is not None]
    observations += read_covariances(tables).priors([*unknowns, *(each.sensor for each in mounts)])
    extra = len(stands)
    owners = {each.name: row for row, each in enumerate(cameras.cameras)} | dict(
        zip(photos.taken, photo_cameras, strict=True)
    )
    project = assembled(
        path=settings.path,
        title="plain project",
        name=settings.name,
        cameras=cameras.cameras,
        sizes=cameras.sizes,
        pixel_mm=cameras.pixel_mm,
        photo_ids=[*photos.names, *(each.name for each in stands)],
        photo_cameras=[
            *photo_cameras,
            *(owners.get(each.camera, photo_cameras[each.like]) for each in stands),
        ],
        centres=np.vstack([photos.centres, *(each.centre[np.newaxis] for each in stands)]),
        matrices=np.concatenate([photos.matrices, *(each.matrix[np.newaxis] for each in stands)]),
        photo_position_sd=np.vstack([photos.position_sd, np.full((extra, 3), np.inf)]),
        photo_attitude_sd=np.vstack([photos.attitude_sd, np.full((extra, 3), np.inf)]),
        point_ids=points.names,
        starts=points.starts,
        point_positions=points.positions,
        point_sd=points.sd,
        point_check_sd=points.check_sd,
        image_photos=images.photos,
        image_points=images.points,
        image_xy=xy,
        image_sd=sd,
        observations=[*observations, *photos.observed, *points.observed],
        mounts=mounts,
        frame=transform.frame,
        options=settings.options,
        messages=tables.messages,
        linear_unit=settings.length,
        spheroid=Spheroid(*transform.frame.ellipsoid) if transform.frame.kind == "geographic" else None,
        photo_to_ground=settings.attitude == "omega_phi_kappa" and settings.rotation == "photo_to_object",
        details={"settings": settings},
    ).replace(
        sd_taken=True,
        features=settings.features,
        statement=asked_of(
            tables,
            {name: row for row, name in enumerate(points.names)},
            frozenset() if given is None else given.vegetated,
        ),
    )
    for name, (_, wanted) in settings.features.items():
        try:
            named_points(wanted, points.names)
        except InputError as error:
            raise InputError(f"the feature {name}: {error.message}", file=settings.path) from None
    if control is not None and given is not None:
        from photogram.formats.exchanged import check_systems

        raw = control.vectors(AXES)
        places = {name: row for row, name in enumerate(points.names)}
        rows = np.array([places[name] for name in given.names], dtype=np.int64)
        check_systems(project, settings, control, rows, raw, free=False)
    return project


def _with_cameras(tables: Tables, path: Path) -> Tables:
    settings = replace(tables.settings, tables={**tables.settings.tables, "cameras": path})
    return Tables(settings, tables.messages)


@dataclass(frozen=True)
class Photos:
    """The table of photos, in the frame of the project; those that are not used are named apart."""

    names: list[str]
    cameras: list[int]
    taken: list[str]
    centres: Floats
    matrices: Floats
    position_sd: Floats
    attitude_sd: Floats
    groups: list[str]
    times: Floats
    unused: frozenset[str]
    observed: list[Observation]


def read_photos(tables: Tables, transform: Transform, cameras: Cameras) -> Photos:
    """Read the table of photos; errors as of :func:`read`."""
    table = tables.read("photos")
    if table is None:
        raise InputError("has no table of photos (photos.csv)", file=tables.settings.path)
    texts = table.names_once("photo")
    use = table.flags("use")
    centres = table.vectors(AXES)
    sd = tables.deviations(table, "photos", _SD, math.inf)
    weighted = np.isfinite(sd) & np.isnan(centres)
    if weighted.any():
        row, axis = np.argwhere(weighted)[0].tolist()
        raise table.error(row, f"column sd_{AXES[axis]}: there is a standard deviation, but no {AXES[axis]}")
    if "photos" in tables.settings.crs and np.isfinite(sd).any():
        raise table.head.error(
            "photos with a crs of their own have no standard deviations: give a table gnss"
        )
    centres, _ = transform.positions("photos", centres, None, table)
    matrices = tables.matrices(table)
    attitude_sd, observed = _attitude_weights(tables, table, matrices)
    kept = np.flatnonzero(use)
    if len(kept) < table.count:
        tables.messages.append(Message(f"{table.count - len(kept)} photos are not used", table.path))
    which, groups = _camera_of(table, cameras), table.texts("group")
    unused = frozenset(name for name, used in zip(texts, use.tolist(), strict=True) if not used)
    return Photos(
        [texts[row] for row in kept],
        [which[row] for row in kept],
        [cameras.cameras[which[row]].name for row in kept],
        centres[kept],
        matrices[kept],
        sd[kept],
        attitude_sd[kept],
        [groups[row] for row in kept],
        table.numbers("time")[kept],
        unused,
        [each for each in observed if each.photos[0] not in unused],
    )


def _camera_of(table: ColumnTable, cameras: Cameras) -> list[int]:
    places = {each.name: row for row, each in enumerate(cameras.cameras)}
    if "camera" not in table:
        if len(places) > 1:
            raise table.head.error(f"the column camera is missing, and there are {len(places)} cameras")
        return [0] * table.count
    found = []
    for row, name in enumerate(table.texts("camera")):
        if not name and len(places) == 1:
            found.append(0)
        elif name not in places:
            raise table.error(
                row, f"column camera: there is no camera {quoted(name)}, but {listed(list(places))}"
            )
        else:
            found.append(places[name])
    return found


def _attitude_weights(
    tables: Tables, table: ColumnTable, matrices: Floats
) -> tuple[Floats, list[Observation]]:
    """Return standard deviations of omega, phi, kappa, and observations of attitudes given otherwise."""
    settings = tables.settings
    own = f"sd_{ANGLES[settings.attitude][0]}", *(f"sd_{name}" for name in ANGLES[settings.attitude][1:])
    steps = ("sd_rotation_x", "sd_rotation_y", "sd_rotation_z")
    free = np.full((table.count, 3), np.inf)
    columns = steps if any(each in table for each in steps) else own
    if not any(each in table for each in columns):
        return free, []
    sd = table.vectors(columns, math.inf, infinite=True, read=tables.angle)
    if (sd < 0).any():
        row = int(np.argwhere(sd < 0)[0][0])
        raise table.error(row, "a standard deviation of an angle is negative")
    unknown = np.isfinite(sd).any(axis=1) & np.isnan(matrices).any(axis=(1, 2))
    if unknown.any():
        raise table.error(int(np.flatnonzero(unknown)[0]), "angles have standard deviations, but no values")
    plain = settings.attitude == "omega_phi_kappa" and settings.photo == "y_up"
    if plain and columns is own:
        return sd, []
    observed: list[Observation] = []
    fixed = free.copy()
    names = table.texts("photo")
    for row in np.flatnonzero(np.isfinite(sd).any(axis=1)).tolist():
        if not sd[row].any():
            fixed[row] = 0.0
        elif columns is steps and np.isfinite(sd[row]).all():
            try:
                observed.append(Attitude(names[row], matrices[row], sd=sd[row]))
            except InputError as error:
                raise table.error(row, error.message) from None
        else:
            raise table.error(
                row,
                f"attitudes as {settings.attitude} are weighted by {', '.join(steps)}, rotations about the"
                " axes of the photo, or in a table attitudes",
            )
    return fixed, observed


@dataclass(frozen=True)
class Images:
    """The table of images, as it is written."""

    table: ColumnTable
    photos: Indices
    points: Indices
    point_names: list[str]
    xy: Floats
    sd: Floats | None


def read_images(tables: Tables, photos: Photos) -> Images:
    """Read the table of images; errors as of :func:`read`."""
    table = tables.read("images")
    assert table is not None
    xs, ys = ("column", "row") if "column" in table else ("x", "y")
    table.require(xs, ys)
    places = {name: row for row, name in enumerate(photos.names)}
    rows = indices_of(table, "photo", places | dict.fromkeys(photos.unused, len(places)), "photo")
    names = table.names("point")
    xy = table.vectors((xs, ys))
    table.check_given(xy, (xs, ys))
    _check_twice(table, rows, names.rows, len(names.names))
    keep = table.flags("use") & (rows < len(places)) if "use" in table or photos.unused else None
    sd = _image_sd(tables, table)
    if keep is None:
        return Images(table, rows, names.rows, names.names, xy, sd)
    left = int(np.count_nonzero(~keep))
    if left:
        tables.messages.append(Message(f"{left} images are not used", table.path))
    seen, points = np.unique(names.rows[keep], return_inverse=True)
    kept_sd = sd if sd is None or np.ndim(sd) == 0 else sd[keep]
    return Images(
        table, rows[keep], points.reshape(-1), [names.names[row] for row in seen], xy[keep], kept_sd
    )


def _check_twice(table: ColumnTable, photos: Indices, points: Indices, count: int) -> None:
    pairs = photos * count + points
    if (np.diff(pairs) > 0).all():
        return
    order = np.argsort(pairs, kind="stable")
    again = np.flatnonzero(np.diff(pairs[order]) == 0)
    if again.size:
        first, second = sorted(order[again[0] : again[0] + 2].tolist())
        raise table.error(
            second, f"the point has an image on this photo already, in record {table.records[first]}"
        )


def _image_sd(tables: Tables, table: ColumnTable) -> Floats | None:
    own = [
        name
        for pair in (("sd_column", "sd_row"), ("sd_x", "sd_y"))
        if pair[0] in table or pair[1] in table
        for name in pair
    ]
    if "correlation" in table and table.numbers("correlation", 0.0).any():
        raise table.head.error("column correlation: images with correlated coordinates cannot be adjusted")
    if not own and "sd" not in table and "images" not in tables.settings.sd:
        return None
    found = tables.deviations(table, "images", own[:2] or ["sd_x", "sd_y"])
    bad = np.argwhere(~((found > 0) & np.isfinite(found)))
    if len(bad):
        row = int(bad[0][0])
        why = "is empty" if np.isnan(found[row]).any() else f"{found[row].min():g} is not positive and finite"
        raise table.error(row, f"standard deviation {why}")
    return found


def image_coordinates(
    settings: Settings, images: Images, cameras: Cameras, photo_cameras: Indices
) -> tuple[Floats, Floats | None]:
    """Return image coordinates and standard deviations in the unit and along the axes of the cameras."""
    xy, sd = images.xy, images.sd
    if settings.image == "um":
        xy, sd = xy * 1e-3, None if sd is None else sd * 1e-3
    if settings.pixel_origin == "center" and settings.image == "px" and settings.image_y == "down":
        xy = xy + 0.5
    found = np.array(xy)
    of_images = photo_cameras[images.photos]
    for row, camera in enumerate(cameras.cameras):
        own = of_images == row
        if settings.image == "px" and settings.image_y == "down":
            found[own] = from_corner(camera, cameras.sizes[row], xy[own])
        elif settings.image == "px" and camera.image_y == "down":
            size = cameras.sizes[row]
            if size is None:
                raise InputError(f"the camera {camera.name} has no width and height", file=settings.path)
            found[own] = np.column_stack([size[0] / 2 + xy[own, 0], size[1] / 2 - xy[own, 1]])
        elif camera.image_y != settings.image_y:
            found[own] = xy[own] * [1.0, -1.0]
    return found, sd


@dataclass(frozen=True)
class _Given:
    """Control and check points: what is held, checked, and observed with correlations."""

    table: ColumnTable
    names: list[str]
    positions: Floats
    sd: Floats
    check_sd: Floats
    observed: list[Observation]
    vegetated: frozenset[str]


def _control_table(tables: Tables) -> ColumnTable | None:
    return tables.read("control")


def read_control(tables: Tables, table: ColumnTable, transform: Transform) -> _Given:
    """Read a table of control and check points.

    Raises
    ------
    InputError
        A point that is there twice or has no coordinate, a standard deviation that is missing.
    """
    names = table.names_once("point")
    values = table.vectors(AXES)
    uses = [each.lower() for each in table.texts("use", "control")]
    sd = table.vectors(_SD, infinite=True)
    stray = ~np.isnan(sd) & np.isnan(values)
    if stray.any():
        row, k = np.argwhere(stray)[0].tolist()
        raise table.error(row, f"column {_SD[k]}: there is a standard deviation, but no {AXES[k]}")
    check = np.array([each == "check" for each in uses], dtype=bool)[:, np.newaxis]
    if "check" in tables.settings.sd:
        sd = np.where(check, tables.deviations(table, "check", _SD), tables.deviations(table, "control", _SD))
    else:
        sd = tables.deviations(table, "control", _SD)
    for row, use in enumerate(uses):
        if use not in _USES:
            raise table.error(row, f"column use: {quoted(use)} is none of {', '.join(_USES)}")
        if np.isnan(values[row]).all():
            raise table.error(row, f"{names[row]} has no coordinates")
        if use == "control" and (np.isnan(sd[row]) & ~np.isnan(values[row])).any():
            raise table.error(
                row,
                f"{names[row]} has no standard deviations: --sd control=0.01, columns sd_x .., or control"
                " under [sd]",
            )
    sd = np.where(np.isnan(sd) | np.isnan(values), np.inf, sd)
    covariances = covariances_of(np.where(np.isinf(sd), 0.0, sd), table)
    values, turned = transform.positions("control", values, covariances, table)
    # Along the axes of the frame; what is correlated there is not kept.
    tilted = (turned != turned * np.eye(3)).any(axis=(1, 2))[:, np.newaxis]
    own = np.where(tilted, np.sqrt(np.diagonal(turned, axis1=1, axis2=2)), sd)
    check_sd = np.where(check & np.isfinite(sd), own, np.nan)
    observed: list[Observation] = []
    held = sd.copy()
    for row, use in enumerate(uses):
        if use != "control":
            held[row] = np.inf
            continue
        correlated = (turned[row] - np.diag(np.diag(turned[row]))).any()
        if correlated and np.isfinite(sd[row]).all() and not _isotropic(covariances[row]):
            if not is_covariance(turned[row]):
                raise table.error(row, "its covariances cannot be: the matrix is not positive definite")
            observed.append(Control(names[row], values[row], covariance=(turned[row] + turned[row].T) / 2))
            held[row] = np.inf
    off = {row for row, use in enumerate(uses) if use == "off"}
    values = np.where(np.array([row in off for row in range(len(uses))])[:, np.newaxis], np.nan, values)
    vegetated = read_cover(table, names, uses)
    return _Given(table, names, values, held, check_sd, observed, vegetated)


def _isotropic(covariance: Floats) -> bool:
    """Whether turning changes nothing of a covariance matrix."""
    return bool((covariance == covariance[0, 0] * np.eye(3)).all())


@dataclass(frozen=True)
class _Points:
    names: list[str]
    starts: Floats
    positions: Floats
    sd: Floats
    check_sd: Floats
    observed: list[Observation]


def _points(tables: Tables, transform: Transform, images: Images, control: _Given | None) -> _Points:
    table = tables.read("points")
    own = table.names_once("point") if table is not None else []
    names = list(dict.fromkeys([*images.point_names, *(control.names if control else []), *own]))
    places = {name: row for row, name in enumerate(names)}
    starts = np.full((len(names), 3), np.nan)
    positions, sd, check_sd = starts.copy(), np.full((len(names), 3), np.inf), starts.copy()
    if table is not None:
        rows = np.array([places[name] for name in own], dtype=np.int64)
        given = table.vectors(AXES)
        own_sd = tables.deviations(table, "points", _SD, math.inf)
        given, _ = transform.positions("points", given, None, table)
        starts[rows] = given
        held: Bools = np.asarray(np.isfinite(own_sd).any(axis=1))
        if (np.isfinite(own_sd) & np.isnan(given)).any():
            row = int(np.argwhere(np.isfinite(own_sd) & np.isnan(given))[0][0])
            raise table.error(row, "there is a standard deviation, but no coordinate")
        positions[rows] = np.where(held[:, np.newaxis], given, np.nan)
        sd[rows] = own_sd
    observed: list[Observation] = []
    if control is not None:
        rows = np.array([places[name] for name in control.names], dtype=np.int64)
        apart = np.abs(starts[rows] - control.positions)
        if (apart > DIFFER).any():
            row, k = np.argwhere(apart > DIFFER)[0].tolist()
            raise control.table.error(
                row,
                f"{control.names[row]} has another {AXES[k]} in the table points, by {apart[row, k]:.6g}",
            )
        positions[rows], sd[rows], check_sd[rows] = control.positions, control.sd, control.check_sd
        for each in control.observed:
            positions[places[each.points[0]]] = np.nan
        observed = control.observed
        starts[rows] = np.where(np.isnan(control.positions), starts[rows], control.positions)
    return _Points(names, starts, positions, sd, check_sd, observed)
