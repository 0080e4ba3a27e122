"""Mistakes in units, axes and angles of observations, photos and points by trial.

Such a mistake makes every observation look wrong. So the check searches for it first and reports it once.
Later steps use corrected values; the data are not changed.

The criterion is the ratio of the misfit m under a hypothesis to the misfit of the given data
(:mod:`photogram.diagnosis.predictions`). `docs/hints.md` lists hypotheses and limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.mistakes import Proposal, View
from photogram.diagnosis.predictions import (
    EACH,
    MOST,
    SUSPICION,
    UNKNOWN,
    Predicted,
    control_misfit,
    eligible,
    given_points,
    misfits,
    predict,
    regressions,
    spread,
    view,
)
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.network.attitudes import Attitudes, Representation, angles_form
from photogram.network.block import Block, checked
from photogram.network.film_reduction import as_seen
from photogram.network.motion import at_rest
from photogram.network.observations import Distance
from photogram.network.rays import Rays
from photogram.words import Phrase, phrase

BAR_FACTOR, BAR_WITHIN, BAR_EACH = 1000.0, 0.05, float(np.log(2))
"""Factor between metres and millimetres; limits of the median, and of the logarithm of each distance."""


def hints(block: Block) -> list[Message]:
    """Return mistakes in data conventions that would explain the misfit.

    The block must have positions and attitudes of photos, which may be rough; otherwise InputError is raised.
    Photos on trajectories are skipped, because a single pose is undefined.
    """
    rest = at_rest(as_seen(block)) if isinstance(block, Block) else block
    if rest is not block and not len(rest.image_xy):
        return []
    with np.errstate(all="ignore"):
        block = View.of(checked(rest)).seen
        bar = distances_in_millimetres(block)
        return [Message(each.message) for each in (*verdicts(block), bar) if each is not None]


def verdicts(block: Block) -> list[Predicted]:
    """Return verdicts on observations compared with predictions; see :func:`hints`."""
    photos = eligible(block)
    if not len(photos):
        return []
    seen, chosen = misfits(view(block, photos), photos), spread(photos, MOST)
    looked, common = view(block, chosen), bool(np.median(seen) > SUSPICION)
    if common:
        tried = hypotheses(looked, regressions(looked, chosen))
        if (found := predict(tried, looked, partial(misfits, photos=chosen))) is not None:
            return [found]
    worst = photos[np.argsort(-seen)][:MOST]
    some = _of_groups(block, photos) or _single(block, np.sort(worst[np.sort(-seen)[:MOST] < -SUSPICION]))
    return some or ([] if common else _of_control(looked, chosen))


def _of_groups(block: Block, photos: Indices) -> list[Predicted]:
    """Try turned images of all photos with the same principal distance."""
    distances, found = block.known_distances("hints"), []
    for distance in np.unique(distances) if np.ptp(distances) else ():
        own, group = spread(photos[distances[photos] == distance], MOST), distances == distance
        names = [block.photo_ids[photo] for photo in np.flatnonzero(group).tolist()]
        of = {"photos": names, "distance": float(distance)}
        found.append(predict(turns(block, group), view(block, own), partial(misfits, photos=own), **of))
    return [each for each in found if each is not None]


def _of_control(looked: Block, photos: Indices) -> list[Predicted]:
    """Find hypotheses for rays that intersect well but miss the given points."""
    _, before = control_misfit(looked)

    def misfit(meant: Block) -> Floats:
        # Most observations must improve, not only the ones of a few distant points.
        found, median = control_misfit(meant)
        fits = meant is looked or (median < EACH * before and np.median(misfits(meant, photos)) < SUSPICION)
        return np.array([found if fits else UNKNOWN])

    found = predict(hypotheses(looked), looked, misfit)
    return [] if found is None else [found]


def _single(block: Block, photos: Indices) -> list[Predicted]:
    """Try photos one by one, with the other photos unchanged; join photos with the same mistake."""
    alike: dict[tuple[str, ...], Predicted] = {}
    rows = np.arange(len(block.photo_ids))
    for photo in photos.tolist():
        own = np.array([photo])
        found = predict(turns(block, rows == photo), view(block, own), partial(misfits, photos=own))
        if found is not None:
            first = alike.get((*found.names,), found)
            names = [*first.photos, block.photo_ids[photo]]
            tried = {each.name: each for each in turns(block, np.isin(block.photo_ids, names))}
            best = [tried[name] for name in found.names]
            alike[(*found.names,)] = replace(first, best=best, photos=names)
    return [*alike.values()]


def distances_in_millimetres(block: Block) -> Proposal | None:
    """Compare observed distances with coordinates, to find millimetres."""
    bars = block.observations.of_type(Distance)
    if not bars:
        return None
    place = {name: row for row, name in enumerate(block.point_ids)}
    rays = Rays.of(block)
    positions = rays.axes.positions(block.point_positions)
    positions = np.where(given_points(block)[:, np.newaxis], positions, rays.intersect().positions)
    ratios = np.array(
        [
            each.length / np.linalg.norm(positions[place[each.first]] - positions[place[each.second]])
            for each in bars
        ]
    )
    for factor, unit in ((BAR_FACTOR, "mm"), (1 / BAR_FACTOR, "m")):
        relative = ratios / factor
        if abs(np.median(relative) - 1) < BAR_WITHIN and (np.abs(np.log(relative)) < BAR_EACH).all():
            fields = {"distances": [each.name for each in bars], "times": factor}
            message = phrase(f"convention.distances.{unit}", **fields)
            return Proposal("distances", message, partial(_shorter, factor=factor))
    return None


def _shorter(block: Block, factor: float) -> Block:
    return block.replace(
        observations=[
            replace(each, length=each.length / factor) if isinstance(each, Distance) else each
            for each in block.observations
        ]
    )


EXCHANGED = (1, 0, 2)  # Order of exchanged plan coordinates
FOOT = 0.3048  # Metres; the survey foot differs by two millionths
_TO_VISION: Floats = np.diag([1.0, -1.0, -1.0])
_HALF_TURN = np.pi / 2
_OPPOSITE = str.maketrans("+-", "-+")
_BEYOND = 1e4  # Radians: no intended angle is larger after a second conversion to degrees

TURNS: dict[str, list[list[float]]] = {
    "y down": [[1, 0], [0, -1]],
    "c or kappa": [[-1, 0], [0, -1]],
    "mirrored": [[-1, 0], [0, 1]],
    "exchanged": [[0, 1], [1, 0]],
    "exchanged and turned": [[0, -1], [-1, 0]],
    "kappa + 90": [[0, -1], [1, 0]],
    "kappa - 90": [[0, 1], [-1, 0]],
}
"""V, with observed = V predicted, by the name of the mistake."""

KAPPA = {"c or kappa": 180.0, "kappa + 90": -90.0, "kappa - 90": 90.0}
"""Degrees by which kappa (ground-to-photo) is to be rotated."""

PIXELS = 8.0  # Scale of image coordinates that indicates another unit; a smaller one, a principal distance
_SCALED, _SHIFTED = 0.15, 0.25
"""Deviations of the scale from 1, and of the shift (in half formats), that rough poses cannot cause."""
_ALIKE = 0.05
"""Largest scatter over photos: of the scale (relative), and of the shift (in half formats)."""
_CORNER = 0.5  # Least distance of the centre of all observations from the origin, in half extents
_WIDEST, _FINEST = 4.0, 10.0
"""Largest half extent of image coordinates of a camera, in principal distances, and largest value of
its inverse,"""
_SCALES = 60  # number of steps in between
_EXPLAINED = 0.2  # e, largest remainder of a regression


def images_turned(block: Block, photos: Bools, turn: Floats) -> Block:
    """Return a block with V applied to the observations of (P,) photos: V' observed."""
    own = photos[block.image_photos][:, np.newaxis]
    return block.replace(image_xy=np.where(own, block.image_xy @ turn, block.image_xy))


