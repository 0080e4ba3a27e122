"""Reader of Metashape camera XML: poses, references and markers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.agisoft import TITLE
from photogram.formats.builder import BlockBuilder
from photogram.formats.crs import GEOCENTRIC as EARTH
from photogram.formats.crs import GEOGRAPHIC
from photogram.formats.images import Y_DOWN, checked_rotation
from photogram.formats.models import chosen_model
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.xml_stream import Element, read_stream
from photogram.io.places import at_place, image_size, one_word, positive
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.words import Phrase, option_sd, phrase

LOCAL = "LOCAL_CS"
GEOCENTRIC = 1e6  # Distance from the origin (m) beyond which a world is geocentric
_TERMS = ("cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2")


class _Similarity(NamedTuple):
    """X_world = s R X_chunk + T."""

    rotation: Floats
    translation: Floats
    scale: float


def read(path: Path, options: ReadOptions) -> Project:
    """Read the first or the requested chunk of a document."""
    root = read_stream(path, {}, "document")
    block = BlockBuilder(path, TITLE)
    block.remarks_on_systems = False  # Metashape defines heights of its systems
    block.lacks.append(Phrase("read.ties"))
    chunks = [*root.all("chunk"), *_members(root, "chunks", "chunk")]
    names = [each.attributes.get("label", "?") for each in chunks]
    chunk = chunks[chosen_model(root, names, options.model, 0, block.messages)]
    _sensors(chunk, block)
    shots = _shots(chunk, block)
    markers = _members(chunk, "markers", "marker")
    system = _with_poses(chunk, shots, markers, block)
    accuracies = _accuracies(chunk, options)
    _gnss(block, shots, system, accuracies["gnss"])
    _markers(block, markers, system, accuracies["control"])
    _locations(chunk, block)
    return block.project()


def _accuracies(chunk: Element, options: ReadOptions) -> dict[str, Floats]:
    """Return default standard deviations of the user, else of the settings."""
    settings = _properties(_members(chunk, "settings", "property"), "accuracy_cameras", "accuracy_markers")
    return {
        kind: np.broadcast_to(options.sd.get(kind, (settings.get(f"accuracy_{name}", np.nan),)), 3)
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


def _sensors(chunk: Element, block: BlockBuilder) -> None:
    names: set[str] = set()
    for each in _members(chunk, "sensors", "sensor"):
        key = each.attributes.get("id", "")
        name = each.attributes.get("label") or f"sensor {key}"
        while name in names:
            name += "'"
        names.add(name)
        with at_place(each):
            block.camera(*_sensor(each, name, block.messages), key=key, place=each)
    if not block.cameras:
        raise chunk.error(phrase("format.missing", what="sensors"))


def _sensor(element: Element, name: str, messages: list[Message]) -> tuple[Camera, Size, float | None]:
    kind = element.attributes.get("type", "frame")
    one_word(element, "type of the sensor", kind, ("frame", "fisheye", "spherical"))
    resolution = element.need("resolution")
    width, height = resolution.attribute("width"), resolution.attribute("height")
    size = image_size(resolution, width, height)
    properties = _properties(element.all("property"), "pixel_width", "focal_length")
    pixel = properties.get("pixel_width") or None
    if kind == "spherical":
        return Camera("equirectangular", {"w": width, "h": height}, name=name), size, pixel
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
    return Camera(model, values, name=name), size, pixel


def _shots(chunk: Element, block: BlockBuilder) -> list[Element]:
    """Add cameras with a pose; the others are unusable."""
    found, lost = [], []
    for each in _members(chunk, "cameras", "camera"):
        label, key = each.attributes.get("label", ""), each.attributes.get("id")
        if not label or key is None:
            continue
        if each.child("transform") is None:
            lost.append(label)
            continue
        block.photo(key, each.attributes.get("sensor_id"), each, name=label)
        found.append(each)
    if lost:
        block.messages.append(Message(phrase("format.unposed", n=len(lost), names=lost)))
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
    scale = positive(element, "the scale", element.number("scale", 1.0))
    shift = element.child("translation")
    translation = np.zeros(3) if shift is None else shift.numbers(3)
    return _Similarity(checked_rotation(rotation, rotation.numbers(9).reshape(3, 3)), translation, scale)


def _with_poses(
    chunk: Element, shots: list[Element], markers: list[Element], block: BlockBuilder
) -> str | None:
    """Add poses, in a topocentric frame if they are geocentric.

    Returns the system of references; None if they cannot be transformed.
    """
    centres, matrices = _poses(chunk, shots)
    system = chunk.word("reference")
    given = [own[0] for each in (*shots, *markers) if (own := _reference(each, np.ones(3))) is not None]
    # A world is geocentric, judged by its size, its system or the range of its references.
    degrees = np.abs(np.array(given).reshape(-1, 3)[:, :2]) <= (360.0, 90.0)
    far = np.linalg.norm(centres.mean(axis=0)) >= GEOCENTRIC and not system.upper().startswith(LOCAL)
    geocentric = far and bool(system or degrees.all())
    for shot, centre, matrix in zip(shots, centres, matrices, strict=True):
        block.pose(shot.attributes["id"], centre, matrix, shot, crs=EARTH if geocentric else "")
    if geocentric:
        block.frame_amid(EARTH)
        if not system:
            block.messages.append(Message(phrase("agisoft.references")))
        return system or GEOGRAPHIC
    if not system or system.upper().startswith(LOCAL):
        return ""
    if given:
        block.messages.append(Message(phrase("agisoft.local", n=len(given))))
    return None


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


def _gnss(block: BlockBuilder, shots: list[Element], system: str | None, default: Floats) -> None:
    lost = 0
    for each in shots:
        reference = _reference(each, default)
        if system is None or reference is None or not _enabled(each):
            continue
        xyz, sd = reference
        if (sd > 0).all():
            block.gnss(each.attributes["id"], xyz, sd, each, crs=system)
        else:
            lost += 1
    if lost:
        block.lacks.append(Phrase("read.references", {"number": lost, "option": option_sd("gnss")}))


def _markers(block: BlockBuilder, markers: list[Element], system: str | None, default: Floats) -> None:
    for row, marker in enumerate(markers):
        key = marker.attributes.get("id", "")
        name = marker.attributes.get("label") or f"marker {row}"
        block.point(key, marker, name=name)
        reference = _reference(marker, default)
        if system is None or reference is None:
            continue
        xyz, sd = reference
        if not _enabled(marker):
            block.check(key, xyz, np.where(sd > 0, sd, np.nan), marker, crs=system)
        elif not (sd > 0).all():
            raise marker.error(phrase("format.sd", name=name, option=option_sd("control")))
        else:
            block.control(key, xyz, sd, marker, crs=system)


def _locations(chunk: Element, block: BlockBuilder) -> None:
    """Add manual measurements; predicted locations are not observations."""
    for frame in _members(chunk, "frames", "frame"):
        for marker in _members(frame, "markers", "marker"):
            point = marker.attributes.get("marker_id", "")
            for each in marker.all("location"):
                photo = each.attributes.get("camera_id", "")
                by_hand = all(each.attributes.get(name) != "false" for name in ("pinned", "valid"))
                if point in block.point_rows and photo in block.photo_rows and by_hand:
                    block.image(photo, point, each.attribute("x"), each.attribute("y"))
