"""The tables of observations beside images, of what they have in common, and of rigs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.rigs_writing import Rigs, angles_of
from photogram.formats.plain.schema import AXES, POSE, ROTATIONS, covariance_columns
from photogram.io.delimited import FALSE, TRUE
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import (
    Attitude,
    Difference,
    Distance,
    EqualHeight,
    Observation,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Position,
    Prior,
    Relative,
)
from photogram.network.unknowns import (
    Boresight,
    Drift,
    Instrument,
    Level,
    LeverArm,
    Line,
    Plane,
    PlumbLine,
    Sensor,
    Shift,
    Unknown,
)

__all__ = ["correlations", "observed_tables"]

Tables = dict[str, dict[str, Any]]
_Kind = TypeVar("_Kind", bound=Observation)
_ANGLES = ("omega", "phi", "kappa")
_DEGREES = (180 / np.pi,) * 3


def observed_tables(block: Block, cameras: Sequence[Camera], photo_cameras: Sequence[int]) -> Tables:
    """Return the tables of all observations beside images, of what they have in common, and of rigs."""
    rigs = Rigs(block, [cameras[row].name for row in photo_cameras])
    return {
        **_gnss(block),
        **_attitudes(block),
        **_distances(block),
        **_differences(block),
        **_levels(block),
        **_planes(block),
        **_lines(block),
        **_relative_poses(block),
        **rigs.tables(block),
        **_covariances(block, cameras, rigs),
    }


def correlations(
    covariances: Floats, names: Sequence[str], units: Sequence[float] | None = None
) -> dict[str, Any]:
    """Return the columns of covariances, where there are any; `units` are those of a table in ours."""
    scales = (1.0,) * len(names) if units is None else units
    columns = covariance_columns(names)
    if not any(np.nan_to_num(covariances[:, i, j]).any() for i, j in columns.values()):
        return {}
    return {name: covariances[:, i, j] * (scales[i] * scales[j]) for name, (i, j) in columns.items()}


def _all(block: Block, kind: type[_Kind]) -> list[_Kind]:
    return [each for each in block.observations if isinstance(each, kind)]


def _columns(names: Sequence[str], values: Floats) -> dict[str, Any]:
    return dict(zip(names, values.T, strict=True))


def _deviations(observations: Sequence[Observation]) -> Floats:
    """Return (n, k) standard deviations of observations."""
    found: Floats = np.sqrt(np.array([np.diag(each.precision) for each in observations]))
    return found


def _places(block: Block, values: Floats) -> Floats:
    """Return positions as tables have them."""
    if not block.geographic:
        return values
    found: Floats = np.column_stack([np.degrees(values[:, :2]), values[:, 2]])
    return found


def _different(unknowns: Sequence[Unknown | None]) -> list[Any]:
    """Return unknowns, each once."""
    return list({id(each): each for each in unknowns if each is not None}.values())


def _gnss(block: Block) -> Tables:
    positions = _all(block, Position)
    if not positions:
        return {}
    keys = [(_lever(each), each.shift, each.drift) for each in positions]
    groups = {key: str(row) for row, key in enumerate(dict.fromkeys(keys), 1)}
    covariances = np.array([each.precision for each in positions])
    table: dict[str, Any] = {
        "photo": [each.photo for each in positions],
        **_columns(AXES, _places(block, np.array([each.observed[:3] for each in positions]))),
        **_columns([f"sd_{axis}" for axis in AXES], _deviations(positions)),
        **correlations(covariances, AXES),
    }
    if list(groups) == [((0.0, 0.0, 0.0), None, None)]:
        return {"gnss": table}
    table["group"] = [groups[key] for key in keys]
    levers = [key[0] if isinstance(key[0], LeverArm) else None for key in groups]
    own: dict[str, Any] = {
        "group": list(groups.values()),
        "lever": ["" if each is None else each.name for each in levers],
        "shift": [_called(key[1]) for key in groups],
        "drift": [_called(key[2]) for key in groups],
    }
    known = np.array(
        [(0.0,) * 3 if each is not None else key[0] for each, key in zip(levers, groups, strict=True)]
    )
    given = [each.position if each is not None else row for each, row in zip(levers, known, strict=True)]
    own |= _columns([f"lever_{axis}" for axis in AXES], np.array(given))
    own |= _columns([f"sd_lever_{axis}" for axis in AXES], _of(levers, "deviations", 0.0))
    for what, column in (("shift", 1), ("drift", 2)):
        unknowns = [key[column] for key in groups]
        own |= _columns([f"{what}_{axis}" for axis in AXES], _of(unknowns, "position", np.nan))
        own |= _columns([f"sd_{what}_{axis}" for axis in AXES], _of(unknowns, "deviations", np.nan))
    epochs = [None if drift is None else drift.epoch for _, _, drift in groups]
    if any(each is not None for each in epochs):
        own["drift_epoch"] = np.array([np.nan if each is None else each for each in epochs])
    return {"gnss": table, "gnss_groups": own}


def _of(unknowns: Sequence[Unknown | None], what: str, missing: float) -> Floats:
    """Return (n, 3) numbers of unknowns."""
    return np.array([(missing,) * 3 if each is None else getattr(each, what) for each in unknowns])


def _lever(each: Position) -> Any:
    if isinstance(each.lever_arm, LeverArm):
        return each.lever_arm
    return tuple(np.broadcast_to(np.asarray(each.lever_arm, dtype=float), 3).tolist())


def _called(unknown: Shift | Drift | None) -> str:
    """Return what the column of a shift or drift says: its name, where that is no word for true or false."""
    if unknown is None:
        return "false"
    return unknown.title if unknown.name.lower() in TRUE | FALSE else unknown.name


def _attitudes(block: Block) -> Tables:
    attitudes = _all(block, Attitude)
    if not attitudes:
        return {}
    groups = {id(each.boresight): each.boresight for each in attitudes if each.boresight is not None}
    names = {
        key: each.name if isinstance(each, Boresight) else f"known {row}"
        for row, (key, each) in enumerate(groups.items(), 1)
    }
    covariances = np.array([each.precision for each in attitudes])
    table: dict[str, Any] = {
        "photo": [each.photo for each in attitudes],
        **_columns(_ANGLES, angles_of(np.array([np.asarray(each.attitude) for each in attitudes]), block)),
        **_columns([f"sd_{name}" for name in ROTATIONS], np.degrees(_deviations(attitudes))),
        **correlations(covariances, ROTATIONS, _DEGREES),
    }
    if not groups:
        return {"attitudes": table}
    table["group"] = [names.get(id(each.boresight), "") for each in attitudes]
    given = list(groups.values())
    # The boresight is body to photo; the tables have attitudes of the photo in the axes of what carries it.
    matrices = np.array(
        [each.attitude if isinstance(each, Boresight) else np.asarray(each, dtype=float) for each in given]
    ).transpose(0, 2, 1)
    angles = angles_of(matrices, block)
    angles[[isinstance(each, Boresight) and each.is_open for each in given]] = np.nan
    sd = np.array([each.deviations if isinstance(each, Boresight) else np.zeros(3) for each in given])
    own: dict[str, Any] = {"group": list(names.values()), **_columns(_ANGLES, angles)}
    own |= _columns([f"sd_{name}" for name in ROTATIONS], np.degrees(sd))
    return {"attitudes": table, "attitude_groups": own}


def _distances(block: Block) -> Tables:
    distances = _all(block, Distance)
    if not distances:
        return {}
    table: dict[str, Any] = {
        "from": [each.first for each in distances],
        "to": [each.second for each in distances],
        "distance": np.array([each.length for each in distances], dtype=float),
        "sd": np.array([each.sd for each in distances], dtype=float),
    }
    instruments: list[Instrument] = _different([each.instrument for each in distances])
    if not instruments:
        return {"distances": table}
    table["instrument"] = ["" if each.instrument is None else each.instrument.name for each in distances]
    own = {
        "instrument": [each.name for each in instruments],
        **_columns(("scale", "constant"), np.array([each.position[:2] for each in instruments])),
        **_columns(("sd_scale", "sd_constant"), np.array([each.deviations for each in instruments])),
    }
    return {"distances": table, "instruments": own}


def _differences(block: Block) -> Tables:
    found: Tables = {}
    heights = _all(block, EqualHeight)
    if heights:
        found["height_differences"] = {
            "from": [each.first for each in heights],
            "to": [each.second for each in heights],
            "dz": np.array([each.difference for each in heights], dtype=float),
            "sd": np.array([each.sd for each in heights], dtype=float),
        }
    differences = _all(block, Difference)
    if differences:
        names = [f"d{axis}" for axis in AXES]
        vectors = np.array([each.observed for each in differences])
        covariances = np.array([each.precision for each in differences])
        seen = ~np.isnan(vectors)
        # What stands in a matrix for components that were not observed counts for nothing.
        covariances = np.where(seen[:, :, np.newaxis] & seen[:, np.newaxis, :], covariances, np.nan)
        sd = np.sqrt(np.einsum("nii->ni", covariances))
        found["coordinate_differences"] = {
            "from": [each.first for each in differences],
            "to": [each.second for each in differences],
            **_columns(names, vectors),
            **_columns([f"sd_{name}" for name in names], sd),
            **correlations(covariances, names),
        }
    return found


def _levels(block: Block) -> Tables:
    observations = _all(block, OnLevel)
    if not observations:
        return {}
    levels: list[Level] = _different([each.level for each in observations])
    return {
        "levels": {
            "level": [each.name for each in levels],
            "z": [each.height for each in levels],
            "sd": np.array([each.deviations[0] for each in levels]),
        },
        "level_points": {
            "level": [each.level.name for each in observations],
            "point": [each.point for each in observations],
            "dz": np.array([each.difference for each in observations], dtype=float),
            "sd": np.array([each.sd for each in observations], dtype=float),
        },
    }


def _surface(block: Block, surfaces: Sequence[Plane | Line | PlumbLine]) -> dict[str, Any]:
    """Return names and places of surfaces; none of those of which nothing is said."""
    places = np.array([(np.nan,) * 3 if each.is_open else each.position for each in surfaces])
    return {"name": [each.name for each in surfaces], **_columns(AXES, _places(block, places))}


def _direction(surfaces: Sequence[Plane | Line], names: Sequence[str]) -> dict[str, Any]:
    """Return what the third axes of surfaces point to, as it was given: other axes follow from it."""
    given = [each.normal if isinstance(each, Plane) else each.direction for each in surfaces]
    return _columns(names, np.array([(np.nan,) * 3 if each is None else np.asarray(each) for each in given]))


def _planes(block: Block) -> Tables:
    observations = _all(block, OnPlane)
    if not observations:
        return {}
    planes: list[Plane] = _different([each.plane for each in observations])
    sd = np.array([each.deviations for each in planes]) * (1.0, *_DEGREES[:2])
    own = _surface(block, planes)
    return {
        "planes": {
            "plane": own.pop("name"),
            **own,
            **_direction(planes, ("nx", "ny", "nz")),
            **_columns(("sd_distance", "sd_rotation_x", "sd_rotation_y"), sd),
        },
        "plane_points": {
            "plane": [each.plane.name for each in observations],
            "point": [each.point for each in observations],
            "distance": np.array([each.distance for each in observations], dtype=float),
            "sd": np.array([each.sd for each in observations], dtype=float),
        },
    }


def _lines(block: Block) -> Tables:
    found: Tables = {}
    sloping, vertical = _all(block, OnLine), _all(block, OnPlumbLine)
    if sloping:
        lines: list[Line] = _different([each.line for each in sloping])
        own = _surface(block, lines)
        sd = np.array([each.deviations for each in lines]) * (1.0, 1.0, *_DEGREES[:2])
        found["lines"] = {
            "line": own.pop("name"),
            **own,
            **_direction(lines, ("dx", "dy", "dz")),
            **_columns(("sd_x", "sd_y", "sd_rotation_x", "sd_rotation_y"), sd),
        }
        found["line_points"] = _offsets("line", sloping)
    if vertical:
        plumb: list[PlumbLine] = _different([each.line for each in vertical])
        own = _surface(block, plumb)
        found["plumb_lines"] = {
            "plumb_line": own.pop("name"),
            **own,
            **_columns(("sd_x", "sd_y"), np.array([each.deviations for each in plumb])),
        }
        found["plumb_line_points"] = _offsets("plumb_line", vertical)
    return found


def _offsets(kind: str, observations: Sequence[OnLine | OnPlumbLine]) -> dict[str, Any]:
    return {
        kind: [each.line.name for each in observations],
        "point": [each.point for each in observations],
        **_columns(("sd_x", "sd_y"), _deviations(observations)),
        **correlations(np.array([each.precision for each in observations]), ("x", "y")),
    }


def _relative_poses(block: Block) -> Tables:
    poses = _all(block, Relative)
    if not poses:
        return {}
    units = (1.0, 1.0, 1.0, *_DEGREES)
    return {
        "relative_poses": {
            "from": [each.first for each in poses],
            "to": [each.second for each in poses],
            **_columns(AXES, np.array([np.asarray(each.translation) for each in poses])),
            **_columns(_ANGLES, angles_of(np.array([np.asarray(each.rotation) for each in poses]), block)),
            **_columns([f"sd_{name}" for name in POSE], _deviations(poses) * units),
            **correlations(np.array([each.precision for each in poses]), POSE, units),
        }
    }


def _covariances(block: Block, cameras: Sequence[Camera], rigs: Rigs) -> Tables:
    """Return the table of what was determined together of cameras and of unknowns."""
    rows: list[tuple[str, str, str, str, float]] = []
    for each in cameras:
        if each.covariance is not None:
            names, matrix = each.covariance
            # In files a principal distance is positive for the positive plane, in models negative.
            signs = np.array([-1.0 if name == "c" else 1.0 for name in names])
            rows += _pairs("camera", each.name, names, np.asarray(matrix) * signs * signs[:, np.newaxis])
    for prior in _all(block, Prior):
        unknown = prior.unknown
        units = np.array([_DEGREES[0] if name.startswith("rotation") else 1.0 for name in unknown.components])
        matrix = prior.precision * units * units[:, np.newaxis]
        rows += _pairs(unknown.KIND, _name(unknown, rigs), unknown.components, matrix)
    if not rows:
        return {}
    columns = ("kind", "name", "first", "second", "covariance")
    return {"covariances": {name: [row[k] for row in rows] for k, name in enumerate(columns)}}


def _name(unknown: Unknown, rigs: Rigs) -> str:
    """Return what reading the tables calls an unknown."""
    if isinstance(unknown, Sensor):
        return rigs.title(unknown)
    return _called(unknown) if isinstance(unknown, Shift | Drift) else unknown.name


def _pairs(
    kind: str, name: str, components: Sequence[str], matrix: Floats
) -> list[tuple[str, str, str, str, float]]:
    return [
        (kind, name, components[i], components[j], float(matrix[i, j]))
        for i in range(len(components))
        for j in range(i + 1)
        if i == j or matrix[i, j]
    ]
