"""Positions of photographs as observations of a project and as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.crs import amid, from_frame, has_geoid_heights, has_place, is_on, to_frame
from photogram.formats.metadata.merged import (
    WITHOUT,
    Metadata,
    PhotoRecord,
    Photos,
    counts,
    read_gnss_file,
    read_metadata,
    remarks_on,
    told,
)
from photogram.formats.metadata.record import ELLIPSOIDAL, SEA_LEVEL, Said
from photogram.formats.metadata.record import SOURCE as EVENTS
from photogram.formats.models import carried, is_free
from photogram.formats.plain.schema import AXES, deviation_columns
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import covariances_of
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.geometry import Frame, Spheroid
from photogram.network.observations import Position
from photogram.network.point_sets import similarity
from photogram.network.unknowns import LeverArm, Shift
from photogram.words import Phrase, option_sd, phrase

SIMILAR = 10.0  # Least improvement of the fit by a similarity transformation
DETERMINED = 3.0  # Smallest ratio of spread across the line to misfit for positions that rotate a model


def with_photo_positions(project: Project, options: ReadOptions) -> Project:
    """Return a project with positions of `--gnss` and of photo files as observations.

    Positions of `--gnss` replace observed positions; photos whose position is observed otherwise are
    unchanged. RTK positions with standard deviations share a shift (0.05 m a priori) and a lever arm (0.01 m)
    per flight. These represent errors of the base and of the shutter time. A model without georeference is
    transformed to the positions.
    """
    settings = project.details.get("settings")
    own = settings if isinstance(settings, Settings) else None
    files = options if options.photos_dir or own is None else own.photo_files
    sd = options.sd if own is None else own.sd
    path, antenna, directory = options.gnss, options.gnss_antenna, None if files is None else files.photos_dir
    if path is not None:
        metadata = read_gnss_file(path, project.block.photo_ids, directory, mrk_antenna=options.mrk_antenna)
        keys = _keys(project, metadata, weighted_only=True)
        given, messages = project.block.observations, list(project.messages)
        others = [each for each in given if not (isinstance(each, Position) and each.photo in keys)]
        if replaced := len(given) - len(others):
            messages.append(Message.of("photos.replaced", path, n=replaced))
        if any(each.position and each.position.source == EVENTS for each in metadata.photos.values()):
            code = "photos.events" if antenna else "photos.events-without-lever"
            messages.append(Message.of(code, path))
        project = project.replace(block=project.block.replace(observations=others), messages=tuple(messages))
        project = _with_positions(project, metadata, keys, options.gnss_crs, sd, GNSS_CRS, antenna)
    if files is not None and directory is not None:
        metadata = read_metadata(directory, mrk_antenna=files.mrk_antenna)
        keys = _keys(project, metadata)
        project = _with_positions(project, metadata, keys, files.photos_crs, sd, PHOTOS_CRS)
    return project


def _with_positions(
    project: Project,
    metadata: Metadata,
    keys: Mapping[str, str],
    crs: str | None,
    sd: Mapping[str, tuple[float, ...]],
    option: str,
    antenna: tuple[float, float, float, float] | None = None,
) -> Project:
    records = {name: metadata.photos[key] for name, key in keys.items()}
    there = [name for name, each in records.items() if each.position is not None]
    photos = [name for name in there if records[name].deviations is not None or "gnss" in sd]
    lacking = len(there) - len(photos)
    known = located([records[name] for name in photos], crs, sd.get("gnss"), option)
    messages = [*metadata.messages, *remarks_on(known.records)]
    if photos:
        positions = told(counts(each.position for each in known.records))
        sources = counts(each.deviations for each in known.records)
        specified = sources.pop(WITHOUT, 0)
        deviations = [told(sources)] * bool(sources) + [f"{specified} of --sd gnss"] * bool(specified)
        fields = {"n": len(photos), "positions": positions, "deviations": deviations}
        messages.append(Message.of("photos.observed", metadata.directory, **fields))
    if flights := {flight for flight in known.flights if flight}:
        code = "photos.flights" if antenna is None else "photos.flights-antenna"
        messages.append(Message.of(code, n=len(flights), shift=SHIFT_SD, lever=LEVER_SD))
    lacks = list(project.lacks)
    if lacking:
        lacks.append(Phrase("read.positions", {"n": lacking, "option": option_sd("gnss")}))
    inputs = (*project.details.get("further inputs", ()), *metadata.tables)
    details = {**project.details, "further inputs": inputs}
    project = project.replace(messages=(*project.messages, *messages), lacks=tuple(lacks), details=details)
    if not photos:
        return project
    project, xyz, covariances = _in_frame(project, known, photos)
    observed = _observations(project, known, photos, xyz, covariances, antenna)
    return project.replace(block=project.block.replace(observations=[*project.block.observations, *observed]))


def _keys(project: Project, metadata: Metadata, *, weighted_only: bool = False) -> dict[str, str]:
    """Return the names in the metadata of photos without observed, or only without weighted, position."""
    block = project.block
    observed = {each.photo for each in block.observations if isinstance(each, Position) and not weighted_only}
    weighted: Bools = np.asarray(np.isfinite(block.photo_position_sd).any(axis=1))
    photos = Photos(metadata.photos)
    found = {name: photos.meant(name) for name in block.photo_ids}
    for name, keys in found.items():
        if len(keys) > 1:
            raise InputError(phrase("photos.ambiguous", photo=name, names=keys), file=metadata.directory)
    if not any(found.values()):
        fields = {"names": list(found), "known": list(metadata.photos)}
        raise InputError(phrase("photos.none", **fields), file=metadata.directory)
    free = (name for name, known in zip(found, weighted, strict=True) if not known and name not in observed)
    return {name: found[name][0] for name in free if found[name]}


def _in_frame(project: Project, known: Located, photos: Sequence[str]) -> tuple[Project, Floats, Floats]:
    """Return a georeferenced project, and positions and covariances in its frame."""
    frame = project.frame
    if project.block.linear_unit != "m":
        raise InputError(phrase("photos.metres", unit=project.block.linear_unit), file=project.path)
    if not known.systems[0]:
        if frame.kind == "geographic":
            raise InputError(phrase("photos.crs", option=GNSS_CRS))
        xyz, covariances, remarks = known.xyz, covariances_of(known.sd), list[Phrase]()
        if is_free(project) and not np.isfinite(project.block.point_sd).any():
            project = _placed(project, photos, xyz, frame)
    elif frame.kind == "cartesian" and frame.crs:
        earth, turned, remarks = known.in_frame(Frame("geocentric"))
        xyz, covariances = from_frame(frame.crs, earth, turned, Frame("geocentric"))
    elif has_place(frame):
        xyz, covariances, remarks = known.in_frame(frame)
    else:
        if not is_free(project) or np.isfinite(project.block.point_sd).any():
            raise InputError(phrase("photos.place"), file=project.path)
        crs = known.systems[0]
        origin = amid(crs, known.xyz[[each == crs for each in known.systems]])
        frame = Frame("topocentric", ELLIPSOIDAL, origin)
        xyz, covariances, remarks = known.in_frame(frame)
        project = _placed(project, photos, xyz, frame)
    project = project.replace(messages=(*project.messages, *map(Message, remarks)))
    return project, xyz, (covariances + covariances.transpose(0, 2, 1)) / 2


def _placed(project: Project, photos: Sequence[str], xyz: Floats, frame: Frame) -> Project:
    """Transform a model to photo positions; without enough, remove poses."""
    block = project.block
    places = {name: row for row, name in enumerate(block.photo_ids)}
    model = block.photo_positions[[places[each] for each in photos]]
    posed = np.isfinite(model).all(axis=1)
    if np.count_nonzero(posed) > 2:
        scale, turn, shift, misfit = similarity(model[posed], xyz[posed])
        before = float(np.sqrt(np.mean((model[posed] - xyz[posed]) ** 2)))
        if frame == project.frame and before <= SIMILAR * misfit:
            return project
        across = np.linalg.svd(xyz[posed] - xyz[posed].mean(axis=0), compute_uv=False)[1]
        if DETERMINED * misfit * np.sqrt(3 * np.count_nonzero(posed)) < across:
            fields = {"n": int(np.count_nonzero(posed)), "scale": scale, "rms": misfit}
            message = Message.of("photos.transformed", **fields, frame=frame.phrase)
            return carried(project, (scale, turn, shift), frame, message)
    message = Message.of("photos.new-poses" if posed.any() else "photos.frame", frame=frame.phrase)
    lost = np.full_like(block.photo_positions, np.nan)
    return project.replace(
        block=block.replace(photo_positions=lost, photo_attitudes=lost.copy()),
        starts=np.full_like(project.starts, np.nan),
        frame=frame,
        messages=(*project.messages, message),
    )


def _observations(
    project: Project,
    known: Located,
    photos: Sequence[str],
    xyz: Floats,
    covariances: Floats,
    antenna: tuple[float, float, float, float] | None,
) -> list[Position]:
    """Return the position observations, with the shared parameters of a flight."""
    *arm, arm_sd = antenna or (0.0, 0.0, 0.0, LEVER_SD)
    groups = [record.flight if record.rtk or (antenna and arm_sd) else "" for record in known.records]
    taken = {own.title for each in project.block.observations for own in each.unknowns if own is not None}
    common: dict[str, tuple[LeverArm, Shift]] = {}
    for flight in dict.fromkeys(each for each in groups if each):
        name = flight
        while taken & {f"{kind.KIND} {name}" for kind in (LeverArm, Shift)}:
            name += "'"
        common[flight] = LeverArm(name, arm, arm_sd), Shift(name, 0.0, SHIFT_SD)
    levers = [common[group][0] if group and arm_sd else arm for group in groups]
    shifts = [common[flight][1] if flight else None for flight in known.flights]
    rows = zip(photos, xyz, covariances, levers, shifts, strict=True)
    return [
        Position(photo, position, covariance=covariance, lever_arm=lever, shift=shift)
        for photo, position, covariance, lever, shift in rows
    ]


SHIFT_SD = 0.05  # Metres: a-priori standard deviation of the common shift of positions of a flight
LEVER_SD = 0.01  # Metres: a-priori standard deviation of a lever arm that is already applied
ABOVE = {False: "above the ellipsoid", True: "above the geoid"}
PHOTOS_CRS, GNSS_CRS = "--photos-crs", "--gnss-crs"  # Options that name the system of positions
_UNKNOWN = "above the geoid or above the ellipsoid"
GROUPS = "gnss_groups.csv"
_COMMENT = (
    "longitude and latitude (degrees), height above the ellipsoid (metres) of WGS 84, standard deviations of"
    f' east, north, height (metres); project.toml: [gnss] crs = "{ELLIPSOIDAL}"'
)
_WGS84 = (Spheroid.wgs84().a, Spheroid.wgs84().b)


@dataclass(frozen=True)
class Located:
    """Positions of n photos with the system of each.

    `xyz` are (n, 3) longitude (degrees) or easting, latitude or northing, height;
    `sd` are (n, 3) standard deviations of east, north and height, metres; NaN without.
    """

    records: tuple[PhotoRecord, ...]
    systems: tuple[str, ...]
    xyz: Floats
    sd: Floats

    @property
    def flights(self) -> list[str]:
        """The flight of each position with a shared shift and lever arm; otherwise empty."""
        return [each.flight if each.rtk else "" for each in self.records]

    def in_frame(self, frame: Frame) -> tuple[Floats, Floats, list[Phrase]]:
        """Return (n, 3) positions and (n, 3, 3) covariances in a frame, and remarks."""
        turned = covariances_of(self.sd)
        xyz, remarks = np.empty_like(self.xyz), list[Phrase]()
        for crs in dict.fromkeys(self.systems):
            own = np.array([each == crs for each in self.systems])
            xyz[own], turned[own], said = to_frame(crs, self.xyz[own], turned[own], frame)
            remarks += [each for each in said if each not in remarks]
        return xyz, turned, remarks

    def geographic(self) -> tuple[Floats, Floats]:
        """Return (n, 3) longitudes, latitudes (deg), ellipsoidal heights (WGS 84), and (n, 3) sd.

        Positions that are already in this system are not changed.
        """
        if set(self.systems) <= {ELLIPSOIDAL}:
            return self.xyz, self.sd
        frame = Frame("geographic", ELLIPSOIDAL, ellipsoid=_WGS84)
        known = np.nan_to_num(self.sd)
        xyz, turned, _ = Located(self.records, self.systems, self.xyz, known).in_frame(frame)
        xyz[:, :2] = np.degrees(xyz[:, :2])
        sd = np.sqrt(np.maximum(np.diagonal(turned, axis1=1, axis2=2), 0.0))
        return xyz, np.where(np.isnan(self.sd), np.nan, sd)


def located(
    records: Sequence[PhotoRecord],
    crs: str | None = None,
    sd: Sequence[float] | None = None,
    option: str = PHOTOS_CRS,
) -> Located:
    """Return the positions of photos; all heights have one reference.

    `crs` is the system of positions if their source does not name it or the reference of its heights. `sd`
    are default standard deviations: one number or three, metres. `option` names the system. Positions of
    `--gnss` without a system are in the frame of the project, and their system is empty.
    """
    known = [each for each in records if each.position is not None]
    said = [each.position for each in known if each.position is not None]
    if option == GNSS_CRS and crs is None and not any(each.crs for each in said):
        systems = [""] * len(said)
    else:
        named = [each for each in said if each.crs and each.heights]
        if crs is not None and named and not is_on(crs, _WGS84):
            raise named[0].place.error(phrase("photos.wgs84", crs=crs, option=option))
        for each in said:
            if not each.crs and crs is None:
                raise each.place.error(phrase("photos.crs", option=option))
        systems = [each.crs if each.crs and not each.heights else crs or "" for each in said]
        _check_heights(known, said, systems, option)
    default = np.broadcast_to(np.nan if sd is None else np.asarray(sd, dtype=float), 3)
    deviations = [each.deviations.sd if each.deviations is not None else default for each in known]
    positions = [each.position for each in said]
    xyz, sds = (np.array(own, dtype=float).reshape(-1, 3) for own in (positions, deviations))
    return Located(tuple(known), tuple(systems), xyz, sds)


def _check_heights(
    records: Sequence[PhotoRecord], said: Sequence[Said], systems: Sequence[str], option: str
) -> None:
    """Reject heights of different or unknown reference surfaces."""
    surfaces = {
        system: ABOVE[system != ELLIPSOIDAL and has_geoid_heights(system)] if system else _UNKNOWN
        for system in dict.fromkeys(systems)
    }
    kinds: dict[str, list[str]] = {}
    for record, own, system in zip(records, said, systems, strict=True):
        kind = ABOVE[True] if own.heights == SEA_LEVEL else surfaces[system]
        kinds.setdefault(kind, []).append(f"{record.photo} ({own.source})")
    if len(kinds) > 1:
        (one, first), (other, second), *_ = kinds.items()
        raise InputError(phrase("photos.heights", one=one, first=first, other=other, second=second))
    for own, system in zip(said, systems, strict=True):
        if own.heights == SEA_LEVEL and surfaces[system] != ABOVE[True]:
            raise own.place.error(phrase("photos.sea-level", option=option))
    if "" in systems:
        raise said[0].place.error(phrase("photos.height-kind", option=option))


def gnss_files(
    metadata: Metadata, path: Path, crs: str | None = None, sd: Sequence[float] | None = None
) -> dict[Path, bytes]:
    """Return a table `gnss` of a plain project, and `gnss_groups` if needed.

    Photo names have folders only if necessary.
    """
    known = located(list(metadata.photos.values()), crs, sd)
    if not known.records:
        raise InputError(phrase("format.missing", what="positions of photos"), file=metadata.directory)
    xyz, deviations = known.geographic()
    names = {each.photo: PurePosixPath(each.photo).name for each in known.records}
    often = Counter(names.values())
    columns = {
        "photo": [photo if often[name] > 1 else name for photo, name in names.items()],
        **dict(zip(("longitude", "latitude", "height"), xyz.T, strict=True)),
        **dict(zip(deviation_columns(AXES), deviations.T, strict=True)),
        "group": known.flights,
        "source": [each.position.source if each.position else "" for each in known.records],
        "sd_source": [each.deviations.source if each.deviations else "" for each in known.records],
    }
    files = {path: csv_text(columns, [_COMMENT])}
    if flights := list(dict.fromkeys(each for each in known.flights if each)):
        groups: dict[str, Any] = {"group": flights, "shift": ["true"] * len(flights)}
        for kind, deviation in (("lever", LEVER_SD), ("shift", SHIFT_SD)):
            groups |= {f"sd_{kind}_{axis}": [deviation] * len(flights) for axis in AXES}
        files[path.with_name(GROUPS)] = csv_text(groups)
    return files