def hypotheses(block: Block, seen: Sequence[Floats] | None = None) -> Iterator[Proposal]:
    """Yield possible mistakes of a block; `seen` compares it with predictions."""
    yield from turns(block, np.ones(len(block.photo_ids), dtype=bool))
    composed = None if seen is None else image_hypothesis(block, seen)
    if composed is not None:
        yield composed
    else:
        yield from _of_format(block)
    for name, (message, _) in attitude_readings(block).items():
        yield Proposal(name, message, partial(read_as, name=name))
    yield from _positions(block)


def turns(block: Block, photos: Bools) -> Iterator[Proposal]:
    """Yield reflections of the images of (P,) photos, and rotations of their kappa, which preserve lenses."""
    for name in TURNS:
        code, degrees = name, KAPPA.get(name)
        change = partial(images_turned, photos=photos, turn=np.array(TURNS[name], dtype=np.float64))
        if degrees is not None:
            if block.photo_to_ground and abs(degrees) < 180.0:
                degrees, code = -degrees, name.translate(_OPPOSITE)
            change = partial(_kappa_turned, photos=photos, degrees=degrees)
        yield Proposal(name, phrase(f"mistake.{code}"), change)


def _kappa_turned(block: Block, photos: Bools, degrees: float) -> Block:
    attitudes = block.photo_attitudes.copy()
    attitudes[photos, 2] += np.radians(degrees)
    return block.replace(photo_attitudes=attitudes)


