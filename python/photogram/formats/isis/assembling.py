"""Projects from control networks and the support data of their images."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from photogram.arguments.arrays import rows_of_each
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import filled_lines
from photogram.formats.csm.cubes import read_list, read_support
from photogram.formats.csm.photos import SupportedImage
from photogram.formats.format import FORMATS
from photogram.formats.isis.network import ControlNetwork, read_network
from photogram.formats.isis.outcome import DETAILS, PITCHES, Image, PlanetaryContents
from photogram.formats.isis.solving import Settings, observation_number, one_flight, read_settings, solving
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.places import Place
from photogram.messages import Message
from photogram.network.geometry import Cartesian, Spheroid, lengths_of_units, local_frames
from photogram.network.motion import about
from photogram.network.observations import Control
from photogram.words import Phrase, option_sd, phrase

_LOCAL = [1, 0, 2]  # Longitude, latitude and radius in the order of jigsaw: latitude, longitude, radius


def _add_points(
    block: BlockBuilder, contents: PlanetaryContents, rows: Indices, spheroid: Spheroid | None
) -> None:
    """Add points with the prior values of a network and the settings.

    Free points have the standard deviations of the settings, and a fixed radius unless it is to be estimated.
    Constrained points have their own covariance matrix or single standard deviations; fixed points have 0.
    `rows` are the points of the network in use. `spheroid` is a sphere if latitude, longitude and radius are
    adjusted, None if X, Y, Z are.
    """
    settings, points, starts = contents.settings, contents.network.points, contents.starts[rows]

    def report(code: str, omitted: Indices) -> None:
        if len(omitted):
            names = [points.ids[row] for row in omitted.tolist()]
            block.messages.append(Message.of(code, n=len(omitted), names=names))

    coordinates = Cartesian(spheroid).from_cartesian(starts)
    metres = 1.0 / lengths_of_units(coordinates, spheroid)  # Units of coordinates per metre
    order = _LOCAL if spheroid else [0, 1, 2]
    single_sd = settings.latitude_sigmas if spheroid else settings.rectangular_sigmas
    sigmas = np.array([np.inf if each is None else each for each in single_sd])[order]
    sd = np.broadcast_to(sigmas, coordinates.shape) * metres
    if spheroid and not settings.radius:
        sd[:, 2] = np.where(points.is_constrained[rows], sd[:, 2], 0.0)
    sd[points.is_fixed[rows]] = 0.0
    own = np.flatnonzero(points.is_constrained[rows])
    covariances = full_matrices(points.apriori_covariance[rows[own]])
    given = np.isfinite(covariances).all(axis=(1, 2))
    report("isis.no-covariance", rows[own[~given]])
    own, covariances = own[given], covariances[given]
    bad = ~(np.linalg.eigvalsh(covariances) > 0).all(axis=1)
    if bad.any():
        raise block.place.error(phrase("isis.covariance", point=points.ids[rows[own[bad]][0]]))
    if spheroid:
        axes = local_frames(coordinates[own])
        covariances = axes @ covariances @ axes.transpose(0, 2, 1)
    single = points.constrained[rows[own]][:, order]
    whole = single.all(axis=1) | ~single.any(axis=1)
    for row, covariance in zip(own[whole], covariances[whole], strict=True):
        sd[row] = np.inf
        control = Control(points.ids[rows[row]], coordinates[row], covariance=covariance)
        block.observations.append(control)
    deviations = np.sqrt(np.einsum("nkk->nk", covariances)) * metres[own]
    parts = np.flatnonzero(~whole)
    sd[own[parts]] = np.where(single[parts], deviations[parts], sd[own[parts]])
    report("isis.single-coordinates", rows[own[parts]])
    positions = np.where(np.isfinite(sd), coordinates, np.nan)
    names = [points.ids[row] for row in rows.tolist()]
    block.points(names, coordinates, point_positions=positions, point_sd=sd)


def full_matrices(packed: Floats) -> Floats:
    """Return (n, 3, 3) symmetric matrices of (n, 6) upper triangles, row by row."""
    return packed[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


def read(path: Path, options: ReadOptions) -> Project:
    """Read a control network, and the support data of the listed images."""
    if options.cubes is None:
        raise InputError(phrase("isis.cubes"), file=path)
    settings = read_settings(options.jigsaw or "")
    network = read_network(path)
    files = read_list(options.cubes)
    images = _images(network, files, settings, options.cubes)
    seen = _seen(network, images, path)
    photos = {each.photo: own for own in images for each in own.supported.timed}
    starts = np.full((len(network.points), 3), np.nan)
    starts[seen.points] = _starts(network, images, seen, Place(path))
    contents = PlanetaryContents(network, path, photos, settings, starts)
    unused = [serial for serial in files if serial not in {each.serial for each in images}]
    remarks = [Message(remark, each.path) for each in images for remark in each.supported.isd.remarks]
    measures, points = network.measures, network.points
    again = (measures.rejected | points.rejected[network.point_of_measure]) & ~measures.ignore
    omitted = points.ignore.sum(), network.is_ignored.sum(), again.sum()
    codes = ("isis.ignored-points", "isis.ignored-measures", "isis.rejected-measures")
    left = [Message.of(code, n=int(n)) for code, n in zip(codes, omitted, strict=True) if n]
    if unused:
        left.append(Message.of("isis.unused", options.cubes, n=len(unused), names=unused))
    return _project(contents, seen, [*left, *remarks])


def _images(network: ControlNetwork, files: dict[str, Path], settings: Settings, cubes: Path) -> list[Image]:
    """Return the images that have measures, in the order of the network."""
    rows = np.unique(network.measures.serial[~network.is_ignored]).tolist()
    seen = [network.measures.serials[row] for row in rows]
    if missing := [serial for serial in seen if serial not in files]:
        raise InputError(phrase("isis.image", name=missing[0]), file=cubes)
    held, there, found = set[str](), set(seen), {}
    named = {str(file.resolve()): serial for serial, file in files.items()} if settings.held else {}
    # HELDLIST is a list of serial numbers or files.
    for place in filled_lines(settings.held) if settings.held else ():
        text = (place.text or "").strip()
        file = str((place.file or Path()).parent.joinpath(text).resolve())
        if (serial := text if text in files else named.get(file)) is None:
            raise place.error(phrase("isis.held"))
        held.add(serial)
    # The first image of an observation is the first one in the list.
    observations: dict[str, list[str]] = {}
    for serial in (each for each in files if each in there):
        number = observation_number(serial) if settings.observations else serial
        observations.setdefault(number, []).append(serial)
    for number, serials in observations.items():
        if len(known := {serial in held for serial in serials}) > 1:
            raise InputError(phrase("isis.observation", number=number), file=settings.held)
        isds = [read_support(files[serial]) for serial in serials]
        own = solving(one_flight(isds), number, settings, held=True in known, first=isds[0])
        for serial, isd in zip(serials, isds, strict=True):
            supported = SupportedImage(isd, serial, "isis", "isis", own.trajectory)
            found[serial] = Image(serial, files[serial], supported, own)
    return [found[serial] for serial in seen]


class _Seen(NamedTuple):
    """Measures in use and their n points (rows), as m observations of a block."""

    measures: Indices
    points: Indices
    image_points: Indices
    image_photos: Indices
    xy: Floats
    sd: Floats


def _seen(network: ControlNetwork, images: list[Image], path: Path) -> _Seen:
    rows, own = np.flatnonzero(~network.is_ignored), network.measures
    if not len(rows):
        raise InputError(phrase("format.missing", what="measures that are not ignored"), file=path)
    bad = rows[~(np.isfinite(own.sample[rows]) & np.isfinite(own.line[rows]))]
    if bad.size:
        point = network.points.ids[network.point_of_measure[bad[0]]]
        raise InputError(phrase("isis.measure", point=point), file=path)
    points, image_points = np.unique(network.point_of_measure[rows], return_inverse=True)
    photos, xy, sd = np.zeros(len(rows), np.int64), np.zeros((len(rows), 2)), np.zeros(len(rows))
    of_serial = dict(zip(own.serials, rows_of_each(own.serial[rows], len(own.serials)), strict=True))
    first = 0
    for each in images:
        mine = of_serial[each.serial]
        which, xy[mine] = each.supported.coordinates(own.sample[rows[mine]], own.line[rows[mine]])
        photos[mine], sd[mine] = first + which, PITCHES * each.pitch
        first += len(each.supported.timed)
    return _Seen(rows, points, image_points, photos, xy, sd)


def _starts(network: ControlNetwork, images: list[Image], seen: _Seen, place: Place) -> Floats:
    """Return (n, 3) initial X, Y, Z: preferably a-priori ones, adjusted ones, or mean ray intersections.

    They are required for fixed and constrained points.
    """
    points = network.points
    apriori, adjusted = points.apriori[seen.points], points.adjusted[seen.points]
    starts: Floats = np.where(np.isfinite(apriori).all(axis=1, keepdims=True), apriori, adjusted)
    unknown: Bools = np.asarray(~np.isfinite(starts).all(axis=1))
    missing = unknown & (points.is_fixed | points.is_constrained)[seen.points]
    if missing.any():
        raise place.error(phrase("isis.coordinates", point=points.ids[seen.points[np.argmax(missing)]]))
    sums, counts = np.zeros_like(starts), np.zeros(len(starts))
    measures, asked = network.measures, np.flatnonzero(unknown[seen.image_points])
    groups = rows_of_each(measures.serial[seen.measures[asked]], len(measures.serials))
    of_serial = dict(zip(measures.serials, groups, strict=True))
    for each in images:
        rows = asked[of_serial[each.serial]]
        own = seen.measures[rows]
        met = each.supported.to_ground(measures.line[own], measures.sample[own])
        np.add.at(sums, seen.image_points[rows], met)
        np.add.at(counts, seen.image_points[rows], 1.0)
    starts[unknown] = (sums / np.maximum(counts, 1.0)[:, np.newaxis])[unknown]
    return starts


def _project(contents: PlanetaryContents, seen: _Seen, messages: list[Message]) -> Project:
    spheroid = None
    if contents.settings.axes == "latitudinal":
        a, b = contents.different[0].supported.isd.radii
        spheroid = Spheroid((2 * a + b) / 3, (2 * a + b) / 3)
    timed = [each for own in contents.different for each in own.supported.timed]
    flown = [own.supported.flown for own in contents.different for _ in own.supported.timed]
    # Approximate poses: of frames, and of the first lines of scanners.
    times = [each.time or 0.0 if each.lines is None else each.lines.times([0.0])[0] for each in timed]
    found = [about(own, float(time)) for own, time in zip(flown, times, strict=True)]
    axes = Cartesian(spheroid)
    centres = axes.from_cartesian(np.array([centre for centre, _ in found]))
    matrices = axes.to_local(np.array([matrix for _, matrix in found]), centres)
    block = BlockBuilder(contents.path, FORMATS["isis"].title)
    block.messages += messages
    of_photos = list[int]()
    for image in contents.different:
        isd = image.supported.isd
        key = isd.platform, isd.sensor, isd.focal_length
        if key not in block.camera_rows:
            block.camera(image.supported.camera, pixel_mm=image.pitch, key=key)
        of_photos += [block.camera_rows[key]] * len(image.supported.timed)
    block.photos([each.photo for each in timed], of_photos, centres, matrices)
    _add_points(block, contents, seen.points, spheroid)
    block.messages += map(Message, contents.settings.remarks)
    if contents.settings.rejects:
        block.messages.append(Message.of("isis.rejection"))
    block.images(seen.image_photos, seen.image_points, seen.xy, np.column_stack([seen.sd, seen.sd]))
    fields = {"number": PITCHES, "unit": "px", "option": option_sd("images")}
    block.lacks.append(Phrase("read.images", fields))
    details = {DETAILS: contents, "further inputs": [each.path for each in contents.different]}
    title = contents.network.network_id or ""
    return block.project(details=details, title=title, timed=timed, spheroid=spheroid)
