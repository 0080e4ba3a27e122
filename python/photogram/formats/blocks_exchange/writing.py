"""Writer of BlocksExchange XML, version 2.1: matrices, pixels, y down."""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import escape

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.block_contents import known_points
from photogram.formats.blocks_exchange import FILE
from photogram.formats.blocks_exchange.reading import CENTER
from photogram.formats.images import Y_DOWN, lens_with, sizes_of, to_corner
from photogram.formats.plain.writing import attitude_matrices, known_cameras
from photogram.formats.project import Project, Size
from photogram.network.cameras import Camera
from photogram.network.observations import Position
from photogram.words import Phrase, phrase


def cannot_hold(project: Project) -> list[Phrase]:
    """Return differences of standard deviations of control that the file cannot contain."""
    sd = project.block.point_sd
    sd = sd[np.isfinite(sd).all(axis=1)]
    return [phrase("lost.horizontal-deviations")] if (sd[:, 0] != sd[:, 1]).any() else []


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file."""
    block = project.block
    cameras, which = known_cameras(block)
    frame = project.frame
    definition = (
        "ENU:{!r},{!r},{!r}".format(*frame.origin)
        if frame.kind == "topocentric" and frame.origin is not None
        else 'LOCAL_CS["Local",UNIT["metre",1]]'
    )
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        '<BlocksExchange version="2.1">',
        "<SpatialReferenceSystems>",
    ]
    lines += [f"<SRS><Id>0</Id><Name>frame</Name><Definition>{escape(definition)}</Definition></SRS>"]
    lines += ["</SpatialReferenceSystems>", "<Block>", f"<Name>{_text(block.title or 'block')}</Name>"]
    lines += ["<Type>Aerial</Type>", "<SRSId>0</SRSId>", "<Photogroups>"]
    gnss = {each.photos[0]: each.observed[:3] for each in block.observations.of_type(Position)}
    rotations = Y_DOWN @ attitude_matrices(block).transpose(0, 2, 1)
    for row, (camera, size) in enumerate(zip(cameras, sizes_of(project), strict=True)):
        lines += ["<Photogroup>", *_camera(camera, size)]
        for photo in np.flatnonzero(np.asarray(which) == row).tolist():
            lines += _photo(project, photo, rotations[photo].tolist(), gnss)
        lines.append("</Photogroup>")
    lines += ["</Photogroups>", *_points(project), "</Block>", "</BlocksExchange>", ""]
    return {FILE: "\n".join(lines).encode()}


def _text(text: str) -> str:
    return escape("".join(each if each.isprintable() else " " for each in text))


def _tags(values: Mapping[str, float]) -> str:
    return "".join(f"<{name}>{value!r}</{name}>" for name, value in values.items())


def _xyz(position: Floats) -> str:
    return _tags(dict(zip("xyz", position.tolist(), strict=True)))


def _camera(camera: Camera, size: Size) -> list[str]:
    lens = lens_with(camera, size, "BlocksExchange", "k1", "k2", "k3", "p1", "p2")
    terms = {"K1": lens.k1, "K2": lens.k2, "K3": lens.k3, "P1": lens.p2, "P2": lens.p1}
    return [
        f"<Name>{_text(camera.title)}</Name>",
        f"<ImageDimensions><Width>{size[0]}</Width><Height>{size[1]}</Height></ImageDimensions>",
        "<CameraModelType>Perspective</CameraModelType>",
        f"<FocalLengthPixels>{lens.fx!r}</FocalLengthPixels>",
        "<CameraOrientation>XRightYDown</CameraOrientation>",
        f"<PrincipalPoint>{_tags({'x': lens.cx - CENTER, 'y': lens.cy - CENTER})}</PrincipalPoint>",
        f"<Distortion>{_tags(terms)}</Distortion>",
        f"<AspectRatio>{lens.fy / lens.fx!r}</AspectRatio>",
        "<Skew>0.0</Skew>",
    ]


def _photo(
    project: Project, photo: int, rotation: list[list[float]], gnss: Mapping[str, Floats]
) -> list[str]:
    name = project.block.photo_ids[photo]
    pose = ""
    if np.isfinite(rotation).all():
        matrix = {f"M_{i}{j}": rotation[i][j] for i in range(3) for j in range(3)}
        pose += f"<Rotation>{_tags(matrix)}<Accurate>true</Accurate></Rotation>"
    centre = project.block.photo_positions[photo]
    if np.isfinite(centre).all():
        pose += f"<Center>{_xyz(centre)}<Accurate>true</Accurate></Center>"
    if name in gnss:
        pose += f"<Metadata><SRSId>0</SRSId><Center>{_xyz(gnss[name])}</Center></Metadata>"
    return [
        "<Photo>",
        f"<Id>{photo}</Id>",
        f"<ImagePath>{escape(name)}</ImagePath>",
        *([f"<Pose>{pose}</Pose>"] if pose else []),
        "</Photo>",
    ]


def _points(project: Project) -> list[str]:
    block = project.block
    corner = (to_corner(project) - CENTER).tolist()
    images: list[list[str]] = [[] for _ in block.point_ids]
    for photo, point, (x, y) in zip(
        block.image_photos.tolist(), block.image_points.tolist(), corner, strict=True
    ):
        images[point].append(f"<Measurement><PhotoId>{photo}</PhotoId><x>{x!r}</x><y>{y!r}</y></Measurement>")
    known = known_points(project)
    places = {row: k for k, row in enumerate(known.rows)}
    control, ties = ["<ControlPoints>"], ["<TiePoints>"]
    for row, name in enumerate(block.point_ids):
        title = f"<Name>{escape(name)}</Name>"
        if (k := places.get(row)) is not None:
            given = _given(known.positions[k], known.sd[k], bool(known.checks[k]))
            control += ["<ControlPoint>", title, *given, *images[row], "</ControlPoint>"]
            continue
        start = project.starts[row]
        position = [f"<Position>{_xyz(start)}</Position>"] if np.isfinite(start).all() else []
        ties += ["<TiePoint>", title, *position, *images[row], "</TiePoint>"]
    return [*control, "</ControlPoints>", *ties, "</TiePoints>"]


def _given(position: Floats, sd: Floats, check: bool) -> list[str]:
    held = np.isfinite(position) if check else np.isfinite(sd)
    category = "Full" if held.all() else "Vertical" if held[2] and not held[:2].any() else "Horizontal"
    tags = {axis: float(value) for axis, value, own in zip("xyz", position, held, strict=True) if own}
    lines = [f"<Category>{category}</Category>", f"<Position>{_tags(tags)}</Position>"]
    if check:
        lines.append("<CheckPoint>true</CheckPoint>")
        held = held & np.isfinite(sd)
    if held[:2].all():
        lines.append(f"<HorizontalAccuracy>{float(np.sqrt((sd[:2] ** 2).mean()))!r}</HorizontalAccuracy>")
    if held[2]:
        lines.append(f"<VerticalAccuracy>{float(sd[2])!r}</VerticalAccuracy>")
    return lines
