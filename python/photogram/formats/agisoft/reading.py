"""Reader of Metashape camera XML: poses, references and markers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Floats, Indices
from photogram.formats.agisoft import TITLE
from photogram.formats.format import Wishes
from photogram.formats.images import Y_DOWN, checked_rotation
from photogram.formats.plain.tables import covariances_of
from photogram.formats.project import Frame, PointTable, Project, Size, assembled
from photogram.formats.xml_stream import Element, read_stream
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.network.observations import Observations, Position
from photogram.words import Phrase, option_sd, phrase

LOCAL = "LOCAL_CS"
GEOCENTRIC = 1e6  # Distance from the origin (m) beyond which a world is geocentric
_TERMS = ("cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2")


class _Sensor(NamedTuple):
    camera: Camera
    size: Size
    pixel: float | None


class _Similarity(NamedTuple):
    """X_world = s R X_chunk + T."""

    rotation: Floats
    translation: Floats
    scale: float


def read(path: Path, wishes: Wishes) -> Project:
    """Read the first or the requested chunk of a document."""
    root = read_stream(path, {}, "document")
    messages: list[Message] = []
    chunk = _chunk(root, wishes.model, messages)
    sensors = _sensors(chunk, messages)
    shots = _shots(chunk, sensors, messages)
    centres, matrices = _poses(chunk, shots)
    markers = {each.attributes.get("id", ""): each for each in _members(chunk, "markers", "marker")}
    frame, positions = _frame(chunk, centres, matrices, [*shots, *markers.values()], messages)
    given = _accuracies(chunk, wishes)
    names = [each.attributes["label"] for each in shots]
    observations, lacks = _gnss(positions, shots, names, given["gnss"])
    points = _markers(positions, list(markers.values()), given["control"])
    rows = {each.attributes["id"]: row for row, each in enumerate(shots)}
    photos, owners, xy = _locations(chunk, rows, {key: row for row, key in enumerate(markers)})
    order = {key: row for row, key in enumerate(sensors)}
    return assembled(
        path=path,
        title=TITLE,
        cameras=[each.camera for each in sensors.values()],
        sizes=[each.size for each in sensors.values()],
        pixel_mm=[each.pixel for each in sensors.values()],
        photo_ids=names,
        photo_cameras=[order[each.attributes["sensor_id"]] for each in shots],
        centres=centres,
        matrices=matrices,
        **points.arguments(),
        image_photos=photos,
        image_points=owners,
        image_xy=xy,
        observations=[*points.observations, observations],
        frame=frame,
        lacks=[Phrase("read.ties"), *lacks],
        messages=messages,
    )


def _chunk(root: Element, wanted: int | None, messages: list[Message]) -> Element:
    chunks, taken = [*root.all("chunk"), *_members(root, "chunks", "chunk")], wanted or 0
    if taken >= len(chunks):
        raise root.error(phrase("format.models", n=len(chunks), model=taken))
    if len(chunks) > 1:
        names = [each.attributes.get("label", "?") for each in chunks]
        messages.append(Message(phrase("format.model-chosen", n=len(chunks), names=names, model=taken)))
    return chunks[taken]


def _accuracies(chunk: Element, wishes: Wishes) -> dict[str, Floats]:
    """Return default standard deviations of the user, else of the settings."""
    settings = _properties(_members(chunk, "settings", "property"), "accuracy_cameras", "accuracy_markers")
    return {
        kind: np.broadcast_to(wishes.sd.get(kind, (settings.get(f"accuracy_{name}", np.nan),)), 3)
        for kind, name in (("gnss", "cameras"), ("control", "markers"))
    }


def _properties(elements: Iterable[Element], *names: str) -> dict[str, float]:
    own = ((each.attributes.get("name", ""), each) for each in elements)
    return {name: each.attribute("value") for name, each in own if name in names}


def _members(chunk: Element, folder: str, name: str) -> list[Element]:
    """Return the elements of a list, also within groups."""
    found = chunk.child(folder)
    if found is None:
        return []
    return [own for each in found.children for own in ([each] if each.name == name else each.all(name))]


def _sensors(chunk: Element, messages: list[Message]) -> dict[str, _Sensor]:
    found: dict[str, _Sensor] = {}
    names: set[str] = set()
    for each in _members(chunk, "sensors", "sensor"):
        key = each.attributes.get("id", "")
        name = each.attributes.get("label") or f"sensor {key}"
        while name in names:
            name += "'"
        names.add(name)
        with at_place(each):
            found[key] = _sensor(each, name, messages)
    if not found:
        raise chunk.error(phrase("format.missing", what="sensors"))
    return found


def _sensor(element: Element, name: str, messages: list[Message]) -> _Sensor:
    kind = element.attributes.get("type", "frame")
    resolution = element.need("resolution")
    width, height = resolution.attribute("width"), resolution.attribute("height")
    if not (0 < width < 2**31 and 0 < height < 2**31 and width == int(width) and height == int(height)):
        raise resolution.error(phrase("format.size", width=width, height=height))
    size = int(width), int(height)
    properties = _properties(element.all("property"), "pixel_width", "focal_length")
    pixel = properties.get("pixel_width") or None
    if kind == "spherical":
        return _Sensor(Camera("equirectangular", {"w": width, "h": height}, name=name), size, pixel)
    if kind not in ("frame", "fisheye"):
        raise element.error(
            phrase(
                "format.unknown",
                what="type of the sensor",
                value=kind,
                names=["frame", "fisheye", "spherical"],
            )
        )
    by_class = {each.attributes.get("class", ""): each for each in element.all("calibration")}
    calibration = by_class.get("adjusted") or by_class.get("initial")
    values = {"w": width, "h": height}
    if calibration is None:
        if not pixel or "focal_length" not in properties:
            raise element.error(phrase("agisoft.calibration"))
        values["f"] = properties["focal_length"] / pixel
    elif calibration.child("fx") is not None:
        fx, fy = calibration.number("fx"), calibration.number("fy")
        values |= {term: calibration.number(term, 0.0) for term in ("k1", "k2", "k3", "k4", "p1", "p2")}
        values |= {"f": fy, "b1": fx - fy, "b2": calibration.number("skew", 0.0)}
        values |= {"cx": calibration.number("cx") - width / 2, "cy": calibration.number("cy") - height / 2}
        if values["p1"] or values["p2"]:
            messages.append(Message(phrase("agisoft.exchanged", camera=name)))
    else:
        values |= {"f": calibration.number("f")} | {term: calibration.number(term, 0.0) for term in _TERMS}
    model = f"agisoft_{kind}"
    further = {term: 0.0 if calibration is None else calibration.number(term, 0.0) for term in ("p3", "p4")}
    if any(further.values()):
        model, values = f"{model}_p4", values | further
    return _Sensor(Camera(model, values, name=name), size, pixel)


def _shots(chunk: Element, sensors: dict[str, _Sensor], messages: list[Message]) -> list[Element]:
    """Return cameras with a pose; the others are unusable."""
    found, lost, seen = [], [], set()
    for each in _members(chunk, "cameras", "camera"):
        label = each.attributes.get("label", "")
        if not label or "id" not in each.attributes:
            continue
        if each.attributes.get("sensor_id") not in sensors:
            raise each.error(
                phrase("format.undefined", what="sensor", name=each.attributes.get("sensor_id", ""))
            )
        if each.child("transform") is None:
            lost.append(label)
            continue
        if label in seen or not label.isprintable() or not label.strip():
            raise each.error(phrase("format.name", what="camera", name=label))
        seen.add(label)
        found.append(each)
    if lost:
        messages.append(Message(phrase("format.unposed", n=len(lost), names=lost)))
    if not found:
        raise chunk.error(phrase("format.missing", what="aligned cameras"))
    return found


def _poses(chunk: Element, shots: list[Element]) -> tuple[Floats, Floats]:
    """Return centres and attitudes in the world."""
    whole = _similarity(chunk.child("transform")) or _Similarity(np.eye(3), np.zeros(3), 1.0)
    components = {
        each.attributes.get("id"): _similarity(each.child("transform"))
        for each in _members(chunk, "components", "component")
    }
    centres, matrices = np.empty((len(shots), 3)), np.empty((len(shots), 3, 3))
    for row, each in enumerate(shots):
        transform = each.need("transform")
        values = transform.numbers(16).reshape(4, 4)
        turn = checked_rotation(transform, values[:3, :3])
        similarity = components.get(each.attributes.get("component_id")) or whole
        matrices[row] = similarity.rotation @ turn @ Y_DOWN
        centres[row] = similarity.scale * similarity.rotation @ values[:3, 3] + similarity.translation
    return centres, matrices


def _similarity(element: Element | None) -> _Similarity | None:
    """Return the similarity of a transform; None without a rotation."""
    rotation = None if element is None else element.child("rotation")
    if element is None or rotation is None:
        return None
    scale = element.number("scale", 1.0)
    if not scale > 0:
        raise element.error(phrase("format.positive", name="the scale", value=scale))
    shift = element.child("translation")
    translation = np.zeros(3) if shift is None else shift.numbers(3)
    return _Similarity(checked_rotation(rotation, rotation.numbers(9).reshape(3, 3)), translation, scale)


@dataclass
class _Positions:
    """Transformation of references into the frame; `known` is False if none exists."""

    frame: Frame
    crs: str
    known: bool = True

    def reference(self, element: Element, default: Floats) -> tuple[Floats, Floats] | None:
        """Return a reference with standard deviations; None if it is unusable."""
        return _reference(element, default) if self.known else None

    def carried(self, xyz: Floats, sd: Floats) -> tuple[Floats, Floats]:
        """Return positions and covariances in the frame."""
        covariances = covariances_of(sd)
        if self.frame.kind == "cartesian" or not len(xyz):
            return xyz, covariances
        from photogram.formats.crs import to_frame

        found, turned, _ = to_frame(self.crs, xyz, covariances, self.frame)
        return found, turned


def _is_geocentric(reference: str, centres: Floats, references: Floats) -> bool:
    """Return whether a world is geocentric, judged by size and references."""
    if np.linalg.norm(centres.mean(axis=0)) < GEOCENTRIC or reference.upper().startswith(LOCAL):
        return False
    return bool(reference or (np.abs(references[:, :2]) <= (360.0, 90.0)).all())


def _frame(
    chunk: Element, centres: Floats, matrices: Floats, marked: list[Element], messages: list[Message]
) -> tuple[Frame, _Positions]:
    """Transform poses from geocentric axes into a topocentric frame, in place."""
    reference = chunk.word("reference")
    given = [own[0] for each in marked if (own := _reference(each, np.ones(3))) is not None]
    if not _is_geocentric(reference, centres, np.array(given).reshape(-1, 3)):
        frame = Frame()
        known = not reference or reference.upper().startswith(LOCAL)
        if given and not known:
            messages.append(Message(phrase("agisoft.local", n=len(given))))
        return frame, _Positions(frame, "", known)
    from photogram.formats.crs import GEOCENTRIC as EARTH
    from photogram.formats.crs import GEOGRAPHIC, amid, to_frame, turn_to_frame

    frame = Frame("topocentric", "EPSG:4979", amid(EARTH, centres))
    matrices[:] = turn_to_frame(EARTH, centres, frame) @ matrices
    centres[:] = to_frame(EARTH, centres, np.zeros((len(centres), 3, 3)), frame)[0]
    messages.append(Message(phrase("format.frame", crs=EARTH, frame=frame.phrase)))
    if not reference:
        messages.append(Message(phrase("agisoft.references")))
    return frame, _Positions(frame, reference or GEOGRAPHIC)


def _reference(element: Element, default: Floats) -> tuple[Floats, Floats] | None:
    """Return a reference and its standard deviations; None if missing."""
    own = element.child("reference")
    if own is None or any(axis not in own.attributes for axis in "xyz"):
        return None
    position = np.array([own.attribute(axis) for axis in "xyz"])
    sd = default.copy()
    # One for all axes, one for both horizontal coordinates, or one for each: the most detailed one is used.
    for name, axes in (("sxyz", 3), ("sxy", 2)):
        if name in own.attributes:
            sd[:axes] = own.attribute(name)
    return position, np.array([own.attribute(f"s{axis}", float(sd[k])) for k, axis in enumerate("xyz")])


def _enabled(element: Element) -> bool:
    own = element.child("reference")
    return own is not None and own.attributes.get("enabled", "true").lower() not in ("false", "0")


def _gnss(
    positions: _Positions, shots: list[Element], names: list[str], default: Floats
) -> tuple[Observations[Position], list[Phrase]]:
    given = {
        row: own
        for row, each in enumerate(shots)
        if _enabled(each) and (own := positions.reference(each, default)) is not None
    }
    known = {row: own for row, own in given.items() if (own[1] > 0).all()}
    lost = len(given) - len(known)
    lacks = [Phrase("read.references", {"number": lost, "option": option_sd("gnss")})] if lost else []
    if not known:
        return Observations(), lacks
    xyz, sd = map(np.array, zip(*known.values(), strict=True))
    found, turned = positions.carried(xyz, sd)
    covariances = (turned + turned.transpose(0, 2, 1)) / 2
    photos = [names[row] for row in known]
    return Position.from_arrays(photo=photos, position=found, covariance=covariances), lacks


def _markers(positions: _Positions, markers: list[Element], default: Floats) -> PointTable:
    names = [each.attributes.get("label") or f"marker {row}" for row, each in enumerate(markers)]
    points = PointTable(names)
    for row, (name, marker) in enumerate(zip(names, markers, strict=True)):
        if name in names[:row] or not name.isprintable() or not name.strip():
            raise marker.error(phrase("format.name", what="marker", name=name))
        reference = positions.reference(marker, default)
        if reference is None:
            continue
        [xyz], [covariance] = positions.carried(
            reference[0][np.newaxis], np.nan_to_num(reference[1])[np.newaxis]
        )
        if not _enabled(marker):
            points.check(row, xyz, np.where(reference[1] > 0, np.diag(covariance), 0.0))
        elif not (reference[1] > 0).all():
            raise marker.error(phrase("format.sd", name=name, option=option_sd("control")))
        elif not is_covariance(covariance) and (covariance != np.diag(np.diag(covariance))).any():
            raise marker.error(phrase("agisoft.accuracy", name=name))
        else:
            points.control(row, xyz, covariance)
    return points


def _locations(
    chunk: Element, rows: dict[str, int], markers: dict[str, int]
) -> tuple[Indices, Indices, Floats]:
    """Return manual measurements; predicted locations are not observations."""
    photos, points, xy = [], [], []
    for frame in _members(chunk, "frames", "frame"):
        for marker in _members(frame, "markers", "marker"):
            point = markers.get(marker.attributes.get("marker_id", ""))
            for each in marker.all("location"):
                photo = rows.get(each.attributes.get("camera_id", ""))
                by_hand = all(each.attributes.get(name) != "false" for name in ("pinned", "valid"))
                if point is None or photo is None or not by_hand:
                    continue
                photos.append(photo)
                points.append(point)
                xy.append((each.attribute("x"), each.attribute("y")))
    return np.array(photos, dtype=np.int64), np.array(points, dtype=np.int64), np.reshape(xy, (-1, 2))
