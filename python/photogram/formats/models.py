"""Contents of projects for writers: cameras, poses, control, lost parts, and coordinates of a format."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.images import scaled_camera
from photogram.formats.project import Project, Size
from photogram.io.places import Failing
from photogram.messages import Message
from photogram.network.attitudes import angles_form, known_angles, known_matrices
from photogram.network.block import Block, refuse_passages, refuse_trajectories
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.films import Scan
from photogram.network.geometry import Cartesian, Frame, Spheroid, lengths_of_units, local_frames
from photogram.network.motion import kept_images, on_shared, scanners
from photogram.network.observations import Control, Position
from photogram.network.rays import LocalAxes, image_directions, meet_rays
from photogram.words import Phrase, phrase


def known_cameras(block: Block) -> tuple[list[Camera], list[int]]:
    """Return cameras (also for principal distances), and the one of each photo."""
    if block.cameras:
        assert block.photo_cameras is not None
        pairs = zip(block.cameras, block.camera_names, strict=True)
        cameras = [each if each.name else each.replace(name=name) for each, name in pairs]
        return cameras, block.photo_cameras.tolist()
    distances = block.known_distances("the file").tolist()
    places = {each: row for row, each in enumerate(dict.fromkeys(distances))}
    cameras = [Camera("perspective", {"c": c}, name=f"camera {row}") for row, c in enumerate(places, 1)]
    return cameras, [places[each] for each in distances]


def attitude_matrices(block: Block) -> Floats:
    """Return (P, 3, 3) attitudes A of photos, photo to object; NaN if unknown."""
    return known_matrices(angles_form(block.photo_to_ground), block.photo_attitudes)


def correlated_control(block: Block) -> dict[str, Control]:
    return {each.point: each for each in block.observations.of_type(Control)}


class KnownPoints(NamedTuple):
    """Control and check points of a project.

    `rows` are the k points of the block; `positions` and `sd` are (k, 3), NaN and infinite if unknown;
    `covariances` are (k, 3, 3), 0 if free; `checks` are (k,) the check points.
    """

    rows: list[int]
    positions: Floats
    sd: Floats
    covariances: Floats
    checks: Bools


def known_points(project: Project) -> KnownPoints:
    """Return control points, also correlated ones, and check points."""
    block, full = project.block, correlated_control(project.block)
    correlated = np.array([name in full for name in block.point_ids], dtype=bool)
    held = np.isfinite(block.point_sd).any(axis=1) | np.isfinite(block.point_positions).any(axis=1)
    rows = np.flatnonzero(correlated | held).tolist()
    checks = np.isin(rows, project.checks)
    positions, sd = block.point_positions[rows].copy(), block.point_sd[rows].copy()
    if block.point_check_sd is not None:
        given = block.point_check_sd[rows]
        sd = np.where(checks[:, np.newaxis] & np.isfinite(given), given, sd)
    covariances = np.where(np.isfinite(sd), sd, 0.0)[:, :, np.newaxis] ** 2 * np.eye(3)
    for k, row in enumerate(rows):
        if (each := full.get(block.point_ids[row])) is not None:
            positions[k], covariances[k], checks[k] = each.observed, each.precision, False
            sd[k] = np.sqrt(np.diag(each.precision))
    return KnownPoints(rows, positions, sd, covariances, checks)


def check_images(block: Block, title: str) -> None:
    """Reject image coordinates of films or line scanners."""
    if scans := [each for each in block.passages if isinstance(each, Scan)]:
        raise InputError(phrase("format.film", title=title, photo=scans[0].photo))
    if strips := [each for each in block.timed if each.lines is not None]:
        raise InputError(phrase("format.scanner", photo=strips[0].photo))


def intersected(project: Project, points: Indices) -> Floats:
    """Return (k, 3) intersections of the rays of points; NaN without."""
    block = project.block
    if not len(points) or block.geographic:
        return np.full((len(points), 3), np.nan)
    places = np.full(len(block.point_ids), -1, dtype=np.int64)
    places[points] = np.arange(len(points))
    # The pose of a photo on a trajectory is only approximate.
    placed = ~on_shared(block)[block.image_photos]
    own = kept_images(block, np.flatnonzero((places[block.image_points] >= 0) & placed))
    rays = np.einsum("nij,nj->ni", attitude_matrices(block)[own.image_photos], image_directions(own))
    centres = block.photo_positions[own.image_photos]
    good: Bools = np.asarray(np.isfinite(np.hstack([rays, centres])).all(axis=1))
    return meet_rays(places[own.image_points[good]], len(points), centres[good], rays[good])


def complete_positions(project: Project) -> Floats:
    """Return (n, 3) known, approximate or intersected positions, else NaN."""
    found = project.positions()
    missing = np.flatnonzero(~np.isfinite(found).all(axis=1))
    found[missing] = intersected(project, missing)
    return found


def is_free(project: Project) -> bool:
    """Return whether only initial values define the datum of a project.

    Trajectories define it: their prior values refer to the frame of the project.
    """
    block = project.block
    return not (block.observations or block.timed or np.isfinite(block.photo_position_sd).any())


def carried(project: Project, by: tuple[float, Floats, Floats], frame: Frame, message: Message) -> Project:
    """Return a project transformed by scale, (3, 3) rotation, (3,) translation."""
    block = project.block
    scale, turn, shift = by
    positions = scale * block.photo_positions @ turn.T + shift
    angles = known_angles("omega_phi_kappa", turn @ attitude_matrices(block))
    moved = block.replace(photo_positions=positions, photo_attitudes=angles, photo_to_ground=False)
    starts = scale * project.starts @ turn.T + shift
    return project.replace(block=moved, starts=starts, frame=frame, messages=(*project.messages, message))


def chosen_model(
    place: Failing, names: Sequence[str], wanted: int | None, default: int, messages: list[Message]
) -> int:
    """Return the model of a file that the user requests, or a default; a message lists several models."""
    model = default if wanted is None else wanted
    if model >= len(names):
        raise place.error(phrase("format.models", n=len(names), model=model))
    if len(names) > 1:
        messages.append(Message(phrase("format.model-chosen", n=len(names), names=list(names), model=model)))
    return model


Count = Callable[[Project], int | np.integer | bool]


def _held(project: Project) -> int:
    return int(np.count_nonzero(np.isfinite(project.block.point_sd).any(axis=1)))


_ABSENT: Mapping[str, Count] = {
    **dict.fromkeys(("names", "deviations", "points", "frame"), lambda _: True),
    "lenses": lambda project: any(each.model != "perspective" for each in known_cameras(project.block)[0]),
    "shared-cameras": lambda _: True,
    "unknowns": lambda project: any(each.deviations.any() for each in known_cameras(project.block)[0]),
    "control": lambda project: _held(project) + len(project.checks),
    "rigs": lambda project: len(project.block.mounts),
    "boards": lambda project: len(project.block.passages),
    "unposed": lambda project: np.count_nonzero(~known_poses(project.block)),
}
"""Functions that count the parts of a project that formats without a capability cannot contain."""
_PARTIAL: Mapping[str, tuple[str, Count]] = {
    "place": ("topocentric", lambda project: project.frame.kind != "topocentric"),
    "correlations": ("control", lambda project: len(correlated_control(project.block))),
    "gnss": ("gnss", lambda project: any(isinstance(each, Position) for each in project.block.observations)),
}
"""Capabilities with parts that no format with them can contain, and functions that count these parts."""


def lost(project: Project, holds: Collection[str]) -> list[Phrase]:
    """Return the parts of a project that a format with these capabilities cannot contain."""
    counts = {part: count(project) for part, count in _ABSENT.items() if part not in holds}
    counts |= {part: count(project) for part, (whole, count) in _PARTIAL.items() if whole in holds}
    kinds = {name: kind for name, kind in (("control", Control), ("GNSS", Position)) if name.lower() in holds}
    others = [each for each in project.block.observations if not isinstance(each, tuple(kinds.values()))]
    counts["observations"] = len(others)
    fields = {"frame": project.frame.phrase, "held": _held(project), "checks": len(project.checks)}
    fields["names"] = ["images", *kinds]
    return [phrase(f"lost.{part}", n=int(count), **fields) for part, count in counts.items() if count]


NOMINAL_MM = 0.01  # Side of a pixel (mm) of unknown size; it does not affect the rays
ROUND = 100  # Pixels: rounding of unknown widths and heights
ROUND_ORIGIN = 1e-4  # Degrees to which the origin is rounded; its height is 0


def in_pixels(project: Project) -> Project:
    """Return a project with the same rays and image coordinates in pixels.

    Millimetres are divided by the size of a pixel, or a nominal one. Negative planes are rotated by 180
    degrees into positive ones. Cameras without image size get one that contains all observations, if
    coordinates do not count from corners. Rolling shutters are omitted, as their rows count in the old
    coordinates.
    """
    block = project.block
    if (strips := np.flatnonzero(scanners(block))).size:
        raise InputError(phrase("format.scanner", photo=block.photo_ids[int(strips[0])]))
    given = block.image_unit == "px"
    if given and not _unsized(project):
        return project
    cameras, which = known_cameras(block)
    of_images = np.asarray(which, dtype=np.int64)[block.image_photos]
    none = (None,) * len(cameras)
    pixels = [each or (None if given else NOMINAL_MM) for each in project.pixel_mm or none]
    xy, sd = block.image_xy.copy(), block.image_sd.copy()
    made, sizes = list[Camera](), list[Size | None]()
    for row, (camera, pixel, size) in enumerate(zip(cameras, pixels, project.sizes or none, strict=True)):
        own = of_images == row
        scale = 1.0 if given or pixel is None else 1.0 / pixel
        negative = camera.model == "perspective" and camera.parameters["c"] > 0
        xy[own] *= -scale if negative else scale
        sd[own] *= scale
        sign = -1.0 if negative else 1.0
        factors = {name: sign * scale**power for name, power in camera.powers.items()}
        made.append(scaled_camera(camera, factors).replace(unit="px"))
        if size is None and _is_free(camera):
            # A size that contains all observations.
            reach = np.abs(xy[own]).max(axis=0, initial=1.0) * (2 if camera.image_y == "up" else 1)
            size = (ROUND * math.ceil(reach[0] / ROUND), ROUND * math.ceil(reach[1] / ROUND))
        sizes.append(size)
    images = {"image_xy": xy, "image_sd": sd, "timed": ()}
    block = block.replace(cameras=made, photo_cameras=which, principal_distances=None, **images)
    return project.replace(block=block, sizes=tuple(sizes), pixel_mm=tuple(pixels))


def nominal_pixels(project: Project) -> list[Phrase]:
    nominal = project.block.image_unit == "mm" and None in (project.pixel_mm or (None,))
    codes = {"lost.nominal-pixels": nominal, "lost.image-size": _unsized(project)}
    return [phrase(code, size=NOMINAL_MM) for code, is_lost in codes.items() if is_lost]


def _unsized(project: Project) -> bool:
    """Return whether a camera without image size does not need one."""
    cameras, _ = known_cameras(project.block)
    sizes = project.sizes or (None,) * len(cameras)
    return any(size is None and _is_free(each) for each, size in zip(cameras, sizes, strict=True))


def _is_free(camera: Camera) -> bool:
    """Return whether coordinates do not depend on the image size."""
    return camera.image_y == "up" or camera.unit == "mm"


def in_topocentric(project: Project) -> Project:
    """Return a geographic project in a topocentric frame at its median photo.

    The rays are the same. Standard deviations refer to local axes, which differ from the axes of the frame by
    the angle between the verticals. The unknown components of partly known points are intersected from their
    rays. Other observations than image observations are omitted.
    """
    block = project.block
    if block.spheroid is None:
        return project
    refuse_trajectories(block, "a topocentric frame")
    refuse_passages(block, "a topocentric frame")
    origin, spheroid = _origin(block), block.spheroid
    local = LocalAxes(block, Cartesian(spheroid).positions(origin)[0], local_frames(origin)[0])
    carried = local.positions

    def turned(positions: Floats, attitudes: Floats) -> Floats:
        turns = local.frame @ local_frames(positions).transpose(0, 2, 1)
        matrices = turns @ attitude_matrices(block.replace(photo_attitudes=attitudes))
        return known_angles(angles_form(block.photo_to_ground), matrices)

    photos = block.photo_positions
    observed, angles = block.photo_positions_observed, block.photo_attitudes_observed
    made = block.replace(
        spheroid=None,
        observations=(),
        photo_positions=carried(photos),
        photo_attitudes=turned(photos, block.photo_attitudes),
        photo_positions_observed=None if observed is None else carried(observed),
        photo_attitudes_observed=None if angles is None else turned(photos, angles),
        photo_position_sd=block.photo_position_sd * lengths_of_units(photos, spheroid),
        point_positions=np.full_like(block.point_positions, np.nan),
        point_sd=np.full_like(block.point_sd, np.inf),
    )
    degrees = (float(np.degrees(origin[0, 1])), float(np.degrees(origin[0, 0])), 0.0)
    known = spheroid == Spheroid.wgs84() and block.linear_unit == "m"
    frame = Frame("topocentric", origin=degrees) if known else Frame()
    rectangular = project.replace(block=made.replace(frame=frame), frame=frame)
    given = np.isfinite(block.point_positions)
    some = np.flatnonzero(given.any(axis=1))
    whole = block.point_positions[some]
    partly = np.flatnonzero(~given[some].all(axis=1))
    if len(partly):
        meet = intersected(rectangular, some[partly])
        near = local.from_local(np.where(np.isfinite(meet), meet, 0.0))
        whole[partly] = np.where(given[some[partly]], whole[partly], near)
    positions, sd = made.point_positions.copy(), made.point_sd.copy()
    positions[some] = np.where(given[some], carried(whole), np.nan)
    sd[some] = block.point_sd[some] * lengths_of_units(whole, spheroid)
    block_made = rectangular.block.replace(point_positions=positions, point_sd=sd)
    return rectangular.replace(block=block_made, starts=carried(project.starts))


def topocentric_remarks(project: Project) -> list[Phrase | str]:
    """Return remarks on a geographic project in rectangular coordinates."""
    block = project.block
    if block.spheroid is None:
        return []
    origin = _origin(block)
    up = local_frames(np.vstack([origin, block.photo_positions]))[:, 2]
    angle = math.degrees(float(np.arccos(np.clip(up[1:] @ up[0], -1, 1)).max())) * 60
    place = zip(("longitude", "latitude"), np.degrees(origin[0, :2]).tolist(), strict=True)
    fields = {"unit": block.linear_unit, "a": block.spheroid.a, "b": block.spheroid.b, **dict(place)}
    found: list[Phrase | str] = [phrase("lost.geographic", **fields, angle=angle)]
    if n := len(block.observations):
        found.append(phrase("lost.observations", n=n, names=["images"]))
    return found


def _origin(block: Block) -> Floats:
    """Return (1, 3) the median position of the photos, on the ellipsoid."""
    middle = np.degrees(np.median(block.photo_positions[:, :2], axis=0))
    return np.array([[*np.radians(np.round(middle / ROUND_ORIGIN) * ROUND_ORIGIN), 0.0]])
