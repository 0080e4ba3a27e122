"""Metashape camera XML, read and written: sensors, poses, references, markers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.crs import GEOCENTRIC as EARTH
from photogram.formats.crs import GEOGRAPHIC, east_north_up, from_frame
from photogram.formats.format import FORMATS
from photogram.formats.images import Y_DOWN, checked_rotation, known_size, lens_with, pixel_rows
from photogram.formats.models import KnownPoints, attitude_matrices, chosen_model, known_cameras, known_points
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.xml_stream import Element, read_stream
from photogram.io.places import at_place, image_size, one_word, positive
from photogram.messages import Message
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.geometry import Frame
from photogram.network.observations import Position
from photogram.words import Phrase, option_sd, phrase

LOCAL = "LOCAL_CS"
GEOCENTRIC = 1e6  # Distance from the origin (m) beyond which a world is geocentric
_TERMS = ("f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4")
_Similarity = tuple[Floats, Floats, float]  # R, T, s of X_world = s R X_chunk + T


def read(path: Path, options: ReadOptions) -> Project:
    """Read the first or the requested chunk of a document."""
    root = read_stream(path, {}, "document")
    block = BlockBuilder(path, FORMATS["agisoft"].title)
    block.remarks_on_systems = False  # Metashape defines heights of its systems
    block.lacks.append(Phrase("read.ties"))
    chunks = [*root.all("chunk"), *_members(root, "chunks", "chunk")]
    labels = [each.attributes.get("label", "?") for each in chunks]
    chunk = chunks[chosen_model(root, labels, options.model, 0, block.messages)]
    names = list[str]()
    for each in _members(chunk, "sensors", "sensor"):
        key = each.attributes.get("id", "")
        name = each.attributes.get("label") or f"sensor {key}"
        while name in names:
            name += "'"
        names.append(name)
        with at_place(each):
            block.camera(*_sensor(each, name, block.messages), key=key, place=each)
    if not names:
        raise chunk.error(phrase("format.missing", what="sensors"))
    shots = _shots(chunk, block)
    markers = _members(chunk, "markers", "marker")
    system = _with_poses(chunk, shots, markers, block)
    settings = _properties(_members(chunk, "settings", "property"), "accuracy_cameras", "accuracy_markers")
    gnss_sd, control_sd = (
        np.broadcast_to(options.sd.get(kind, (settings.get(f"accuracy_{name}", np.nan),)), 3)
        for kind, name in (("gnss", "cameras"), ("control", "markers"))
    )
    lost = 0
    for shot in shots if system is not None else ():
        xyz, sd, enabled = _reference(shot, gnss_sd)
        if enabled and (sd > 0).all():
            block.gnss(shot.attributes["id"], xyz, sd, shot, crs=system or "")
        lost += enabled and not (sd > 0).all()
    if lost:
        block.lacks.append(Phrase("read.references", {"number": lost, "option": option_sd("gnss")}))
    _markers(chunk, block, markers, system, control_sd)
    return block.project()


def _properties(elements: Iterable[Element], *names: str) -> dict[str, float]:
    own = ((each.attributes.get("name", ""), each) for each in elements)
    return {name: each.attribute("value") for name, each in own if name in names}


def _members(chunk: Element, folder: str, name: str) -> list[Element]:
    """Return the elements of a list, also within groups."""
    found = chunk.child(folder)
    if found is None:
        return []
    return [own for each in found.children for own in ([each] if each.name == name else each.all(name))]


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
    else:
        values |= {term: calibration.number(term, 0.0) for term in _TERMS[1:]}
        if calibration.child("fx") is None:
            values["f"] = calibration.number("f")
        else:
            fx, fy = calibration.number("fx"), calibration.number("fy")
            values |= {"f": fy, "b1": fx - fy, "b2": calibration.number("skew", 0.0)}
            values["cx"] = calibration.number("cx") - width / 2
            values["cy"] = calibration.number("cy") - height / 2
            if values["p1"] or values["p2"]:
                messages.append(Message(phrase("agisoft.exchanged", camera=name)))
    model, further = f"agisoft_{kind}", [values.pop(term, 0.0) for term in _TERMS[-2:]]
    if any(further):
        model, values = f"{model}_p4", values | dict(zip(_TERMS[-2:], further, strict=True))
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


def _similarity(element: Element | None) -> _Similarity | None:
    rotation = None if element is None else element.child("rotation")
    if element is None or rotation is None:
        return None
    scale = positive(element, "the scale", element.number("scale", 1.0))
    shift = element.child("translation")
    translation = np.zeros(3) if shift is None else shift.numbers(3)
    return checked_rotation(rotation, rotation.numbers(9).reshape(3, 3)), translation, scale


def _with_poses(
    chunk: Element, shots: list[Element], markers: list[Element], block: BlockBuilder
) -> str | None:
    """Add poses, in a topocentric frame if they are geocentric.

    Returns the system of references; None if they cannot be transformed.
    """
    whole = _similarity(chunk.child("transform")) or (np.eye(3), np.zeros(3), 1.0)
    parts = _members(chunk, "components", "component")
    components = {each.attributes.get("id"): _similarity(each.child("transform")) for each in parts}
    centres, matrices = np.empty((len(shots), 3)), np.empty((len(shots), 3, 3))
    for row, each in enumerate(shots):
        transform = each.need("transform")
        values = transform.numbers(16).reshape(4, 4)
        turn = checked_rotation(transform, values[:3, :3])
        rotation, translation, scale = components.get(each.attributes.get("component_id")) or whole
        matrices[row] = rotation @ turn @ Y_DOWN
        centres[row] = scale * rotation @ values[:3, 3] + translation
    system = chunk.word("reference")
    given = [own for each in (*shots, *markers) if not np.isnan(own := _reference(each, np.ones(3))[0]).any()]
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


def _reference(element: Element, default: Floats) -> tuple[Floats, Floats, bool]:
    """Return position (NaN if missing), standard deviations (0 or NaN if unknown), and whether it is used."""
    own = element.child("reference")
    if own is None or any(axis not in own.attributes for axis in "xyz"):
        return np.full(3, np.nan), default, False
    position = np.array([own.attribute(axis) for axis in "xyz"])
    sd = default.copy()
    # One for all axes, one for both horizontal coordinates, or one for each: the most detailed one is used.
    for name, axes in (("sxyz", 3), ("sxy", 2)):
        if name in own.attributes:
            sd[:axes] = own.attribute(name)
    sd = np.array([own.attribute(f"s{axis}", float(sd[k])) for k, axis in enumerate("xyz")])
    return position, sd, own.attributes.get("enabled", "true").lower() not in ("false", "0")


def _markers(
    chunk: Element, block: BlockBuilder, markers: list[Element], system: str | None, default: Floats
) -> None:
    """Add markers, and their manual measurements; predicted locations are not observations."""
    for row, marker in enumerate(markers):
        key = marker.attributes.get("id", "")
        name = marker.attributes.get("label") or f"marker {row}"
        block.point(key, marker, name=name)
        xyz, sd, enabled = _reference(marker, default)
        if system is None or np.isnan(xyz).any():
            continue
        if not enabled:
            block.control(key, xyz, np.where(sd > 0, sd, np.nan), marker, crs=system, check=True)
        elif not (sd > 0).all():
            raise marker.error(phrase("format.sd", name=name, option=option_sd("control")))
        else:
            block.control(key, xyz, sd, marker, crs=system)
    for frame in _members(chunk, "frames", "frame"):
        for marker in _members(frame, "markers", "marker"):
            point = marker.attributes.get("marker_id", "")
            for each in marker.all("location"):
                photo = each.attributes.get("camera_id", "")
                by_hand = all(each.attributes.get(name) != "false" for name in ("pinned", "valid"))
                if point in block.point_rows and photo in block.photo_rows and by_hand:
                    block.image(photo, point, each.attribute("x"), each.attribute("y"))


_METRE = 'UNIT["metre",1,AUTHORITY["EPSG","9001"]]'
LOCAL_SYSTEM = f'LOCAL_CS["Local Coordinates (m)",LOCAL_DATUM["Local Datum",0],{_METRE}]'


def cannot_hold(project: Project) -> list[Phrase]:
    """Return images of tie points, incomplete control, and digits of the earth."""
    block, known = project.block, known_points(project)
    marked = np.isin(np.arange(len(block.point_ids)), np.array(known.rows, dtype=int)[_complete(known)])
    partial = np.isfinite(block.point_positions).any(axis=1) & ~marked
    ties, parts = (int(np.count_nonzero(own)) for own in (~marked[block.image_points], partial))
    far = int(project.frame.kind in ("topocentric", "geocentric"))
    counts = {"lost.ties": ties, "lost.partial-control": parts, "lost.geocentric-digits": far}
    return [phrase(code, n=count) for code, count in counts.items() if count]


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file; a topocentric frame is written with its position on the earth."""
    block = project.block
    if not known_poses(block).any():
        raise InputError(phrase("format.poses"))
    frame, rotation, translation = project.frame, np.eye(3), np.zeros(3)
    if frame.origin is not None and frame.kind == "topocentric":
        rotation = east_north_up(frame.origin).T
        translation = from_frame(EARTH, np.zeros((1, 3)), np.zeros((1, 3, 3)), frame)[0][0]
    system = (GEOGRAPHIC if _is_placed(frame) else LOCAL_SYSTEM).replace('"', "&quot;")
    cameras, which = known_cameras(block)
    sensors = enumerate(zip(cameras, project.sizes, project.pixel_mm, strict=True))
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<document version="2.0.0">',
        '<chunk enabled="true">',
        f'<sensors next_id="{len(cameras)}">',
        *(line for row, given in sensors for line in _written_sensor(row, *given)),
        "</sensors>",
        '<components next_id="1" active_id="0">',
        '<component id="0" label="Component 1">',
        f"<transform><rotation>{_numbers(rotation)}</rotation>"
        f"<translation>{_numbers(translation)}</translation><scale>1.0</scale></transform>",
        "</component>",
        "</components>",
        *_written_shots(project, which),
        *_written_markers(project),
        f"<reference>{system}</reference>",
        "</chunk>",
        "</document>",
        "",
    ]
    return {FORMATS["agisoft"].files[0]: "\n".join(lines).encode()}


