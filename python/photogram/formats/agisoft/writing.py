"""Writer of Metashape camera XML: sensors, poses, references, markers."""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.agisoft import FILE
from photogram.formats.block_contents import KnownPoints, known_points, posed
from photogram.formats.images import Y_DOWN, known_size, lens_with, to_corner
from photogram.formats.plain.writing import attitude_matrices, known_cameras
from photogram.formats.project import Frame, Project, Size
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.network.observations import Position
from photogram.words import Phrase, phrase

LOCAL = (
    'LOCAL_CS["Local Coordinates (m)",LOCAL_DATUM["Local Datum",0],UNIT["metre",1,AUTHORITY["EPSG","9001"]]]'
)
_TERMS = ("f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4")


def cannot_hold(project: Project) -> list[Phrase]:
    """Return images of tie points, incomplete control, and digits of the earth."""
    block, known = project.block, known_points(project)
    marked = np.isin(np.arange(len(block.point_ids)), np.array(known.rows, dtype=int)[_complete(known)])
    partial = np.isfinite(block.point_positions).any(axis=1) & ~marked
    counts = {
        "lost.ties": np.count_nonzero(~marked[block.image_points]),
        "lost.partial-control": np.count_nonzero(partial),
        "lost.geocentric-digits": np.count_nonzero(project.frame.kind in ("topocentric", "geocentric")),
    }
    return [phrase(code, n=int(count)) for code, count in counts.items() if count]


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file; a topocentric frame is written with its position on the earth."""
    block = project.block
    if not posed(block).any():
        raise InputError(phrase("format.poses"))
    world = _world(project.frame)
    cameras, which = known_cameras(block)
    sensors = enumerate(zip(cameras, project.sizes, project.pixel_mm, strict=True))
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<document version="2.0.0">',
        '<chunk enabled="true">',
        f'<sensors next_id="{len(cameras)}">',
        *(line for row, given in sensors for line in _sensor(row, *given)),
        "</sensors>",
        '<components next_id="1" active_id="0">',
        '<component id="0" label="Component 1">',
        f"<transform><rotation>{_numbers(world.rotation)}</rotation>"
        f"<translation>{_numbers(world.translation)}</translation><scale>1.0</scale></transform>",
        "</component>",
        "</components>",
        *_shots(project, world, which),
        *_markers(project, world),
        f"<reference>{world.text}</reference>",
        "</chunk>",
        "</document>",
        "",
    ]
    return {FILE: "\n".join(lines).encode()}


@dataclass(frozen=True)
class _World:
    """The transformation X_world = R X + T of the chunk, and the reference system."""

    rotation: Floats
    translation: Floats
    text: str
    crs: str
    frame: Frame

    def references(self, xyz: Floats, covariances: Floats) -> tuple[Floats, Floats]:
        """Return positions and standard deviations in the reference system."""
        if self.crs and len(xyz):
            from photogram.formats.crs import from_frame

            xyz, covariances = from_frame(self.crs, xyz, covariances, self.frame)
        return xyz, np.sqrt(np.einsum("nii->ni", covariances))


def _world(frame: Frame) -> _World:
    if frame.kind == "cartesian" or (frame.kind == "topocentric" and frame.origin is None):
        return _World(np.eye(3), np.zeros(3), LOCAL.replace('"', "&quot;"), "", frame)
    from photogram.formats.crs import GEOCENTRIC, GEOGRAPHIC, east_north_up, from_frame

    rotation, translation = np.eye(3), np.zeros(3)
    if frame.origin is not None and frame.kind == "topocentric":
        rotation = east_north_up(frame.origin).T
        translation = from_frame(GEOCENTRIC, np.zeros((1, 3)), np.zeros((1, 3, 3)), frame)[0][0]
    return _World(rotation, translation, GEOGRAPHIC, GEOGRAPHIC, frame)


def _numbers(values: Floats) -> str:
    return " ".join(map(repr, values.ravel().tolist()))


def _sensor(row: int, camera: Camera, size: Size | None, pixel: float | None) -> list[str]:
    kind, values = _calibration(camera, size)
    size = known_size(camera, size)
    extent = f'<resolution width="{size[0]}" height="{size[1]}"/>'
    lines = [f'<sensor id="{row}" label={quoteattr(camera.title)} type="{kind}">', extent]
    if pixel is not None:
        lines += [f'<property name="{name}" value="{pixel!r}"/>' for name in ("pixel_width", "pixel_height")]
        if "f" in values:
            lines.append(f'<property name="focal_length" value="{values["f"] * pixel!r}"/>')
    if values:
        terms = "".join(f"<{name}>{values[name]!r}</{name}>" for name in _TERMS if name in values)
        lines += [f'<calibration type="{kind}" class="adjusted">', extent, terms, "</calibration>"]
    return [*lines, "</sensor>"]


def _calibration(camera: Camera, size: Size | None) -> tuple[str, Mapping[str, float]]:
    """Return type and parameters of a sensor, without parameters for a spherical one."""
    if camera.model == "equirectangular":
        return "spherical", {}
    if camera.model.startswith("agisoft_"):
        values = {name: value for name, value in camera.parameters.items() if name not in ("w", "h")}
        return camera.model.split("_")[1], values
    lens = lens_with(camera, size, "Metashape", "k1", "k2", "k3", "p1", "p2")
    size = known_size(camera, size)
    # p1 is the coefficient of r^2 + 2 x^2 in Metashape.
    return "frame", {
        "f": lens.fy,
        "cx": lens.cx - size[0] / 2,
        "cy": lens.cy - size[1] / 2,
        "b1": lens.fx - lens.fy,
        "b2": 0.0,
        "k1": lens.k1,
        "k2": lens.k2,
        "k3": lens.k3,
        "k4": 0.0,
        "p1": lens.p2,
        "p2": lens.p1,
    }


def _shots(project: Project, world: _World, which: list[int]) -> list[str]:
    block = project.block
    turns = attitude_matrices(block) @ Y_DOWN
    given = block.observations.of_type(Position)
    positions, sd = world.references(
        np.array([each.observed[:3] for each in given]).reshape(-1, 3),
        np.array([each.precision for each in given]).reshape(-1, 3, 3),
    )
    references = {
        each.photo: _reference(position, deviation)
        for each, position, deviation in zip(given, positions, sd, strict=True)
    }
    lines = [f'<cameras next_id="{len(block.photo_ids)}" next_group_id="0">']
    for row in np.flatnonzero(posed(project.block)).tolist():
        name = block.photo_ids[row]
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = turns[row], block.photo_positions[row]
        lines += [
            f'<camera id="{row}" sensor_id="{which[row]}" component_id="0" label={quoteattr(name)}>',
            f"<transform>{_numbers(transform)}</transform>",
            "<orientation>1</orientation>",
            *([references[name]] if name in references else []),
            "</camera>",
        ]
    return [*lines, "</cameras>"]


def _reference(position: Floats, sd: Floats, check: bool = False) -> str:
    """Return a reference; the reference of a check point is disabled."""
    values = dict(zip("xyz", position.tolist(), strict=True))
    if not check or (sd > 0).all():
        values |= dict(zip(("sx", "sy", "sz"), sd.tolist(), strict=True))
    attributes = " ".join(f'{name}="{value!r}"' for name, value in values.items())
    return f'<reference {attributes} enabled="{"false" if check else "true"}"/>'


def _complete(known: KnownPoints) -> Bools:
    """Return which points are markers: complete control, and check points."""
    held = np.isfinite(known.sd).all(axis=1) | known.checks
    return np.asarray(np.isfinite(known.positions).all(axis=1) & held)


def _markers(project: Project, world: _World) -> list[str]:
    known = known_points(project)
    own = np.flatnonzero(_complete(known)).tolist()
    if not own:
        return []
    positions, deviations = world.references(known.positions[own], known.covariances[own])
    lines = [f'<markers next_id="{len(own)}" next_group_id="0">']
    for k, (row, sd) in enumerate(zip(own, deviations, strict=True)):
        name = quoteattr(project.block.point_ids[known.rows[row]])
        reference = _reference(positions[k], sd, bool(known.checks[row]))
        lines.append(f'<marker id="{k}" label={name}>{reference}</marker>')
    markers = {known.rows[row]: k for k, row in enumerate(own)}
    return [*lines, "</markers>", *_locations(project, markers)]


def _locations(project: Project, markers: Mapping[int, int]) -> list[str]:
    block, corner = project.block, to_corner(project).tolist()
    shown = posed(project.block)
    images: dict[int, list[str]] = {k: [] for k in markers.values()}
    for photo, point, (x, y) in zip(
        block.image_photos.tolist(), block.image_points.tolist(), corner, strict=True
    ):
        if point in markers and shown[photo]:
            images[markers[point]].append(
                f'<location camera_id="{photo}" pinned="true" x="{x!r}" y="{y!r}"/>'
            )
    lines = ['<frames next_id="1">', '<frame id="0">', "<markers>"]
    lines += [f'<marker marker_id="{k}">{"".join(own)}</marker>' for k, own in images.items()]
    return [*lines, "</markers>", "</frame>", "</frames>"]
