"""Positions that files of photographs carry, as observations of a project."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.format import PhotoFiles, Wishes
from photogram.formats.metadata.merged import WITHOUT, Metadata, counts, read_metadata, remarks_on, told
from photogram.formats.metadata.record import ELLIPSOIDAL
from photogram.formats.metadata.search import Photos
from photogram.formats.metadata.systems import LEVER_SD, SHIFT_SD, Located, located
from photogram.formats.models import carried, is_free
from photogram.formats.plain.settings import Settings
from photogram.formats.project import Frame, Project
from photogram.messages import Message, counted, listed
from photogram.network.observations import Position
from photogram.network.similarity import similarity
from photogram.network.unknowns import LeverArm, Shift

DETERMINED = 3.0
"""How much wider than their misfit positions must spread across their line to turn a model."""


def with_wished_photos(project: Project, wishes: Wishes) -> Project:
    """Return a project with the positions that files of its photographs carry, where these are named."""
    settings = project.details.get("settings")
    own = settings if isinstance(settings, Settings) else None
    files = wishes.photos or (None if own is None else own.photo_files)
    if files is None:
        return project
    return with_photo_files(project, files, wishes.sd if own is None else own.sd)


def with_photo_files(project: Project, files: PhotoFiles, sd: Mapping[str, tuple[float, ...]]) -> Project:
    """Return a project with the positions that files of its photographs carry, as observations.

    Photos whose position is observed already keep that. Positions with standard deviations of a receiver with
    corrections in real time have a shift of 0.05 m a priori in common in a flight, and a lever arm of 0.01 m:
    they leave out the errors of the base and of the shutter's time. A model without a place on the earth is
    carried onto the positions. `sd` are standard deviations by table; those of `gnss` where no source has
    any.
    """
    metadata = read_metadata(files.directory, mrk_antenna=files.mrk_antenna)
    records = {name: metadata.photos[key] for name, key in _keys(project, metadata).items()}
    there = [name for name, each in records.items() if each.position is not None]
    photos = [name for name in there if records[name].deviations is not None or "gnss" in sd]
    lacking = len(there) - len(photos)
    known = located([records[name] for name in photos], files.crs, sd.get("gnss"))
    messages = [*metadata.messages, *remarks_on(known.records)]
    if photos:
        messages += _told(metadata, known)
    lacks = list(project.lacks)
    if lacking:
        lacks.append(f"no standard deviations of {counted(lacking, 'position')} of photos (--sd gnss=...)")
    read = {"further inputs": metadata.tables, "photo pictures": metadata.pictures}
    project = project.replace(
        messages=(*project.messages, *messages), lacks=tuple(lacks), details={**project.details, **read}
    )
    if not photos:
        return project
    project, xyz, covariances = _in_frame(project, known, photos)
    observed = _observations(project, known, photos, xyz, covariances)
    return project.replace(block=project.block.replace(observations=[*project.block.observations, *observed]))


def _keys(project: Project, metadata: Metadata) -> dict[str, str]:
    """Return what the folder calls the photos of a project whose position nobody has observed."""
    block = project.block
    observed = {each.photo for each in block.observations if isinstance(each, Position)}
    weighted = np.flatnonzero(np.isfinite(block.photo_position_sd).any(axis=1)).tolist()
    observed |= {block.photo_ids[row] for row in weighted}
    photos = Photos(metadata.photos)
    found: dict[str, str] = {}
    strange = []
    for name in block.photo_ids:
        keys = photos.meant(name)
        if not keys:
            strange.append(name)
            continue
        if len(keys) > 1:
            raise InputError(
                f"the photo {name} may be {listed(keys, 3)}: photos need the names of their folders",
                file=metadata.directory,
            )
        if name not in observed:
            found[name] = keys[0]
    if len(strange) == len(block.photo_ids):
        raise InputError(
            f"holds none of the photos {listed(strange, 3)}, but {listed(list(metadata.photos), 3)}",
            file=metadata.directory,
        )
    return found


def _told(metadata: Metadata, known: Located) -> list[Message]:
    """Return what is said of positions that are observations: their sources, and what they have in common."""
    records = known.records
    count = counted(len(records), "position")
    positions = told(counts(each.position for each in records))
    deviations = counts(each.deviations for each in records)
    given = deviations.pop(WITHOUT, 0)
    said = [*([told(deviations)] if deviations else []), *([f"{given} given (--sd gnss)"] if given else [])]
    text = f"{count} of photos are observations ({positions}); standard deviations: {', '.join(said)}"
    found = [Message(text, metadata.directory)]
    if flights := {each for each in known.flights if each}:
        found.append(
            Message(
                f"{counted(len(flights), 'flight')} of RTK: a shift ({SHIFT_SD:g} m a priori) and a lever arm"
                f" ({LEVER_SD:g} m) for each, as standard deviations of receivers leave out the base and the"
                " shutter's time"
            )
        )
    return found


def _in_frame(project: Project, known: Located, photos: Sequence[str]) -> tuple[Project, Floats, Floats]:
    """Return a project with a place on the earth, and positions and covariances in its frame."""
    from photogram.formats.crs import amid, from_frame, has_place

    frame = project.frame
    if project.block.linear_unit != "m":
        raise InputError("with positions of photos the unit of length is the metre", file=project.path)
    if frame.kind == "cartesian" and frame.crs:
        earth, turned, remarks = known.in_frame(Frame("geocentric"))
        xyz, covariances = from_frame(frame.crs, earth, turned, Frame("geocentric"))
    elif has_place(frame):
        xyz, covariances, remarks = known.in_frame(frame)
    else:
        if not is_free(project) or np.isfinite(project.block.point_sd).any():
            raise InputError(
                "has control or positions in axes that have no place on the earth: positions of photos cannot"
                " be carried there; a crs of its control, or [frame] with an origin, gives it one",
                file=project.path,
            )
        crs = known.systems[0]
        frame = Frame(
            "topocentric", ELLIPSOIDAL, amid(crs, known.xyz[[each == crs for each in known.systems]])
        )
        xyz, covariances, remarks = known.in_frame(frame)
        project = _placed(project, photos, xyz, frame)
    said = [Message(text) for text in remarks]
    return (
        project.replace(messages=(*project.messages, *said)),
        xyz,
        (covariances + covariances.transpose(0, 2, 1)) / 2,
    )


def _placed(project: Project, photos: Sequence[str], xyz: Floats, frame: Frame) -> Project:
    """Carry a model onto the positions of its photos; without enough of them its poses are not kept."""
    block = project.block
    places = {name: row for row, name in enumerate(block.photo_ids)}
    model = block.photo_positions[[places[each] for each in photos]]
    posed = np.isfinite(model).all(axis=1)
    if np.count_nonzero(posed) > 2:
        scale, turn, shift, misfit = similarity(model[posed], xyz[posed])
        across = np.linalg.svd(xyz[posed] - xyz[posed].mean(axis=0), compute_uv=False)[1]
        if DETERMINED * misfit * np.sqrt(3 * np.count_nonzero(posed)) < across:
            text = f"the model is carried onto {np.count_nonzero(posed)} positions of photos by a similarity:"
            text += f" scale {scale:.6g}, {misfit:.3g} m rms left; frame: {frame}"
            return carried(project, (scale, turn, shift), frame, Message(text))
    text = f"positions of photos are adjusted in a frame that is {frame}"
    if posed.any():
        text += "; poses of the model do not fit them by a similarity, and are found anew"
    lost = np.full_like(block.photo_positions, np.nan)
    return project.replace(
        block=block.replace(photo_positions=lost, photo_attitudes=lost.copy()),
        starts=np.full_like(project.starts, np.nan),
        frame=frame,
        messages=(*project.messages, Message(text)),
    )


def _observations(
    project: Project, known: Located, photos: Sequence[str], xyz: Floats, covariances: Floats
) -> list[Position]:
    """Return the observations, with what those of a flight have in common."""
    taken = {own.title for each in project.block.observations for own in each.unknowns if own is not None}
    common: dict[str, tuple[LeverArm, Shift]] = {}
    for flight in dict.fromkeys(each for each in known.flights if each):
        name = flight
        while taken & {f"{kind.KIND} {name}" for kind in (LeverArm, Shift)}:
            name += "'"
        common[flight] = LeverArm(name, 0.0, LEVER_SD), Shift(name, 0.0, SHIFT_SD)
    return [
        Position(
            photo,
            position,
            covariance=covariance,
            lever_arm=common[flight][0] if flight else 0.0,
            shift=common[flight][1] if flight else None,
        )
        for photo, position, covariance, flight in zip(photos, xyz, covariances, known.flights, strict=True)
    ]