def _is_placed(frame: Frame) -> bool:
    return frame.kind == "geocentric" or (frame.kind == "topocentric" and frame.origin is not None)


def _references(frame: Frame, xyz: Floats, covariances: Floats) -> tuple[Floats, Floats]:
    if _is_placed(frame) and len(xyz):
        xyz, covariances = from_frame(GEOGRAPHIC, xyz, covariances, frame)
    return xyz, np.sqrt(np.einsum("nii->ni", covariances))


def _numbers(values: Floats) -> str:
    return " ".join(map(repr, values.ravel().tolist()))


def _written_sensor(row: int, camera: Camera, size: Size | None, pixel: float | None) -> list[str]:
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
    lens, terms = lens_with(camera, size, "Metashape", "k1", "k2", "k3", "p1", "p2")
    (fx, fy), (cx, cy), (width, height) = lens.focal, lens.centre, known_size(camera, size)
    values = {"f": fy, "cx": cx - width / 2, "cy": cy - height / 2, "b1": fx - fy, "b2": 0.0, "k4": 0.0}
    # p1 is the coefficient of r^2 + 2 x^2 in Metashape.
    return "frame", values | terms | {"p1": terms["p2"], "p2": terms["p1"]}


def _written_shots(project: Project, which: list[int]) -> list[str]:
    block = project.block
    turns = attitude_matrices(block) @ Y_DOWN
    given = block.observations.of_type(Position)
    observed = np.array([each.observed[:3] for each in given]).reshape(-1, 3)
    precisions = np.array([each.precision for each in given]).reshape(-1, 3, 3)
    written = map(_written_reference, *_references(project.frame, observed, precisions))
    references = dict(zip((each.photo for each in given), written, strict=True))
    lines = [f'<cameras next_id="{len(block.photo_ids)}" next_group_id="0">']
    for row in np.flatnonzero(known_poses(block)).tolist():
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


