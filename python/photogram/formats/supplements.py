"""User additions to a project, such as control and observations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.columns import PLAIN, Columns
from photogram.formats.control import ControlList, check_systems, read_control_list
from photogram.formats.crs import plane_remarks
from photogram.formats.images import by_camera, from_corner, to_corner
from photogram.formats.models import carried, intersected, is_free
from photogram.formats.names import with_names, with_other_names
from photogram.formats.pixels import corner_of, pixel_table
from photogram.formats.plain.reading import read_control
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.statement_tables import with_cover
from photogram.formats.plain.tables import Tables, Transform, indices_of
from photogram.formats.project import Project, Repeated
from photogram.formats.read_options import ReadOptions
from photogram.io.column_table import ColumnTable
from photogram.io.places import Place, at_place
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.equivalent_cameras import (
    focal_length_message,
    freed,
    matching_word,
    with_one_focal_length,
    with_parameters,
)
from photogram.network.geometry import Frame
from photogram.network.motion import timed_photos
from photogram.network.point_sets import similarity
from photogram.results.result import Result
from photogram.words import OPTIONS_OF_CONTROL, Phrase, option_sd, phrase

SAME = 1e-3  # Largest difference (pixels) of equal observations of a point in a photo
SIMILAR = 10.0  # Smallest improvement of the fit of control for which a similarity is applied to the model


def supplemented(project: Project, options: ReadOptions) -> Project:
    """Return a project with the standard deviations, observations, names and control of options."""
    project = with_sd(project, options.sd)
    if options.keep_repeated:
        project = with_repeated(project)
    if options.images is not None:
        messages = list(project.messages)
        table = pixel_table(options.images, messages)
        project = _with_table(project, options.images, table, options.pixel_origin)
        project = project.replace(messages=tuple(messages))
    if options.names is not None:
        project = with_names(project, options.names)
    if options.control is not None:
        columns = options.control_columns
        project = with_control(project, options.control, options.sd, options.control_crs, columns)
    return project


def with_sd(project: Project, sd: Mapping[str, tuple[float, ...]]) -> Project:
    """Return a project with user-defined standard deviations of image coordinates.

    In a plain project they are defaults for its tables. Some readers apply them in the unit of their files.
    """
    if "images" not in sd or project.sd_taken:
        return project
    own = np.broadcast_to(sd["images"], (len(project.block.image_xy), 2))
    images = option_sd("images")
    lacks = tuple(each for each in project.lacks if each.fields.get("option") != images)
    return project.replace(block=project.block.replace(image_sd=own), lacks=lacks)


def with_repeated(project: Project) -> Project:
    """Return a project in which means replace repeated observations.

    With the sum of the weights the adjustment is equivalent to all single observations. The sum of squares of
    their differences from the mean does not depend on any unknown. A message reports this sum.
    """
    block = project.block
    first, second = _repeated_rows(project)
    if not len(first):
        return project
    rows, place, again = np.unique(first, return_inverse=True, return_counts=True)
    count = 1.0 + again[:, np.newaxis]
    own, others = block.image_xy[rows], project.repeated.xy[second]
    mean = own.copy()
    np.add.at(mean, place, others)
    mean /= count
    sd = block.image_sd[rows]
    spread = float((((own - mean) / sd) ** 2).sum() + (((others - mean[place]) / sd[place]) ** 2).sum())
    xy, deviations = block.image_xy.copy(), np.array(block.image_sd)
    xy[rows], deviations[rows] = mean, sd / np.sqrt(count)
    said = [each for each in project.messages if each.code != "read.repeated"]
    said.append(Message.of("read.averaged", n=len(second), spread=spread, half=spread / 2))
    block = block.replace(image_xy=xy, image_sd=deviations)
    return project.replace(block=block, messages=tuple(said), repeated=Repeated())


def repeated_remarks(project: Project, result: Result) -> list[Message]:
    """Report the sum of squares with repeated observations, if any."""
    if not result.converged:
        return []
    block = project.block
    first, second = _repeated_rows(project)
    # The residual of a moving photo depends on the line of the observation.
    used = result.used_images[first] & ~timed_photos(block)[block.image_photos[first]]
    if not used.any():
        return []
    first, second = first[used], second[used]
    residuals = project.repeated.xy[second] - block.image_xy[first] + result.residuals[first]
    more = float(((residuals / block.image_sd[first]) ** 2).sum())
    total, option = float(result.sums_of_squares.total), Phrase("option.repeated")
    return [Message.of("result.repeated", n=len(first), more=total + more, total=total, option=option)]


def _repeated_rows(project: Project) -> tuple[Indices, Indices]:
    """Return rows of first observations in the block, and of their repetitions."""
    block, again = project.block, project.repeated
    place = _image_rows(block) if again.points else {}
    pairs = [place.get(pair, -1) for pair in zip(again.photos, again.points, strict=True)]
    rows = np.array(pairs, dtype=np.int64)
    there = np.flatnonzero(rows >= 0)
    return rows[there], there


def _image_rows(block: Block) -> dict[tuple[str, str], int]:
    ids = zip(block.image_photos.tolist(), block.image_points.tolist(), strict=True)
    return {(block.photo_ids[i], block.point_ids[j]): row for row, (i, j) in enumerate(ids)}


def self_calibrated(project: Project, names: Sequence[str]) -> Project:
    """Return a project whose cameras have free parameters: named ones, or `all`.

    A camera whose model lacks a named parameter gets the narrowest model with it that contains its own: k1 of
    a pinhole. The parameter f of a model with fx and fy is one parameter if they are equal, otherwise two.
    """
    if not names:
        return project
    if not project.block.cameras:
        raise InputError(phrase("plain.no-cameras"))
    wanted = {name.lower() for name in names}
    cameras, used, messages = [], set(), []
    titles_by_text: dict[str, list[str]] = {}
    for camera, size in zip(project.block.cameras, project.sizes, strict=True):
        model = with_parameters(camera, wanted)
        free = set(model.names) - model.constants
        unknown = freed(model, {name.lower() for name in free} if "all" in wanted else wanted)
        cameras.append(unknown)
        if "fx" in free and "f" in wanted and not wanted & {"fx", "fy", "all"}:
            cameras[-1] = with_one_focal_length(unknown, size if unknown.unit == "px" else None)
            text = focal_length_message(unknown, cameras[-1])
            titles_by_text.setdefault(text, []).append(camera.title)
        used |= {matching_word(name, wanted) for name in free}
        if model.model != camera.model:
            fields = {"camera": camera.title, "model": model.model, "former": camera.model}
            messages.append(Message.of("plain.model-replaced", **fields))
    for text, titles in titles_by_text.items():
        messages.append(Message.of("plain.focal-length", names=titles, message=text))
    if missing := sorted(wanted - used - {"all"}):
        names = sorted({name for camera in project.block.cameras for name in camera.names})
        raise InputError(phrase("error.unknown", kind="parameter of a camera", name=missing[0], names=names))
    block = project.block.replace(cameras=cameras)
    return project.replace(block=block, messages=(*project.messages, *messages))


def held_points(project: Project, wanted: Sequence[str]) -> Project:
    """Return a project with fixed coordinates as datum: `A=XYZ`, `B=YZ`, `C=Z`.

    Previously fixed or weighted points become check points.
    """
    if not wanted:
        return project
    block = project.block
    if block.geographic:
        raise InputError(phrase("plain.hold-geographic"))
    known, places = project.positions(), block.point_positions.copy()
    sd = np.full(places.shape, np.inf)
    for each in wanted:
        name, _, axes = each.partition("=")
        columns = ["XYZ".find(axis) for axis in (axes or "XYZ").upper()]
        if name not in block.point_ids or -1 in columns:
            raise InputError(phrase("plain.hold-form", text=each))
        row = block.point_ids.index(name)
        if not np.isfinite(known[row, columns]).all():
            raise InputError(phrase("plain.hold-unknown", point=name))
        places[row, columns], sd[row, columns] = known[row, columns], 0.0
    return project.replace(block=block.replace(point_positions=places, point_sd=sd))


def _with_table(project: Project, path: Path, table: ColumnTable, pixel_origin: str | None) -> Project:
    block = project.block
    if not table.count:
        return project
    if block.image_unit != "px" or block.photo_cameras is None:
        raise InputError(phrase("plain.pixels-with-mm"), file=path)
    photos = indices_of(table, "photo", {name: row for row, name in enumerate(block.photo_ids)}, "photo")
    names = table.names("point")
    known = {name: row for row, name in enumerate(block.point_ids)}
    rows = [known.setdefault(name, len(known)) for name in names.names]
    new, points = list(known)[len(block.point_ids) :], np.array(rows, dtype=np.int64)[names.rows]
    corner, which = corner_of(table, pixel_origin), block.photo_cameras[photos]
    xy = by_camera(corner, which, lambda row, own: from_corner(block.cameras[row], project.sizes[row], own))
    fill = np.full((len(new), 3), np.nan)
    default = float(np.median(block.image_sd)) if len(block.image_sd) else 1.0
    sd = np.column_stack([table.numbers("sd", default)] * 2)
    with at_place(Place(path)):
        larger = block.replace(
            point_ids=[*block.point_ids, *new],
            point_positions=np.vstack([block.point_positions, fill]),
            point_sd=np.vstack([block.point_sd, np.full_like(fill, np.inf)]),
            point_check_sd=None if block.point_check_sd is None else np.vstack([block.point_check_sd, fill]),
            image_photos=np.concatenate([block.image_photos, photos]),
            image_points=np.concatenate([block.image_points, points]),
            image_xy=np.vstack([block.image_xy, xy]),
            image_sd=np.vstack([block.image_sd, sd]),
        )
    return project.replace(block=larger, starts=np.vstack([project.starts, fill]))


def _with_list(project: Project, given: ControlList) -> Project:
    """Return a project with the image observations of a list of control points.

    A track with the identifier of a control point is another point and is renamed, unless both have an equal
    observation.
    """
    exact = set(project.block.photo_ids)
    plain = by_key(("_".join(name.split()), name) for name in project.block.photo_ids)
    listed = given.images.texts("photo")
    only = {name: names[0] for name, names in plain.items() if len(names) == 1}
    photos = [name if name in exact else only.get(name, "") for name in listed]
    rows = [row for row, name in enumerate(photos) if name]
    if lost := sorted({own for own, name in zip(listed, photos, strict=True) if not name}):
        given.messages.append(Message.of("plain.other-photos", given.images.path, names=lost))
    table = given.images.some(rows).with_texts("photo", [photos[row] for row in rows])
    known, points = _image_rows(project.block), table.texts("point")
    images = dict(enumerate(zip(table.texts("photo"), points, strict=True)))
    present = {row for row, image in images.items() if image in known}
    if present:
        there, corner = to_corner(project), corner_of(table, None)
        present = {row for row in present if np.abs(there[known[images[row]]] - corner[row]).max() <= SAME}
    other = project.tracks.intersection(given.control.texts("point")) - {points[row] for row in present}
    if other:
        new = {name: f"track {name}" for name in project.block.point_ids if name in other}
        taken = {*project.block.point_ids, *given.control.texts("point")}
        for name in new:
            while new[name] in taken:
                new[name] = f"track {new[name]}"
        message = Message.of("plain.renamed-tracks", table.path, n=len(new), names=list(new.values()))
        given.messages.append(message)
        project = with_other_names(project, new)
    further = table.some([row for row in range(table.count) if row not in present])
    return _with_table(project, table.path, further, None)


def with_control(
    project: Project,
    path: Path,
    sd: Mapping[str, tuple[float, ...]],
    crs: str | None,
    columns: Columns = PLAIN,
) -> Project:
    listed = read_control_list(path, project)
    crs = crs or (listed.crs if listed else "")
    settings = Settings(
        path,
        frame=project.frame,
        length=project.block.linear_unit,
        sd=sd,
        tables={"control": path},
        crs={"control": crs} if crs else {},
        columns={"control": columns},
    )
    tables = Tables(settings, listed.messages if listed else [], frozenset(project.block.point_ids))
    table = listed.control if listed else tables.rows("control")
    project = _with_list(project, listed) if listed else project
    transform = Transform(settings, tables.messages)
    given = read_control(tables, table, transform)
    block = project.block
    places = {name: row for row, name in enumerate(block.point_ids)}
    rows = [row for row, name in enumerate(given.names) if name in places]
    if not rows:
        raise table.head.error(phrase("plain.no-control-images", names=given.names))
    missing = [name for name in given.names if name not in places]
    messages = [*project.messages, *tables.messages]
    if missing:
        messages.append(Message(phrase("plain.control-without-images", names=missing), path))
    targets = np.array([places[given.names[row]] for row in rows])
    raw = table.vectors("xyz")
    messages += check_systems(project, settings, table, targets, raw[rows], free=is_free(project))
    held = [row for row in rows if np.isfinite(given.positions[row]).all()]
    points = np.array([places[given.names[row]] for row in held], dtype=np.int64)
    moved = _carried(project, points, given.positions[held], transform.frame)
    block = moved.block
    positions, deviation = block.point_positions.copy(), block.point_sd.copy()
    positions[targets], deviation[targets] = given.positions[rows], given.sd[rows]
    before = block.point_check_sd
    check_sd = np.full_like(positions, np.nan) if before is None else before.copy()
    check_sd[targets] = given.check_sd[rows]
    full = [each for each in given.observed if each.points[0] in places]
    for each in full:
        positions[places[each.points[0]]] = np.nan
    # Data given now are not missing any more.
    is_given = bool(full) or np.isfinite(deviation).any()
    options = OPTIONS_OF_CONTROL if is_given else ()
    found = moved.replace(
        block=block.replace(
            point_positions=positions,
            point_sd=deviation,
            point_check_sd=check_sd,
            observations=[*block.observations, *full],
        ),
        statement=with_cover(project.statement, given.names, given.vegetated.intersection(places)),
        messages=(*messages, *moved.messages[len(project.messages) :]),
        control_crs=settings.crs.get("control", ""),
        lacks=tuple(each for each in moved.lacks if each.fields.get("option") not in options),
    )
    planes = plane_remarks(found.block, found.path, found.starts)
    new = [each for each in planes if each not in found.messages]
    return found.replace(messages=(*found.messages, *new))


def _carried(project: Project, points: Indices, targets: Floats, frame: Frame) -> Project:
    """Transform a free model to control if the fit improves enough."""
    model = project.starts[points].copy()
    unknown = np.flatnonzero(~np.isfinite(model).all(axis=1))
    model[unknown] = intersected(project, points[unknown])
    known = np.isfinite(model).all(axis=1)
    if np.count_nonzero(known) > 2 and is_free(project):
        scale, turn, shift, misfit = similarity(model[known], targets[known])
        before = float(np.sqrt(np.mean((model[known] - targets[known]) ** 2)))
        if np.isfinite(misfit) and SIMILAR * misfit < before:
            fields = {"n": int(np.count_nonzero(known)), "scale": scale, "misfit": misfit, "before": before}
            message = Message.of("plain.carried", unit=project.block.linear_unit, **fields)
            return carried(project, (scale, turn, shift), frame, message)
    return replace(project, frame=frame) if frame != project.frame else project
