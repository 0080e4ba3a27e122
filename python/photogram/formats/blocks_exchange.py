"""BlocksExchange XML: reader, and writer of version 2.1 (matrices, pixels, y down)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.crs import enu_origin
from photogram.formats.description import agreement
from photogram.formats.format import FORMATS
from photogram.formats.images import Y_DOWN, checked_rotation, lens_with, pixel_rows, sizes_of
from photogram.formats.models import attitude_matrices, known_cameras, known_points
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.xml_stream import Element, read_stream
from photogram.io.places import at_place, image_size, one_word, positive
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.network.geometry import Frame
from photogram.network.observations import Position
from photogram.words import Phrase, option_sd, phrase

ORIENTATIONS = {
    "XRightYDown": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "XRightYUp": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "XLeftYDown": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "XLeftYUp": ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "XDownYRight": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "XDownYLeft": ((0, -1, 0), (-1, 0, 0), (0, 0, -1)),
    "XUpYRight": ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
    "XUpYLeft": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
}
"""Rows: the axes of a camera orientation in the axes of photogram: x right, y up, z back."""
CENTER = 0.5  # Shift from the centre of the first pixel (0, 0) to coordinates from its corner
_Photo = tuple[Element, int, str, tuple[Floats, Floats, str] | None, tuple[Floats, str] | None]
_TERMS = {"K1": "k1", "K2": "k2", "K3": "k3", "P1": "p2", "P2": "p1"}
"""Terms of OpenCV: P1 is the coefficient of r^2 + 2 x^2 in x, which OpenCV calls p2."""
_READINGS: Mapping[str, Callable[[Mapping[str, float]], Mapping[str, float]]] = {
    "P1 and P2 exchanged": lambda own: {"p1": own["p2"], "p2": own["p1"]},
    "K1, K2, K3 with the other sign": lambda own: {name: -own[name] for name in ("k1", "k2", "k3")},
}
"""Alternative definitions of the distortion terms in other programs."""
BETTER, NOTICED = 3.0, 0.1
"""Ratio of agreement for another definition that rejects a file, and the smallest median for it."""


class _Reader(BlockBuilder):
    """A block, with the contents of a file in the order of reading."""

    def __init__(self, path: Path, options: ReadOptions) -> None:
        super().__init__(path, FORMATS["blocks_exchange"].title)
        self.given_sd, self.systems = options.sd, dict[str, str]()
        self.axes: list[Floats] = []  # Of each camera
        self.positions = 0  # Number of observed positions
        # Photos of a group: id, path, pose (centre, rotation, CRS), observed centre with CRS
        self.waiting: list[_Photo] = []
        self.measured: list[tuple[int, int, float, float, bool]] = []
        """Photo id, point, x, y, and whether these are millimetres from the principal point."""
        self.in_millimetres: Element | None = None  # The first observation in millimetres


def read(path: Path, options: ReadOptions) -> Project:
    """Read a file with one block."""
    found = _Reader(path, options)
    take: dict[str, Callable[[Element], None]] = {
        "SRS": lambda own: found.systems.__setitem__(own.word("Id"), own.word("Definition")),
        "Photo": partial(_photo, found),
        "Photogroup": partial(_group, found),
        "ControlPoint": partial(_control, found),
        "TiePoint": partial(_tie, found),
    }
    root = read_stream(path, take, "BlocksExchange")
    block = root.child("Block")
    if len(list(root.all("Block"))) > 1:
        raise root.error(phrase("blocks-exchange.blocks"))
    if block is None or not found.photo_ids:
        raise root.error(phrase("format.missing", what="a block with photos"))
    return _checked(_project(found, block.word("SRSId")))


def _group(found: _Reader, element: Element) -> None:
    dimensions = element.need("ImageDimensions")
    size = image_size(dimensions, dimensions.whole("Width"), dimensions.whole("Height"))
    one_word(element, "CameraModelType", element.word("CameraModelType", "Perspective"), ["Perspective"])
    orientation = element.word("CameraOrientation", "XRightYDown")
    one_word(element, "CameraOrientation", orientation, ORIENTATIONS)
    axes = np.array(ORIENTATIONS[orientation], dtype=float)
    pixel: float | None = None
    for tag, count in (("PixelSize", 1), ("SensorSize", max(size))):
        if pixel is None and element.child(tag) is not None:
            pixel = positive(element, "the size of the sensor", element.number(tag) / count)
    name = f"{element.word('Name') or 'camera'} {len(found.axes) + 1}"
    with at_place(element):
        camera = _camera(element, size, axes, pixel, name)
    found.camera(camera, size, pixel, key=len(found.axes))
    found.axes.append(axes)
    srs = element.word("SRSId")
    for photo, number, path, pose, observed in found.waiting:
        found.photo(number, len(found.axes) - 1, photo, name=path)
        if pose is not None:
            centre, rotation, crs = pose
            found.pose(number, centre, (axes.T @ rotation).T, crs=crs or srs)
        if observed is not None:
            found.positions += 1
            if (sd := found.given_sd.get("gnss")) is not None:
                found.gnss(number, observed[0], sd, crs=observed[1] or crs or srs)
    found.waiting.clear()


def _camera(element: Element, size: Size, axes: Floats, pixel: float | None, name: str) -> Camera:
    if element.child("FocalLengthPixels") is not None:
        f = element.number("FocalLengthPixels")
    elif pixel is not None:
        f = element.number("FocalLength") / pixel
    else:
        raise element.error(phrase("format.member", name="FocalLengthPixels, or FocalLength and SensorSize"))
    cx, cy = size[0] / 2, size[1] / 2
    point = element.child("PrincipalPoint")
    if point is not None and point.child("xmm") is not None:
        if pixel is None:
            raise point.error(phrase("format.sensor-size"))
        right, up = (axes[:2, :2].T @ [point.number("xmm"), point.number("ymm")]) / pixel
        cx, cy = cx + right, cy - up
    elif point is not None:
        cx, cy = point.number("x") + CENTER, point.number("y") + CENTER
    terms, distortion = dict.fromkeys(_TERMS, 0.0), element.child("Distortion")
    for each in () if distortion is None else distortion.children:
        if each.name in _TERMS:
            terms[each.name] = each.value
        elif each.text.strip() not in ("", "0", "0.0", "false"):
            one_word(each, "term of the distortion", each.name, _TERMS)
    fy, skew = f * element.number("AspectRatio", 1.0), element.number("Skew", 0.0)
    if skew:
        offsets = {"cx": cx - size[0] / 2, "cy": cy - size[1] / 2, "w": float(size[0]), "h": float(size[1])}
        own = {term.lower(): value for term, value in terms.items()}
        return Camera("agisoft_frame", {"f": fy, "b1": f - fy, "b2": skew, **offsets, **own}, name=name)
    own = {_TERMS[term]: value for term, value in terms.items()}
    return Camera("full_opencv", {"fx": f, "fy": fy, "cx": float(cx), "cy": float(cy), **own}, name=name)


def _photo(found: _Reader, element: Element) -> None:
    number, path, pose = element.whole("Id"), element.word("ImagePath"), element.child("Pose")
    if not path:
        raise element.error(phrase("format.member", name="ImagePath"))
    given, observed = None, None
    if pose is not None:
        centre, rotation, srs = np.full(3, np.nan), np.full((3, 3), np.nan), ""
        if (own := pose.child("Center")) is not None:
            centre, srs = _position(own), own.word("SRSId")
        if (turn := pose.child("Rotation")) is not None:
            rotation = _rotation(turn)
        given, metadata = (centre, rotation, srs), pose.child("Metadata")
        if metadata is not None and (own := metadata.child("Center")) is not None:
            observed = _position(own), metadata.word("SRSId")
    element.children.clear()  # They need far more memory
    found.waiting.append((element, number, path, given, observed))


def _position(element: Element) -> Floats:
    return np.array([element.number(axis) for axis in "xyz"])


def _rotation(element: Element) -> Floats:
    """Return (3, 3) world to camera, in the axes of the camera orientation."""
    if element.child("M_00") is not None:
        matrix = [[element.number(f"M_{i}{j}") for j in range(3)] for i in range(3)]
        return checked_rotation(element, np.array(matrix))
    if element.child("Omega") is not None:
        angles = np.radians([[element.number(name) for name in ("Omega", "Phi", "Kappa")]])
        if (most := np.abs(angles).max()) > 1e4:
            raise element.error(phrase("format.angles", most=1e4, unit="rad", value=float(most)))
        return np.asarray(Attitudes.of("omega_phi_kappa", angles).values("matrix_to_photo")[0])
    raise element.error(phrase("blocks-exchange.rotation"))


def _control(found: _Reader, element: Element) -> None:
    key = len(found.point_ids)
    name = element.word("Name") or f"control {key + 1}"
    category = element.word("Category", "Full")
    one_word(element, "Category", category, ("Full", "Horizontal", "Vertical"))
    given = element.need("Position")
    position = np.array([np.nan if given.child(axis) is None else given.number(axis) for axis in "xyz"])
    if category == "Horizontal":
        position[2] = np.nan
    elif category == "Vertical":
        position[:2] = np.nan
    default = np.broadcast_to(found.given_sd.get("control", (np.nan,)), 3)
    horizontal = element.number("HorizontalAccuracy", float(default[0]))
    sd = np.array([horizontal, horizontal, element.number("VerticalAccuracy", float(default[2]))])
    check = element.word("CheckPoint").lower() in ("true", "1")
    if not check and not (sd[~np.isnan(position)] > 0).all():
        raise element.error(phrase("format.sd", name=name, option=option_sd("control")))
    found.point(key, element, name=name)
    found.control(key, position, sd, element, crs=element.word("SRSId"), check=check)
    _measurements(found, element)


def _tie(found: _Reader, element: Element) -> None:
    key, given = len(found.point_ids), element.child("Position")
    position = np.full(3, np.nan) if given is None else _position(given)
    name = element.word("Name") or f"tie {key + 1}"
    while name in found.point_names:  # Control points may have the name of a tie point
        name += "'"
    found.point(key, element, name=name)
    if np.isfinite(position).all():
        found.start(key, position, element, crs=element.word("SRSId"))
    _measurements(found, element)


def _measurements(found: _Reader, element: Element) -> None:
    point = len(found.point_ids) - 1
    for each in element.all("Measurement"):
        millimetres = each.child("xmm") is not None
        across, down = ("xmm", "ymm") if millimetres else ("x", "y")
        xy = each.number(across), each.number(down)
        found.measured.append((each.whole("PhotoId"), point, *xy, millimetres))
        if millimetres and found.in_millimetres is None:
            found.in_millimetres = each


def _project(block: _Reader, srs: str) -> Project:
    @cache
    def system(own: str) -> str:
        """Return the definition of a system for PROJ; empty if it is local."""
        text = block.systems.get(own or srs, "").strip()
        return "" if text.upper().startswith("LOCAL_CS") else text

    names = [path.replace("\\", "/").rsplit("/", 1)[-1] for path in block.photo_ids]
    if all(names) and len(set(names)) == len(names):
        block.photo_ids = names
    first = next((crs for _, _, crs in block.poses.values()), "")
    block.define_systems(system)
    if main := system(srs or first):
        if (origin := enu_origin(main)) is None:
            block.frame_amid(main)
        else:
            block.frame, block.crs = Frame("topocentric", "EPSG:4979", origin), main
    if block.positions and "gnss" not in block.given_sd:
        block.lacks.append(Phrase("read.gnss", {"number": block.positions, "option": option_sd("gnss")}))
    images = [each for each in block.measured if each[0] in block.photo_rows]
    if lost := len(block.measured) - len(images):
        block.messages.append(Message.of("format.unknown-images", n=lost))
    photos = np.array([block.photo_rows[each[0]] for each in images], dtype=np.int64)
    points = np.array([each[1] for each in images], dtype=np.int64)
    block.images(photos, points, _corner(block, images, np.array(block.photo_cameras)[photos]))
    return block.project()


def _corner(found: _Reader, images: list[tuple[int, int, float, float, bool]], groups: Any) -> Floats:
    xy = np.array([each[2:4] for each in images], dtype=float).reshape(-1, 2)
    millimetres = np.array([each[4] for each in images], dtype=bool)
    corner = xy + CENTER
    for row, (camera, axes, pixel) in enumerate(zip(found.cameras, found.axes, found.pixel_mm, strict=True)):
        own = millimetres & (groups == row)
        if not own.any():
            continue
        if pixel is None:
            assert found.in_millimetres is not None
            raise found.in_millimetres.error(phrase("format.sensor-size"))
        right, up = (xy[own] @ axes[:2, :2] / pixel).T
        values = camera.parameters
        cx, cy = values["cx"], values["cy"]
        if camera.model == "agisoft_frame":
            cx, cy = cx + values["w"] / 2, cy + values["h"] / 2
        corner[own] = np.column_stack([cx + right, cy - up])
    return corner


def _checked(project: Project) -> Project:
    """Reject a file whose distortion terms fit better under another definition."""
    as_read = agreement(project).median
    if not as_read > NOTICED:
        return project
    for name, change in _READINGS.items():
        values = [{**each.parameters, **change(each.parameters)} for each in project.block.cameras]
        pairs = zip(project.block.cameras, values, strict=True)
        cameras = [camera.replace(parameters=own) for camera, own in pairs]
        other = agreement(project.replace(block=project.block.replace(cameras=cameras))).median
        if other * BETTER < as_read:
            fields = {"as_read": as_read, "other": other, "reading": name}
            raise InputError(phrase("blocks-exchange.distortion", **fields), file=project.path)
    return project


def cannot_hold(project: Project) -> list[Phrase]:
    """Return differences of standard deviations of control that the file cannot contain."""
    sd = project.block.point_sd
    sd = sd[np.isfinite(sd).all(axis=1)]
    return [phrase("lost.horizontal-deviations")] if (sd[:, 0] != sd[:, 1]).any() else []


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file."""
    block = project.block
    cameras, which = known_cameras(block)
    definition = 'LOCAL_CS["Local",UNIT["metre",1]]'
    if project.frame.kind == "topocentric" and project.frame.origin is not None:
        definition = "ENU:{!r},{!r},{!r}".format(*project.frame.origin)
    lines = ['<?xml version="1.0" encoding="utf-8"?>', '<BlocksExchange version="2.1">']
    lines.append("<SpatialReferenceSystems>")
    lines += [f"<SRS><Id>0</Id><Name>frame</Name><Definition>{escape(definition)}</Definition></SRS>"]
    lines += ["</SpatialReferenceSystems>", "<Block>", f"<Name>{_text(block.title or 'block')}</Name>"]
    lines += ["<Type>Aerial</Type>", "<SRSId>0</SRSId>", "<Photogroups>"]
    gnss = {each.photos[0]: each.observed[:3] for each in block.observations.of_type(Position)}
    rotations = Y_DOWN @ attitude_matrices(block).transpose(0, 2, 1)
    for row, (camera, size) in enumerate(zip(cameras, sizes_of(project), strict=True)):
        lens, own = lens_with(camera, size, "BlocksExchange", *_TERMS.values())
        (fx, fy), (cx, cy) = lens.focal, lens.centre
        lines += [
            "<Photogroup>",
            f"<Name>{_text(camera.title)}</Name>",
            f"<ImageDimensions><Width>{size[0]}</Width><Height>{size[1]}</Height></ImageDimensions>",
            "<CameraModelType>Perspective</CameraModelType>",
            f"<FocalLengthPixels>{fx!r}</FocalLengthPixels>",
            "<CameraOrientation>XRightYDown</CameraOrientation>",
            f"<PrincipalPoint>{_tags({'x': cx - CENTER, 'y': cy - CENTER})}</PrincipalPoint>",
            f"<Distortion>{_tags({theirs: own[term] for theirs, term in _TERMS.items()})}</Distortion>",
            f"<AspectRatio>{fy / fx!r}</AspectRatio>",
            "<Skew>0.0</Skew>",
        ]
        for photo in np.flatnonzero(np.asarray(which) == row).tolist():
            lines += _written_photo(project, photo, rotations[photo].tolist(), gnss)
        lines.append("</Photogroup>")
    lines += ["</Photogroups>", *_points(project), "</Block>", "</BlocksExchange>", ""]
    return {FORMATS["blocks_exchange"].files[0]: "\n".join(lines).encode()}


def _text(text: str) -> str:
    return escape("".join(each if each.isprintable() else " " for each in text))


def _tags(values: Mapping[str, float]) -> str:
    return "".join(f"<{name}>{value!r}</{name}>" for name, value in values.items())


def _xyz(position: Floats) -> str:
    return _tags(dict(zip("xyz", position.tolist(), strict=True)))


def _written_photo(
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
    poses = [f"<Pose>{pose}</Pose>"] if pose else []
    return ["<Photo>", f"<Id>{photo}</Id>", f"<ImagePath>{escape(name)}</ImagePath>", *poses, "</Photo>"]


def _points(project: Project) -> list[str]:
    block = project.block
    images: list[list[str]] = [[] for _ in block.point_ids]
    for photo, point, x, y in pixel_rows(project):
        xy = f"<x>{x - CENTER!r}</x><y>{y - CENTER!r}</y>"
        images[point].append(f"<Measurement><PhotoId>{photo}</PhotoId>{xy}</Measurement>")
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