def _written_reference(position: Floats, sd: Floats, check: bool = False) -> str:
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


def _written_markers(project: Project) -> list[str]:
    known = known_points(project)
    own = np.flatnonzero(_complete(known)).tolist()
    if not own:
        return []
    positions, deviations = _references(project.frame, known.positions[own], known.covariances[own])
    lines = [f'<markers next_id="{len(own)}" next_group_id="0">']
    for k, (row, sd) in enumerate(zip(own, deviations, strict=True)):
        name = quoteattr(project.block.point_ids[known.rows[row]])
        reference = _written_reference(positions[k], sd, bool(known.checks[row]))
        lines.append(f'<marker id="{k}" label={name}>{reference}</marker>')
    lines += ["</markers>", '<frames next_id="1">', '<frame id="0">', "<markers>"]
    shown, images = known_poses(project.block), {known.rows[row]: list[str]() for row in own}
    for photo, point, x, y in pixel_rows(project):
        if point in images and shown[photo]:
            images[point].append(f'<location camera_id="{photo}" pinned="true" x="{x!r}" y="{y!r}"/>')
    lines += [f'<marker marker_id="{k}">{"".join(each)}</marker>' for k, each in enumerate(images.values())]
    return [*lines, "</markers>", "</frame>", "</frames>"]