def _of_images(block: Block, shift: Floats, linear: Floats) -> Block:
    """Return a block with image coordinates in another origin and other axes."""
    return block.replace(image_xy=(block.image_xy - shift) @ linear)


def image_hypothesis(block: Block, seen: Sequence[Floats]) -> Proposal | None:
    """Return another common unit, origin or sense of image coordinates by regressions, or None."""
    scales, turns_seen, shifts, rest = seen
    half = np.ptp(block.image_xy, axis=0).max() / 2
    scale, shift = float(np.median(scales)), np.median(shifts, axis=0)
    turn = np.round(np.median(turns_seen, axis=0))
    alike = (
        np.median(rest) < _EXPLAINED
        and scales.std() < _ALIKE * scale
        and np.abs(shifts - shift).max() < 4 * _ALIKE * half
        and np.abs(turns_seen - turn).max() < _SHIFTED
    )
    scaled, shifted = abs(scale - 1) > _SCALED, np.abs(shift).max() > _SHIFTED * half
    if not alike or not (scaled or shifted) or not given_points(block).any():
        return None
    back = np.zeros(2) if not shifted else shift
    linear = turn / (scale if scaled else 1.0)
    names, parts = [], []
    if scaled and max(scale, 1 / scale) >= PIXELS:
        names.append("unit")
        size = "large" if scale > 1 else "small"
        parts.append(phrase(f"mistake.unit.{size}", times=max(scale, 1 / scale), pitch=1 / scale))
    elif scaled:
        names.append("principal distance")
        parts.append(phrase("mistake.principal-distance", times=scale))
    if shifted:
        names.append("origin")
        parts.append(phrase("mistake.origin", x=-float(shift[0]), y=-float(shift[1])))
    for name, matrix in TURNS.items():
        if np.array_equal(turn, matrix):
            names.append(name)
            parts.append(phrase(f"mistake.{name}"))
    change = partial(_of_images, shift=back, linear=linear)
    return Proposal(", ".join(names), phrase("mistake.images", parts=parts), change, exact=False)


def _of_format(block: Block) -> Iterator[Proposal]:
    """Yield a corner as origin, and pixels as unit, from the observed extent."""
    lowest, highest = block.image_xy.min(axis=0), block.image_xy.max(axis=0)
    middle, half = (lowest + highest) / 2, float((highest - lowest).max() / 2)
    distance = float(block.camera_scales().max())
    corner, pixels = bool(np.abs(middle).min() > _CORNER * half), half > _WIDEST * distance
    if not (corner or pixels):
        return
    scales = np.ones(1)
    if pixels:
        scales = np.geomspace(half / (_WIDEST * distance), _FINEST * half / distance, _SCALES)
    shift = middle if corner else np.zeros(2)
    for down in (False, True):
        names = [name for name, holds in (("unit", pixels), ("origin", corner), ("y down", down)) if holds]
        for scale in scales.tolist():
            parts = [phrase(f"mistake.format.{name}", pitch=1 / scale) for name in names]
            linear = np.diag([1.0, -1.0 if down else 1.0]) / scale
            change = partial(_of_images, shift=shift, linear=linear)
            yield Proposal(", ".join(names), phrase("mistake.images", parts=parts), change, exact=False)


def attitude_readings(block: Block) -> dict[str, tuple[Phrase, Floats]]:
    """Return (P, 3, 3) attitudes from other definitions of angles, with the mistakes."""
    angles = block.photo_attitudes
    ground: Representation = "omega_phi_kappa"
    photo: Representation = "omega_phi_kappa_photo_to_ground"
    form, other = (photo, ground) if block.photo_to_ground else (ground, photo)
    phi_primary: Representation = "phi_omega_kappa"
    values: dict[str, tuple[Representation, Floats]] = {
        "radians for degrees": (form, np.degrees(angles)),
        "degrees for radians": (form, np.radians(angles)),
        "gon": (form, 0.9 * angles),
        "sense": (other, angles),
        "phi-omega-kappa": (phi_primary, angles[:, [1, 0, 2]]),
        "sign of phi": (form, angles * [1.0, -1.0, 1.0]),
        "sign of kappa": (form, angles * [1.0, 1.0, -1.0]),
    }
    if np.abs(angles).max() > _BEYOND:
        del values["radians for degrees"]
    found = {
        name: (phrase(f"mistake.{name}"), Attitudes.of(*representation).matrices)
        for name, representation in values.items()
    }
    return found | quaternion_readings(Attitudes.of(form, angles).matrices)


