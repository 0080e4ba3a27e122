"""Writing a plain project, so that reading it gives the same block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.images import to_corner
from photogram.formats.plain.settings import VERSION
from photogram.formats.plain.tables import AXES
from photogram.formats.project import Project
from photogram.io.csv_text import csv_text
from photogram.network.attitudes import Attitudes, Representation
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Attitude, Control, Difference, Distance, Observation, Position
from photogram.network.unknowns import Boresight, LeverArm

__all__ = ["attitude_matrices", "cannot_hold", "control_table", "known_cameras", "write"]

_ANGLES = ("omega", "phi", "kappa")
_COVARIANCES = (("cov_xy", 0, 1), ("cov_xz", 0, 2), ("cov_yz", 1, 2))
_HELD = (Attitude, Control, Difference, Distance, Position)


def cannot_hold(project: Project) -> list[str]:
    """Return what of a project the tables have no place for."""
    block, found = project.block, []
    others: dict[str, int] = {}
    for each in block.observations:
        if not isinstance(each, _HELD):
            others[each.label] = others.get(each.label, 0) + 1
    found += [f"{count} observations of the kind {kind}" for kind, count in others.items()]
    if any(isinstance(each, Distance) and each.instrument for each in block.observations):
        found.append("scale and constant of the instruments of distances")
    if any(each.covariance is not None for each in block.cameras):
        found.append("correlations between the parameters of cameras")
    if block.refraction is not None:
        found.append("refraction")
    return found


def known_cameras(block: Block) -> tuple[list[Camera], list[int]]:
    """Return the cameras of a block, also where it has principal distances, and which one photos have."""
    if block.cameras:
        assert block.photo_cameras is not None
        cameras = [
            each if each.name else each.replace(name=name)
            for each, name in zip(block.cameras, block.camera_names, strict=True)
        ]
        return cameras, block.photo_cameras.tolist()
    distances = block.known_distances("the file").tolist()
    places = {each: row for row, each in enumerate(dict.fromkeys(distances))}
    cameras = [Camera("perspective", {"c": c}, name=f"camera {row}") for row, c in enumerate(places, 1)]
    return cameras, [places[each] for each in distances]


def attitude_matrices(block: Block) -> Floats:
    """Return (P, 3, 3) attitudes A of photos, photo to object; NaN where unknown."""
    found = np.full((len(block.photo_ids), 3, 3), np.nan)
    known = ~np.isnan(block.photo_attitudes).any(axis=1)
    if known.any():
        kind = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
        found[known] = Attitudes.of(kind, block.photo_attitudes[known]).matrices  # type: ignore[arg-type]
    return found


def write(project: Project) -> Mapping[str, bytes]:
    """Return the files of a project.

    Raises
    ------
    InputError
        Cameras in pixels that count from corner and middle both, without the size of their pictures.
    """
    block = project.block
    cameras, photo_cameras = known_cameras(block)
    names = ["x", "y"]
    image_y, xy = "up", block.image_xy
    if block.image_unit == "px":
        ups = {each.image_y for each in cameras}
        if ups == {"down"} or None not in project.sizes:
            image_y, names, xy = "down", ["column", "row"], to_corner(project)
        elif "down" in ups:
            raise InputError(
                "cameras that count from the corner and from the middle: their pictures have no size"
            )
    elif any(each.image_y == "down" for each in cameras):
        of_images = np.array(photo_cameras)[block.image_photos]
        down = np.array([each.image_y == "down" for each in cameras])[of_images]
        xy = np.where(down[:, np.newaxis], xy * [1.0, -1.0], xy)
    tables = {
        "cameras": _cameras(project, cameras),
        "photos": _photos(block, [cameras[row].name for row in photo_cameras]),
        "images": _images(block, names, xy),
        "points": _points(project),
        "control": control_table(project),
        **_observed(block.observations, block),
        **_rigs(block, cameras, photo_cameras),
    }
    files = {f"{name}.csv": csv_text(columns) for name, columns in tables.items() if columns}
    return {"project.toml": _settings(project, image_y).encode(), **files}


def _settings(project: Project, image_y: str) -> str:
    block, frame, options = project.block, project.frame, project.options
    name = block.title.replace("\\", "\\\\").replace('"', '\\"')
    printed = "".join(each if each.isprintable() else " " for each in name)
    lines = [
        "[project]",
        f"format = {VERSION}",
        f'name = "{printed}"',
        "",
        "[frame]",
        f'kind = "{frame.kind}"',
    ]
    if frame.crs:
        quoted = frame.crs.replace("\\", "\\\\").replace('"', '\\"')
        lines.append(f'crs = "{quoted}"')
    if frame.origin is not None:
        lines.append(f"origin = [{', '.join(map(repr, frame.origin))}]")
    if block.spheroid is not None:
        lines.append(f"ellipsoid = [{block.spheroid.a!r}, {block.spheroid.b!r}]")
    unit = block.linear_unit if block.linear_unit in ("m", "mm", "ft", "us-ft") else "m"
    lines += ["", "[units]", f'length = "{unit}"', 'angle = "deg"', f'image = "{block.image_unit}"']
    lines += ["", "[axes]", f'image_y = "{image_y}"']
    if block.photo_to_ground:
        lines.append('rotation = "photo_to_object"')
    lines += ["", "[adjust]"]
    if options.datum is not None:
        lines.append(f'datum = "{options.datum}"')
    lines += [f'loss = "{options.loss or "none"}"', f'unit_variance = "{options.unit_variance}"', ""]
    return "\n".join(lines)


def _cameras(project: Project, cameras: Sequence[Camera]) -> dict[str, Any]:
    columns: dict[str, Any] = {
        "camera": [each.name for each in cameras],
        "model": [each.model for each in cameras],
    }
    sizes, pixels = list(project.sizes), list(project.pixel_mm)
    if any(size is not None for size in sizes):
        columns["width"] = [None if size is None else size[0] for size in sizes]
        columns["height"] = [None if size is None else size[1] for size in sizes]
    if any(pixel is not None for pixel in pixels):
        columns["pixel_mm"] = pixels
    constants = {"w", "h"}
    names = dict.fromkeys(name for each in cameras for name in each.names if name not in constants)
    for name in names:
        values = [each.parameters.get(name) for each in cameras]
        # In files a principal distance is positive for the positive plane, in models negative.
        sign = -1.0 if name == "c" else 1.0
        columns[name] = [None if value is None else sign * value for value in values]
    for name in names:
        deviations = [
            dict(zip(each.names, each.deviations.tolist(), strict=True)).get(name, 0.0) for each in cameras
        ]
        if any(deviations):
            columns[f"sd_{name}"] = deviations
    return columns


def _photos(block: Block, cameras: list[str]) -> dict[str, Any]:
    positions, sd = _given(block, "position")
    if block.geographic:
        positions = np.column_stack([np.degrees(positions[:, :2]), positions[:, 2]])
    attitudes, angle_sd = _given(block, "attitude")
    columns: dict[str, Any] = {"photo": block.photo_ids, "camera": cameras}
    columns |= zip(AXES, positions.T, strict=True)
    columns |= zip(_ANGLES, np.degrees(attitudes).T, strict=True)
    for names, values in ((AXES, sd), (_ANGLES, np.degrees(angle_sd))):
        if np.isfinite(values).any():
            columns |= {f"sd_{name}": column for name, column in zip(names, values.T, strict=True)}
    if any(isinstance(each, Position) and each.drift is not None for each in block.observations):
        times = {each.photo: each.time for each in block.observations if isinstance(each, Position)}
        columns["time"] = [times.get(photo) for photo in block.photo_ids]
    return columns


def _angles(matrices: Floats, photo_to_ground: bool) -> Floats:
    kind: Representation = "omega_phi_kappa_photo_to_ground" if photo_to_ground else "omega_phi_kappa"
    found = np.full((len(matrices), 3), np.nan)
    known = np.isfinite(matrices).all(axis=(1, 2))
    if known.any():
        found[known] = Attitudes(matrices[known]).values(kind)
    return found


def _given(block: Block, what: str) -> tuple[Floats, Floats]:
    """Return values of photos, observed ones where they are weighted, and their standard deviations."""
    initial, sd = getattr(block, f"photo_{what}s"), getattr(block, f"photo_{what}_sd")
    observed = getattr(block, f"photo_{what}s_observed")
    return (initial if observed is None else np.where(np.isfinite(sd), observed, initial)), sd


def _images(block: Block, names: list[str], xy: Floats) -> dict[str, Any]:
    photos, points = np.array(block.photo_ids, dtype=object), np.array(block.point_ids, dtype=object)
    columns: dict[str, Any] = {
        "photo": photos[block.image_photos],
        "point": points[block.image_points],
        names[0]: xy[:, 0],
        names[1]: xy[:, 1],
    }
    sd = block.image_sd
    if (sd[:, 0] == sd[:, 1]).all():
        columns["sd"] = sd[:, 0]
    else:
        columns |= {f"sd_{name}": column for name, column in zip(names, sd.T, strict=True)}
    return columns


def control_table(project: Project) -> dict[str, Any]:
    """Return the columns of control and check points; none where there are no such points."""
    block = project.block
    held = np.isfinite(block.point_sd)
    rows = {int(row): "control" for row in np.flatnonzero(held.any(axis=1))} | dict.fromkeys(
        project.checks, "check"
    )
    full = {each.points[0]: each for each in block.observations if isinstance(each, Control)}
    places = {name: row for row, name in enumerate(block.point_ids)}
    order = sorted({*rows, *(places[name] for name in full)})
    if not order:
        return {}
    positions, sd = block.point_positions[order].copy(), block.point_sd[order].copy()
    covariances = np.zeros((len(order), 3, 3))
    for k, row in enumerate(order):
        if (each := full.get(block.point_ids[row])) is not None:
            positions[k], covariances[k] = each.observed, each.precision
            sd[k] = np.sqrt(np.diag(each.precision))
    if block.geographic:
        positions[:, :2] = np.degrees(positions[:, :2])
    columns: dict[str, Any] = {"point": [block.point_ids[row] for row in order]}
    columns |= zip(AXES, positions.T, strict=True)
    columns |= {
        f"sd_{axis}": np.where(np.isinf(own), np.nan, own) for axis, own in zip(AXES, sd.T, strict=True)
    }
    columns |= _correlations(covariances)
    # What is known and not held of a control point is held by nothing: it goes out as an infinite deviation.
    for k, axis in enumerate(AXES):
        unheld = np.isinf(sd[:, k]) & np.isfinite(positions[:, k])
        columns[f"sd_{axis}"] = np.where(unheld, np.inf, columns[f"sd_{axis}"])
    columns["use"] = [rows.get(row, "control") for row in order]
    return columns


def _correlations(covariances: Floats) -> dict[str, Any]:
    """Return columns of covariances, if there are any."""
    if not any(covariances[:, i, j].any() for _, i, j in _COVARIANCES):
        return {}
    return {name: covariances[:, i, j] for name, i, j in _COVARIANCES}


def _points(project: Project) -> dict[str, Any]:
    block = project.block
    held: Bools = np.asarray(np.isfinite(block.point_positions).any(axis=1))
    full = {each.points[0] for each in block.observations if isinstance(each, Control)}
    own = [row for row, name in enumerate(block.point_ids) if not held[row] and name not in full]
    if not own:
        return {}
    starts = project.starts[own]
    if block.geographic:
        starts = np.column_stack([np.degrees(starts[:, :2]), starts[:, 2]])
    return {"point": [block.point_ids[row] for row in own], **dict(zip(AXES, starts.T, strict=True))}


def _observed(observations: Sequence[Observation], block: Block) -> dict[str, dict[str, Any]]:
    """Return the tables of observations beside images."""
    found: dict[str, dict[str, Any]] = {}
    positions = [each for each in observations if isinstance(each, Position)]
    if positions:
        found["gnss"], found["gnss_groups"] = _gnss(positions, block)
    attitudes = [each for each in observations if isinstance(each, Attitude)]
    if attitudes:
        found["attitudes"], found["attitude_groups"] = _attitudes(attitudes, block.photo_to_ground)
    distances = [each for each in observations if isinstance(each, Distance)]
    if distances:
        found["distances"] = {
            "from": [each.first for each in distances],
            "to": [each.second for each in distances],
            "distance": np.array([each.length for each in distances], dtype=float),
            "sd": np.array([each.sd for each in distances], dtype=float),
        }
    differences = [each for each in observations if isinstance(each, Difference)]
    if differences:
        vectors = np.array([each.observed for each in differences])
        sd = np.sqrt(np.array([np.diag(each.precision) for each in differences]))
        found["coordinate_differences"] = {
            "from": [each.first for each in differences],
            "to": [each.second for each in differences],
            **{f"d{axis}": column for axis, column in zip(AXES, vectors.T, strict=True)},
            **{f"sd_d{axis}": column for axis, column in zip(AXES, sd.T, strict=True)},
        }
    return found


def _gnss(positions: Sequence[Position], block: Block) -> tuple[dict[str, Any], dict[str, Any]]:
    keys = [(_lever(each), each.shift, each.drift) for each in positions]
    groups = {key: str(row) for row, key in enumerate(dict.fromkeys(keys), 1)}
    values = np.array([each.observed[:3] for each in positions])
    if block.geographic:
        values = np.column_stack([np.degrees(values[:, :2]), values[:, 2]])
    covariances = np.array([each.precision for each in positions])
    table: dict[str, Any] = {
        "photo": [each.photo for each in positions],
        **dict(zip(AXES, values.T, strict=True)),
        **{f"sd_{axis}": np.sqrt(covariances[:, k, k]) for k, axis in enumerate(AXES)},
        **_correlations(covariances),
    }
    if list(groups) == [((0.0, 0.0, 0.0), None, None)]:
        return table, {}
    table["group"] = [groups[key] for key in keys]
    own: dict[str, list[Any]] = {"group": list(groups.values()), "shift": [], "drift": []}
    for lever, shift, drift in groups:
        own["shift"].append(shift is not None)
        own["drift"].append(drift is not None)
        parts = {
            "lever": lever.position if isinstance(lever, LeverArm) else lever,
            "sd_lever": lever.deviations if isinstance(lever, LeverArm) else (0.0, 0.0, 0.0),
            "sd_shift": (np.nan,) * 3 if shift is None else shift.deviations,
            "sd_drift": (np.nan,) * 3 if drift is None else drift.deviations,
        }
        for name, numbers in parts.items():
            for axis, value in zip(AXES, numbers, strict=True):
                own.setdefault(f"{name}_{axis}", []).append(float(value))
    return table, own


def _lever(each: Position) -> Any:
    if isinstance(each.lever_arm, LeverArm):
        return each.lever_arm
    return tuple(np.broadcast_to(np.asarray(each.lever_arm, dtype=float), 3).tolist())


def _attitudes(attitudes: Sequence[Attitude], turned: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    groups = {id(each.boresight): each.boresight for each in attitudes if each.boresight is not None}
    names = {key: str(row) for row, key in enumerate(groups, 1)}
    sd = np.degrees(np.sqrt(np.array([np.diag(each.precision) for each in attitudes])))
    angles = np.degrees(_angles(np.array([np.asarray(each.attitude) for each in attitudes]), turned))
    table: dict[str, Any] = {
        "photo": [each.photo for each in attitudes],
        **dict(zip(_ANGLES, angles.T, strict=True)),
    }
    table |= {f"sd_rotation_{axis}": column for axis, column in zip(AXES, sd.T, strict=True)}
    if not groups:
        return table, {}
    table["group"] = [names.get(id(each.boresight), "") for each in attitudes]
    values = [
        each.attitude if isinstance(each, Boresight) else np.asarray(each, dtype=float)
        for each in groups.values()
    ]
    own: dict[str, Any] = {"group": list(names.values())}
    # The boresight is body to photo; the tables have attitudes of the photo in the axes of what carries it.
    own |= zip(_ANGLES, np.degrees(_angles(np.array(values).transpose(0, 2, 1), turned)).T, strict=True)
    deviations = [each.deviations if isinstance(each, Boresight) else np.zeros(3) for each in groups.values()]
    own |= {
        f"sd_rotation_{axis}": column
        for axis, column in zip(AXES, np.degrees(np.array(deviations)).T, strict=True)
    }
    return table, own


def _rigs(block: Block, cameras: Sequence[Camera], photo_cameras: Sequence[int]) -> dict[str, dict[str, Any]]:
    if not block.mounts:
        return {}
    places = {name: row for row, name in enumerate(block.photo_ids)}
    of_photo = {name: cameras[photo_cameras[row]].name for name, row in places.items()}
    rigs: dict[str, dict[str, Any]] = {}
    rig_of_frame: dict[str, str] = {}
    for each in block.mounts:
        reference = of_photo[each.frame]
        rig = rigs.setdefault(reference, {})
        rig.setdefault(of_photo[each.photo], each.sensor)
        rig_of_frame[each.frame] = reference
    rows = [(rig, rig, None) for rig in rigs]
    rows += [(rig, camera, sensor) for rig, sensors in rigs.items() for camera, sensor in sensors.items()]
    rows.sort(key=lambda row: list(rigs).index(row[0]))
    values = np.array([np.zeros(3) if sensor is None else sensor.position for _, _, sensor in rows])
    angles = np.degrees(
        _angles(np.array([np.eye(3) if s is None else s.attitude for _, _, s in rows]), block.photo_to_ground)
    )
    sd = np.array([np.zeros(6) if sensor is None else sensor.deviations for _, _, sensor in rows])
    table: dict[str, Any] = {"rig": [row[0] for row in rows], "camera": [row[1] for row in rows]}
    table |= zip(AXES, values.T, strict=True)
    table |= zip(_ANGLES, angles.T, strict=True)
    table |= {f"sd_{axis}": column for axis, column in zip(AXES, sd[:, :3].T, strict=True)}
    table |= {
        f"sd_rotation_{axis}": column for axis, column in zip(AXES, np.degrees(sd[:, 3:]).T, strict=True)
    }
    frames = [(frame, rig, frame) for frame, rig in rig_of_frame.items()]
    frames += [(each.frame, rig_of_frame[each.frame], each.photo) for each in block.mounts]
    return {
        "rigs": table,
        "frames": {name: [row[k] for row in frames] for k, name in enumerate(("frame", "rig", "photo"))},
    }
