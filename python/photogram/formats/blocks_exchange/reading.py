"""Reader of BlocksExchange XML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.blocks_exchange import TITLE
from photogram.formats.format import Wishes
from photogram.formats.images import checked_rotation
from photogram.formats.plain.tables import covariances_of
from photogram.formats.project import Frame, PointTable, Project, Size, assembled
from photogram.formats.self_check import agreement
from photogram.formats.xml_stream import Element, read_stream
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.network.observations import Observation, Position
from photogram.words import Phrase, option_sd, phrase

LOCAL = "local"


@dataclass
class PhotoRecord:
    """A photo of a file: its pose (y up, z back) and the ids of its systems."""

    path: str
    group: int
    centre: Floats
    rotation: Floats
    srs: str
    gnss: Floats | None
    gnss_srs: str
    place: Element


@dataclass
class PointRecord:
    """A point of a file, with standard deviations unless it is a tie point."""

    name: str
    place: Element
    position: Floats
    srs: str
    sd: Floats | None = None
    check: bool = False


class Systems:
    """Positions in the systems of a file, transformed into one cartesian frame."""

    def __init__(
        self, systems: Mapping[str, str], srs: str, photos: list[PhotoRecord], messages: list[Message]
    ) -> None:
        self.systems, self.main, self.messages = systems, srs, messages
        self.lacks: list[Phrase] = []
        definition = self.definition(srs or (photos[0].srs if photos else ""))
        self.frame = Frame()
        if definition != LOCAL:
            from photogram.formats.crs import amid, enu_origin

            own = enu_origin(definition)
            if own is not None:
                self.frame = Frame("topocentric", "EPSG:4979", own)
            else:
                centres = np.array([each.centre for each in photos])
                known = centres[np.isfinite(centres).all(axis=1)]
                if not len(known):
                    raise InputError(
                        phrase("blocks-exchange.centres", crs=definition), file=photos[0].place.file
                    )
                self.frame = Frame("topocentric", "EPSG:4979", amid(definition, known))
                messages.append(Message(phrase("format.frame", crs=definition, frame=self.frame.phrase)))
        self.same = definition

    def definition(self, srs: str) -> str:
        """Return the definition of an id for PROJ or this reader, or `local`."""
        text = self.systems.get(srs or self.main, "").strip()
        return LOCAL if not text or text.upper().startswith("LOCAL_CS") else text

    def _carried(self, srs: str, xyz: Floats, covariances: Floats) -> tuple[Floats, Floats]:
        definition = self.definition(srs)
        if definition == self.same and (definition == LOCAL or definition.upper().startswith("ENU:")):
            return xyz, covariances
        if LOCAL in (definition, self.same):
            raise InputError(phrase("blocks-exchange.systems", crs=definition, frame=self.same))
        from photogram.formats.crs import to_frame

        found, turned, remarks = to_frame(definition, xyz, covariances, self.frame)
        known = {message.phrase for message in self.messages}
        self.messages += [Message(remark) for remark in remarks if remark not in known]
        return found, turned

    def poses(self, photos: list[PhotoRecord], centres: Floats, matrices: Floats) -> tuple[Floats, Floats]:
        """Transform centres and attitudes, which refer to local axes, into the frame."""
        centres, matrices = centres.copy(), matrices.copy()
        for srs in dict.fromkeys(each.srs for each in photos):
            definition = self.definition(srs)
            own = np.array([each.srs == srs for each in photos]) & np.isfinite(centres).all(axis=1)
            if not own.any() or definition == LOCAL or definition.upper().startswith("ENU:"):
                continue
            from photogram.formats.crs import turn_to_frame

            matrices[own] = turn_to_frame(definition, centres[own], self.frame) @ matrices[own]
            centres[own] = self._carried(srs, centres[own], np.zeros((int(own.sum()), 3, 3)))[0]
        return centres, matrices

    def points(self, records: list[PointRecord], names: list[str]) -> PointTable:
        """Return the points, with control and check points."""
        points = PointTable(names)
        for srs in dict.fromkeys(record.srs for record in records):
            rows = [row for row, record in enumerate(records) if record.srs == srs]
            own = [records[row] for row in rows]
            xyz = np.array([record.position for record in own])
            whole = np.isfinite(xyz).all(axis=1)
            local = self.definition(srs) == self.same and self.frame.kind == "cartesian"
            for record, complete in zip(own, whole, strict=True):
                if not local and record.sd is not None and not complete:
                    raise record.place.error(phrase("blocks-exchange.part"))
            sd = np.array([np.zeros(3) if record.sd is None else record.sd for record in own])
            covariances = covariances_of(np.nan_to_num(sd))
            if whole.any():
                xyz[whole], covariances[whole] = self._carried(srs, xyz[whole], covariances[whole])
            for row, record, position, covariance in zip(rows, own, xyz, covariances, strict=True):
                if record.sd is None:
                    points.starts[row] = position
                elif record.check:
                    points.check(row, position, np.diag(covariance))
                else:
                    points.control(row, position, covariance)
        return points

    def gnss(self, photos: list[PhotoRecord], names: list[str], wishes: Wishes) -> list[Observation]:
        """Return photo positions as observations, if they have standard deviations."""
        rows = [row for row, each in enumerate(photos) if each.gnss is not None]
        if not rows:
            return []
        if "gnss" not in wishes.sd:
            self.lacks.append(Phrase("read.gnss", {"number": len(rows), "option": option_sd("gnss")}))
            return []
        sd = np.broadcast_to(wishes.sd["gnss"], 3)
        found: list[Observation] = []
        lost = []
        for row in rows:
            position = photos[row].gnss
            assert position is not None
            try:
                own, turned = self._carried(
                    photos[row].gnss_srs, position[np.newaxis], np.diag(sd**2)[np.newaxis]
                )
            except InputError:
                lost.append(names[row])
                continue
            found.append(Position(names[row], own[0], covariance=(turned[0] + turned[0].T) / 2))
        if lost:
            self.messages.append(Message(phrase("blocks-exchange.gnss", n=len(lost), names=lost)))
        return found


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
_TERMS = ("K1", "K2", "K3", "P1", "P2")
_READINGS: Mapping[str, Callable[[Mapping[str, float]], Mapping[str, float]]] = {
    "P1 and P2 exchanged": lambda own: {"p1": own["p2"], "p2": own["p1"]},
    "K1, K2, K3 with the other sign": lambda own: {name: -own[name] for name in ("k1", "k2", "k3")},
}
"""Alternative definitions of the distortion terms in other programs."""
BETTER, NOTICED = 3.0, 0.1
"""Ratio of agreement for another definition that rejects a file, and the smallest median for it."""


@dataclass
class _Group:
    """Photos of one camera."""

    camera: Camera
    size: Size
    axes: Floats
    pixel: float | None


@dataclass
class _Found:
    """Contents of a file in the order of reading."""

    wishes: Wishes
    systems: dict[str, str] = field(default_factory=dict)
    blocks: list[str] = field(default_factory=list)
    groups: list[_Group] = field(default_factory=list)
    photos: dict[int, PhotoRecord] = field(default_factory=dict)
    points: list[PointRecord] = field(default_factory=list)
    images: list[tuple[int, int, float, float, bool]] = field(default_factory=list)
    """Photo id, point, x, y, and whether these are millimetres from the principal point."""
    measured: list[Element] = field(default_factory=list)


def read(path: Path, wishes: Wishes) -> Project:
    """Read a file with one block."""
    found = _Found(wishes)
    take: dict[str, Callable[[Element], None]] = {
        "SRS": lambda own: found.systems.__setitem__(own.word("Id"), own.word("Definition")),
        "Photogroup": partial(_group, found),
        "ControlPoint": partial(_control, found),
        "TiePoint": partial(_tie, found),
    }
    root = read_stream(path, take, "BlocksExchange")
    block = root.child("Block")
    if len(list(root.all("Block"))) > 1:
        raise root.error(phrase("blocks-exchange.blocks"))
    if block is None or not found.photos:
        raise root.error(phrase("format.missing", what="a block with photos"))
    return _checked(_project(path, found, block.word("SRSId")))


def _group(found: _Found, element: Element) -> None:
    dimensions = element.need("ImageDimensions")
    size = dimensions.whole("Width"), dimensions.whole("Height")
    if not (0 < size[0] < 2**31 and 0 < size[1] < 2**31):
        raise dimensions.error(phrase("format.size", width=size[0], height=size[1]))
    kind = element.word("CameraModelType", "Perspective")
    if kind != "Perspective":
        raise element.error(
            phrase("format.unknown", what="CameraModelType", value=kind, names=["Perspective"])
        )
    orientation = element.word("CameraOrientation", "XRightYDown")
    if orientation not in ORIENTATIONS:
        raise element.error(
            phrase("format.unknown", what="CameraOrientation", value=orientation, names=list(ORIENTATIONS))
        )
    axes = np.array(ORIENTATIONS[orientation], dtype=float)
    pixel = _pixel(element, size)
    name = f"{element.word('Name') or 'camera'} {len(found.groups) + 1}"
    with at_place(element):
        camera = _camera(element, size, axes, pixel, name)
    found.groups.append(_Group(camera, size, axes, pixel))
    srs = element.word("SRSId")
    for photo in element.all("Photo"):
        _photo(found, photo, srs)


def _pixel(element: Element, size: Size) -> float | None:
    """Return the side of a pixel in millimetres."""
    if element.child("PixelSize") is not None:
        pixel = element.number("PixelSize")
    elif element.child("SensorSize") is not None:
        pixel = element.number("SensorSize") / max(size)
    else:
        return None
    if not pixel > 0:
        raise element.error(phrase("format.positive", name="the size of the sensor", value=pixel))
    return pixel


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
    terms = _terms(element)
    fy, skew = f * element.number("AspectRatio", 1.0), element.number("Skew", 0.0)
    if skew:
        offsets = {"cx": cx - size[0] / 2, "cy": cy - size[1] / 2, "w": float(size[0]), "h": float(size[1])}
        own = {term.lower(): value for term, value in terms.items()}
        return Camera("agisoft_frame", {"f": fy, "b1": f - fy, "b2": skew, **offsets, **own}, name=name)
    # P1 is the coefficient of r^2 + 2 x^2 in x, which OpenCV calls p2.
    own = {term: terms[theirs] for term, theirs in zip(("k1", "k2", "k3", "p2", "p1"), _TERMS, strict=True)}
    return Camera("full_opencv", {"fx": f, "fy": fy, "cx": float(cx), "cy": float(cy), **own}, name=name)


def _terms(element: Element) -> dict[str, float]:
    found = dict.fromkeys(_TERMS, 0.0)
    distortion = element.child("Distortion")
    if distortion is None:
        return found
    for each in distortion.children:
        if each.name in _TERMS:
            found[each.name] = each.value
        elif each.text.strip() not in ("", "0", "0.0", "false"):
            raise each.error(
                phrase("format.unknown", what="term of the distortion", value=each.name, names=list(_TERMS))
            )
    return found


def _photo(found: _Found, element: Element, srs: str) -> None:
    number = element.whole("Id")
    if number in found.photos:
        raise element.error(phrase("format.repeated", what="photo", name=str(number)))
    pose = element.child("Pose")
    unknown = np.full(3, np.nan)
    centre, rotation, gnss, gnss_srs = unknown, np.full((3, 3), np.nan), None, srs
    if pose is not None:
        own = pose.child("Center")
        if own is not None:
            centre, srs = _position(own), own.word("SRSId") or srs
        turn = pose.child("Rotation")
        if turn is not None:
            rotation = found.groups[-1].axes.T @ _rotation(turn)
        metadata = pose.child("Metadata")
        if metadata is not None and metadata.child("Center") is not None:
            gnss, gnss_srs = _position(metadata.need("Center")), metadata.word("SRSId") or srs
    path = element.word("ImagePath")
    if not path:
        raise element.error(phrase("format.member", name="ImagePath"))
    group = len(found.groups) - 1
    found.photos[number] = PhotoRecord(path, group, centre, rotation, srs, gnss, gnss_srs, element)


def _position(element: Element) -> Floats:
    return np.array([element.number(axis) for axis in "xyz"])


def _rotation(element: Element) -> Floats:
    """Return (3, 3) world to camera, in the axes of the camera orientation."""
    if element.child("M_00") is not None:
        matrix = np.array([[element.number(f"M_{i}{j}") for j in range(3)] for i in range(3)])
        return checked_rotation(element, matrix)
    if element.child("Omega") is not None:
        angles = np.radians([[element.number(name) for name in ("Omega", "Phi", "Kappa")]])
        if (most := np.abs(angles).max()) > 1e4:
            raise element.error(phrase("format.angles", most=1e4, unit="rad", value=float(most)))
        found: Floats = Attitudes.of("omega_phi_kappa", angles).values("matrix_to_photo")[0]
        return found
    raise element.error(phrase("blocks-exchange.rotation"))


def _control(found: _Found, element: Element) -> None:
    name = element.word("Name") or f"control {len(found.points) + 1}"
    category = element.word("Category", "Full")
    given = element.need("Position")
    position = np.array([np.nan if given.child(axis) is None else given.number(axis) for axis in "xyz"])
    if category == "Horizontal":
        position[2] = np.nan
    elif category == "Vertical":
        position[:2] = np.nan
    elif category != "Full":
        raise element.error(
            phrase(
                "format.unknown", what="Category", value=category, names=["Full", "Horizontal", "Vertical"]
            )
        )
    default = np.broadcast_to(found.wishes.sd.get("control", (np.nan,)), 3)
    horizontal = element.number("HorizontalAccuracy", float(default[0]))
    sd = np.array([horizontal, horizontal, element.number("VerticalAccuracy", float(default[2]))])
    check = element.word("CheckPoint").lower() in ("true", "1")
    if not check and not (sd[~np.isnan(position)] > 0).all():
        raise element.error(phrase("format.sd", name=name, option=option_sd("control")))
    found.points.append(PointRecord(name, element, position, element.word("SRSId"), sd, check))
    _measurements(found, element)


def _tie(found: _Found, element: Element) -> None:
    given = element.child("Position")
    position = np.full(3, np.nan) if given is None else _position(given)
    name = element.word("Name") or f"tie {len(found.points) + 1}"
    found.points.append(PointRecord(name, element, position, element.word("SRSId")))
    _measurements(found, element)


def _measurements(found: _Found, element: Element) -> None:
    point = len(found.points) - 1
    for each in element.all("Measurement"):
        millimetres = each.child("xmm") is not None
        x, y = (each.number(name) for name in (("xmm", "ymm") if millimetres else ("x", "y")))
        found.images.append((each.whole("PhotoId"), point, x, y, millimetres))
        found.measured.append(each)


def _project(path: Path, found: _Found, srs: str) -> Project:
    messages: list[Message] = []
    photos = list(found.photos.values())
    rows = {number: row for row, number in enumerate(found.photos)}
    frames = Systems(found.systems, srs, photos, messages)
    centres = np.array([each.centre for each in photos])
    matrices = np.array([each.rotation.T for each in photos])
    centres, matrices = frames.poses(photos, centres, matrices)
    images = [each for each in found.images if each[0] in rows]
    if lost := len(found.images) - len(images):
        messages.append(Message(phrase("format.unknown-images", n=lost)))
    names = [each.path.replace("\\", "/").rsplit("/", 1)[-1] for each in photos]
    if len(set(names)) < len(names):
        names = [each.path for each in photos]
    for name, photo in zip(names, photos, strict=True):
        if not name.strip() or not name.isprintable():
            raise photo.place.error(phrase("format.name", what="ImagePath", name=name))
    points = frames.points(found.points, _names(found))
    of_photo = np.array([each.group for each in photos], dtype=np.int64)
    image_photos = np.array([rows[each[0]] for each in images], dtype=np.int64)
    return assembled(
        path=path,
        title=TITLE,
        cameras=[each.camera for each in found.groups],
        sizes=[each.size for each in found.groups],
        pixel_mm=[each.pixel for each in found.groups],
        photo_ids=names,
        photo_cameras=of_photo,
        centres=centres,
        matrices=matrices,
        **points.arguments(),
        image_photos=image_photos,
        image_points=np.array([each[1] for each in images], dtype=np.int64),
        image_xy=_corner(found, images, of_photo[image_photos]),
        observations=[*points.observations, *frames.gnss(photos, names, found.wishes)],
        frame=frames.frame,
        lacks=frames.lacks,
        messages=messages,
    )


def _names(found: _Found) -> list[str]:
    names: list[str] = []
    taken: set[str] = set()
    for each in found.points:
        name = each.name
        while name in taken:
            if each.sd is not None:
                raise each.place.error(phrase("format.repeated", what="control point", name=name))
            name += "'"
        if not name.strip() or not name.isprintable():
            raise each.place.error(phrase("format.name", what="point", name=name))
        taken.add(name)
        names.append(name)
    return names


def _corner(found: _Found, images: list[tuple[int, int, float, float, bool]], groups: Any) -> Floats:
    """Return (m, 2) columns and rows from the corner."""
    xy = np.array([each[2:4] for each in images], dtype=float).reshape(-1, 2)
    millimetres = np.array([each[4] for each in images], dtype=bool)
    corner = xy + CENTER
    for row, group in enumerate(found.groups):
        own = millimetres & (groups == row)
        if not own.any():
            continue
        if group.pixel is None:
            raise found.measured[0].error(phrase("format.sensor-size"))
        right, up = (xy[own] @ group.axes[:2, :2] / group.pixel).T
        values = group.camera.parameters
        cx, cy = values["cx"], values["cy"]
        if group.camera.model == "agisoft_frame":
            cx, cy = cx + group.size[0] / 2, cy + group.size[1] / 2
        corner[own] = np.column_stack([cx + right, cy - up])
    return corner


def _checked(project: Project) -> Project:
    """Reject a file whose distortion terms fit better under another definition."""
    as_read = agreement(project).median
    if not as_read > NOTICED:
        return project
    for name, change in _READINGS.items():
        cameras = [
            each.replace(parameters={**each.parameters, **change(each.parameters)})
            for each in project.block.cameras
        ]
        other = agreement(project.replace(block=project.block.replace(cameras=cameras))).median
        if other * BETTER < as_read:
            raise InputError(
                phrase("blocks-exchange.distortion", as_read=as_read, other=other, reading=name),
                file=project.path,
            )
    return project