def quaternion_readings(matrices: Floats) -> dict[str, tuple[Phrase, Floats]]:
    """Return (P, 3, 3) attitudes from quaternions in other orders, with the mistakes."""
    found = {}
    forms: tuple[Representation, ...] = ("quaternion", "quaternion_to_vision")
    for form in forms:
        known = Attitudes(matrices).values(form)
        for order, other, step in (("x, y, z, w", "w, x, y, z", -1), ("w, x, y, z", "x, y, z, w", 1)):
            # The numbers as read, then as intended: both have length 1.
            message = phrase("mistake.quaternions", order=order, other=other)
            found[f"{form} {order}"] = message, Attitudes.of(form, np.roll(known, -step, axis=1)).matrices
    return found


def read_as(block: Block, name: str) -> Block:
    """Return a block with another angle definition; see :func:`attitude_readings`."""
    if name == "sense":
        return block.replace(photo_to_ground=not block.photo_to_ground)
    _, matrices = attitude_readings(block)[name]
    return block.replace(photo_attitudes=Attitudes(matrices).values(angles_form(block.photo_to_ground)))


def with_coordinates(
    block: Block,
    of: str,
    order: Sequence[int] = (0, 1, 2),
    factors: ArrayLike = 1.0,
    rows: Bools | None = None,
) -> Block:
    """Return a block with coordinates of `points` or `photos` in another order, and scaled.

    `rows` are the points concerned; None: all.
    """
    order, factors = [*order], np.asarray(factors, dtype=np.float64)
    if of == "points":
        chosen = np.ones(len(block.point_ids), dtype=bool) if rows is None else rows
        positions = np.where(
            chosen[:, np.newaxis], block.point_positions[:, order] * factors, block.point_positions
        )
        return block.replace(point_positions=positions, point_sd=block.point_sd[:, order])
    observed = block.photo_positions_observed
    return block.replace(
        photo_positions=block.photo_positions[:, order] * factors,
        photo_position_sd=block.photo_position_sd[:, order],
        photo_positions_observed=None if observed is None else observed[:, order] * factors,
    )


def _centres(block: Block, axes: Floats) -> Block:
    """Return a block with positions C = -R't of translations t; R = F A', F' = `axes`."""
    form = angles_form(block.photo_to_ground)
    to_photo = Attitudes.of(form, block.photo_attitudes).matrices.transpose(0, 2, 1)
    turned = block.photo_positions @ axes
    return block.replace(photo_positions=-np.einsum("pji,pj->pi", to_photo, turned))


def _positions(block: Block) -> Iterator[Proposal]:
    known = bool(given_points(block).any())
    geographic = block.spheroid is not None
    for what in ("photos", "points") if known else ("photos",):
        # Several axes at once, then single axes.
        for part, axes in (("heights", (2,)), ("positions", (0, 1, 2)), ("X", (0,)), ("Y", (1,))):
            if not geographic or axes == (2,):
                factors: Floats = np.where(np.isin(np.arange(3), axes), FOOT, 1.0)
                message = phrase(f"mistake.feet.{what}", part=part, unit=block.linear_unit)
                change = partial(with_coordinates, of=what, factors=factors)
                yield Proposal(f"feet in {part} of {what}", message, change)
    if geographic:
        for what, positions in (("photos", block.photo_positions), ("points", block.point_positions)):
            if not (np.abs(positions[:, 0]) > _HALF_TURN).any():
                yield _exchange("longitude and latitude", what)
        return
    yield _exchange("X and Y", "photos")
    # R = F A' in the axes of computer vision, A' in the axes of the photo
    for axes_of_t, matrix in (
        ("x right, y down, z forward", _TO_VISION),
        ("x right, y up, z back", np.eye(3)),
    ):
        message = phrase("mistake.translations", axes=axes_of_t)
        yield Proposal("t for C", message, partial(_centres, axes=matrix))
    if known:
        yield _exchange("X and Y", "points")


def _exchange(axes: str, of: str) -> Proposal:
    change = partial(with_coordinates, of=of, order=EXCHANGED)
    return Proposal(f"{axes} of {of}", phrase("mistake.exchanged-axes", axes=f"{axes} of {of}"), change)
