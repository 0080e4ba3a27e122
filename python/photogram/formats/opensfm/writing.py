"""From a project to `reconstruction.json`, `tracks.csv` and `gcp_list.txt`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from photogram.errors import InputError
from photogram.formats.block_contents import correlated_control, posed
from photogram.formats.images import sizes_of, to_corner
from photogram.formats.lenses import lens_of
from photogram.formats.models import complete_positions
from photogram.formats.opensfm.reading import MODEL, TRACKS
from photogram.formats.plain.writing import attitude_matrices, known_cameras
from photogram.formats.project import Project, Size
from photogram.io.json import to_json
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.network.observations import Position

CONTROL = "gcp_list.txt"
VERSION = "OPENSFM_TRACKS_VERSION_v2"


def cannot_hold(project: Project) -> list[str]:
    """Return what of a project the files have no place for."""
    block = project.block
    found = ["standard deviations of images, poses, cameras and control"]
    if np.isfinite(block.point_sd).any() or project.checks:
        found.append(
            f"which control points are checked: {CONTROL} beside it is a list for --control"
            if _placed_frame(project)
            else "what control is: its points are points as others"
        )
    others = [each for each in block.observations if not isinstance(each, Position)]
    if others:
        found.append(f"{len(others)} observations beside images and GPS")
    if len(others) < len(block.observations):
        found.append("standard deviations of GPS by component, lever arms, shifts and drifts")
    if project.frame.kind != "topocentric":
        found.append(f"the frame: {project.frame}")
    if block.mounts:
        found.append("rigs: photos have their poses")
    return found


def write(project: Project) -> Mapping[str, bytes]:
    """Return the two files, and the list of control of a block that has a place on the earth."""
    block = project.block
    cameras, which = known_cameras(block)
    sizes = sizes_of(project)
    rows = np.flatnonzero(posed(block))
    if not len(rows):
        raise InputError("no photo has a pose, and a reconstruction holds nothing but photos with one")
    attitudes = Attitudes(attitude_matrices(block)[rows])
    rotations = attitudes.values("rotation_vector_to_vision").tolist()
    translations = attitudes.translations(block.photo_positions[rows]).tolist()
    gps = {each.photo: each for each in block.observations if isinstance(each, Position)}
    shots: dict[str, Any] = {}
    for row, rotation, translation in zip(rows.tolist(), rotations, translations, strict=True):
        name = block.photo_ids[row]
        shots[name] = {
            "rotation": rotation,
            "translation": translation,
            "camera": cameras[which[row]].name,
            "orientation": 1,
        }
        if name in gps:
            shots[name]["gps_position"] = gps[name].observed[:3].tolist()
            shots[name]["gps_dop"] = float(np.sqrt(np.trace(gps[name].precision) / 3))
    positions = complete_positions(project)
    placed = np.isfinite(positions).all(axis=1)
    colours = project.details.get("colours", {})
    model: dict[str, Any] = {
        "cameras": {each.name: _camera(each, size) for each, size in zip(cameras, sizes, strict=True)},
        "shots": shots,
        "points": {
            block.point_ids[row]: {
                "color": list(map(float, colours.get(block.point_ids[row], (0, 0, 0)))),
                "coordinates": positions[row].tolist(),
            }
            for row in np.flatnonzero(placed).tolist()
        },
    }
    if project.frame.origin is not None and _placed_frame(project):
        model["reference_lla"] = dict(
            zip(("latitude", "longitude", "altitude"), project.frame.origin, strict=True)
        )
    files = {MODEL: to_json([model]), TRACKS: _tracks(project, sizes, which, set(rows.tolist()))}
    control = _control(project)
    return {**files, **({CONTROL: control} if control else {})}


def _placed_frame(project: Project) -> bool:
    """Return whether the frame has a place on the earth."""
    return project.frame.kind == "topocentric" and project.frame.origin is not None


def _control(project: Project) -> bytes:
    """Return the list of control with its measurements; none of a block without a place on the earth.

    Points of which some coordinates are not known have no place in it.
    """
    block = project.block
    positions = block.point_positions.copy()
    places = {name: row for row, name in enumerate(block.point_ids)}
    for name, each in correlated_control(block).items():
        positions[places[name]] = each.observed
    own = np.flatnonzero(np.isfinite(positions).all(axis=1))
    if not len(own) or not _placed_frame(project):
        return b""
    from photogram.formats.crs import GEOGRAPHIC, from_frame

    found = positions.copy()
    found[own], _ = from_frame(GEOGRAPHIC, positions[own], np.zeros((len(own), 3, 3)), project.frame)
    known = set(own.tolist())
    lines = ["WGS84"]
    # Pixels count from the middle of the first one there, and names end at blanks.
    pixels = (to_corner(project) - 0.5).tolist()
    for photo, point, pixel in zip(
        block.image_photos.tolist(), block.image_points.tolist(), pixels, strict=True
    ):
        if point in known:
            names = ("_".join(name.split()) for name in (block.photo_ids[photo], block.point_ids[point]))
            lines.append(" ".join([*map(repr, [*found[point].tolist(), *pixel]), *names]))
    return ("\n".join(lines) + "\n").encode() if len(lines) > 1 else b""


def _camera(camera: Camera, size: Size) -> dict[str, Any]:
    (width, height), scale = size, max(size)
    found: dict[str, Any] = {"width": width, "height": height}
    if camera.model == "equirectangular":
        return {**found, "projection_type": "spherical"}
    if camera.model in ("opencv_fisheye", "radial_fisheye", "simple_radial_fisheye") and camera.unit == "px":
        kind, values = "fisheye_opencv", camera.parameters
        fx, fy = (values["f"], values["f"]) if "f" in values else (values["fx"], values["fy"])
        cx, cy = values["cx"], values["cy"]
        terms = {name: values.get(name, 0.0) for name in ("k1", "k2", "k3", "k4")}
        terms["k1"] = values.get("k", terms["k1"])
    else:
        kind, lens = "brown", lens_of(camera, size)
        if lens is None or not lens.is_plain("k1", "k2", "k3", "p1", "p2"):
            raise InputError(
                f"the camera {camera.title} has the model {camera.model}, which OpenSfM does not have"
            )
        fx, fy, cx, cy = lens.fx, lens.fy, lens.cx, lens.cy
        terms = {name: getattr(lens, name) for name in ("k1", "k2", "p1", "p2", "k3")}
    return {
        **found,
        "projection_type": kind,
        "focal_x": fx / scale,
        "focal_y": fy / scale,
        "c_x": (cx - width / 2) / scale,
        "c_y": (cy - height / 2) / scale,
        **terms,
    }


def _tracks(project: Project, sizes: Any, which: list[int], shots: set[int]) -> bytes:
    block = project.block
    corner = to_corner(project)
    of_images = np.asarray(which)[block.image_photos]
    scale = np.array([max(size) for size in sizes], dtype=float)[of_images]
    middle = np.array(sizes, dtype=float)[of_images] / 2
    xy = (corner - middle) / scale[:, np.newaxis]
    counts: dict[int, int] = {}
    lines = [VERSION]
    for photo, point, (x, y) in zip(
        block.image_photos.tolist(), block.image_points.tolist(), xy.tolist(), strict=True
    ):
        if photo not in shots:
            continue
        feature = counts[photo] = counts.get(photo, -1) + 1
        name = block.photo_ids[photo].replace("\t", " ")
        lines.append(f"{name}\t{block.point_ids[point]}\t{feature}\t{x!r}\t{y!r}\t0.0004\t0\t0\t0\t-1\t-1")
    return ("\n".join(lines) + "\n").encode()
