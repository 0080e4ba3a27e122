"""What may be wrong with given data, each as what makes of a block the one that would have been meant."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.diagnosis.regression import Regression, given_points
from photogram.lazy_dataclasses import dataclass
from photogram.network.attitudes import Attitudes, Representation
from photogram.network.block import Block

FOOT = 0.3048
"""Metres; the survey foot differs by two millionths."""
_TO_VISION: Floats = np.diag([1.0, -1.0, -1.0])
_HALF_TURN = np.pi / 2
_BEYOND = 1e4
"""Radians: no angle that was meant is larger after it was turned into degrees once more."""

TURNS: dict[str, tuple[list[list[float]], str]] = {
    "y down": ([[1, 0], [0, -1]], "y of the images has the wrong sign: it is counted down, not up"),
    "c or kappa": (
        [[-1, 0], [0, -1]],
        "the principal distance has the wrong sign, or kappa is wrong by 180 degrees",
    ),
    "mirrored": (
        [[-1, 0], [0, 1]],
        "x of the images has the wrong sign: the photos are mirrored, as diapositives read from behind",
    ),
    "exchanged": ([[0, 1], [1, 0]], "x and y of the images are exchanged"),
    "exchanged and turned": (
        [[0, -1], [-1, 0]],
        "x and y of the images are exchanged, and have the wrong signs",
    ),
    "kappa + 90": ([[0, -1], [1, 0]], "kappa is too large by 90 degrees, or the images were turned"),
    "kappa - 90": ([[0, 1], [-1, 0]], "kappa is too small by 90 degrees, or the images were turned"),
}
"""V, observed = V predicted, and what brings it about."""

PIXELS = 8.0
"""Images so many times too large, or more, are in another unit; less is a principal distance."""
_SCALED, _SHIFTED = 0.15, 0.25
"""A scale further from 1, a shift of a larger part of half of the format are no matter of rough poses."""
_ALIKE = 0.05
"""Scatter of the scale over photos, relative, and of the shift, in halves of the format, at the most."""
_CORNER = 0.5
"""The middle of all images is further from the origin than this part of half of their extent."""
_WIDEST, _FINEST = 4.0, 10.0
"""Half of the extent of images, in principal distances, beyond which they are wider than a camera's, and what
its inverse may be at the most,"""
_SCALES = 60
"""with so many steps in between."""
_EXPLAINED = 0.2
"""e, what a regression leaves, at the most."""


Change = Callable[[Block], Block]
"""Makes of a block as given the one that was meant."""


def turn_of(name: str) -> Floats:
    """(2, 2) V of one of the turns."""
    return np.array(TURNS[name][0], dtype=np.float64)


def images_turned(block: Block, photos: Bools, turn: Floats) -> Block:
    """Return a block with the images of (P,) some photos turned back: V' observed."""
    own = photos[block.image_photos][:, np.newaxis]
    return block.replace(image_xy=np.where(own, block.image_xy @ turn, block.image_xy))


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A mistake that may have been made."""

    name: str  # In a word or two
    text: str  # In a sentence, without its full stop
    change: Change  # Makes of a block, or of a part of its photos, what was meant
    # Whether that is exactly what was meant: a size of pixels and an origin are only known about
    exact: bool = True


def hypotheses(block: Block, seen: Regression | None = None) -> Iterator[Hypothesis]:
    """Propose mistakes for a block; `seen` says how its images and their predictions differ."""
    every = np.ones(len(block.photo_ids), dtype=bool)
    for name, (_, text) in TURNS.items():
        yield Hypothesis(name, text, partial(images_turned, photos=every, turn=turn_of(name)))
    composed = None if seen is None else image_hypothesis(block, seen)
    if composed is not None:
        yield composed
    else:
        yield from _of_format(block)
    for name, (text, _) in attitude_readings(block).items():
        yield Hypothesis(name, text, partial(read_as, name=name))
    yield from _positions(block)


def _of_images(block: Block, shift: Floats, linear: Floats) -> Block:
    """Return a block with images counted from another origin and in other axes."""
    return block.replace(image_xy=(block.image_xy - shift) @ linear)


def image_hypothesis(block: Block, seen: Regression) -> Hypothesis | None:
    """Propose another unit, origin or sense of images, from what photos have in common; else None."""
    half = np.ptp(block.image_xy, axis=0).max() / 2
    scale, shift = float(np.median(seen.scale)), np.median(seen.shift, axis=0)
    turn = np.round(np.median(seen.turn, axis=0))
    alike = (
        np.median(seen.rest) < _EXPLAINED
        and seen.scale.std() < _ALIKE * scale
        and np.abs(seen.shift - shift).max() < 4 * _ALIKE * half
        and np.abs(seen.turn - turn).max() < _SHIFTED
    )
    scaled, shifted = abs(scale - 1) > _SCALED, np.abs(shift).max() > _SHIFTED * half
    if not alike or not (scaled or shifted) or not given_points(block).any():
        return None
    back = np.zeros(2) if not shifted else shift
    linear = turn / (scale if scaled else 1.0)
    names, parts = [], []
    if scaled and max(scale, 1 / scale) >= PIXELS:
        names.append("unit")
        parts.append(
            f"images are {scale:.4g} times too large for the principal distance: pixels given for millimetres"
            f" (of {1 / scale:.4g} mm)"
            if scale > 1
            else f"images are {1 / scale:.4g} times too small for the principal distance: another unit"
        )
    elif scaled:
        names.append("principal distance")
        parts.append(
            f"the principal distance should be {scale:.4g} times the given one (another unit, or that of"
            " another format)"
        )
    if shifted:
        names.append("origin")
        parts.append(
            f"images are counted from ({-shift[0]:+.4g}, {-shift[1]:+.4g}), a corner and not the middle of"
            " the format"
        )
    for name, (matrix, text) in TURNS.items():
        if np.array_equal(turn, matrix):
            names.append(name)
            parts.append(text)
    return Hypothesis(
        ", ".join(names), "; ".join(parts), partial(_of_images, shift=back, linear=linear), exact=False
    )


def _of_format(block: Block) -> Iterator[Hypothesis]:
    """Propose a corner for the origin, and pixels, from how far images reach: where few points are given."""
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
    for turn, sense in (([1.0, 1.0], ""), ([1.0, -1.0], ", and y is counted down, not up")):
        names = ["unit"] * pixels + ["origin"] * corner + ["y down"] * bool(sense)
        where = "a corner and not the middle of the format"
        for scale in scales.tolist():
            unit = f"images are pixels (of about {1 / scale:.2g} mm)" if pixels else "images are"
            counted = f"{', ' if pixels else ' '}counted from {where}" if corner else ""
            text = unit + counted + sense
            linear = np.diag(turn) / scale
            change = partial(_of_images, shift=shift, linear=linear)
            yield Hypothesis(", ".join(names), text, change, exact=False)


def attitude_readings(block: Block) -> dict[str, tuple[str, Floats]]:
    """(P, 3, 3) attitudes, photo to object, by rival readings of the same three numbers, with their texts."""
    numbers = block.photo_attitudes
    own: Representation = "omega_phi_kappa"
    other: Representation = "omega_phi_kappa_photo_to_ground"
    meant, said = "photo-to-ground", "ground-to-photo"
    if block.photo_to_ground:
        own, other, meant, said = other, own, said, meant

    def read(representation: Representation, values: Floats) -> Floats:
        return Attitudes.of(representation, values).matrices

    flipped = numbers * [1.0, -1.0, 1.0]
    found = {
        "radians for degrees": (
            "angles were given in radians and read as degrees",
            read(own, np.degrees(numbers)),
        ),
        "degrees for radians": (
            "angles were given in degrees and read as radians",
            read(own, np.radians(numbers)),
        ),
        "gon": ("angles were given in gon and read as degrees", read(own, 0.9 * numbers)),
        "sense": (f"angles are {meant}, not {said}", read(other, numbers)),
        "phi-omega-kappa": (
            "the angles omega, phi, kappa are those of phi-omega-kappa (phi primary)",
            read("phi_omega_kappa", numbers[:, [1, 0, 2]]),
        ),
        "sign of phi": ("phi has the wrong sign", read(own, flipped)),
        "sign of kappa": ("kappa has the wrong sign, as yaw has", read(own, numbers * [1.0, 1.0, -1.0])),
    }
    matrices = read(own, numbers)
    found |= quaternion_readings(matrices)
    if np.abs(numbers).max() > _BEYOND:
        del found["radians for degrees"]
    return found


def quaternion_readings(matrices: Floats) -> dict[str, tuple[str, Floats]]:
    """(P, 3, 3) attitudes by the numbers of their quaternions in rival orders, with their texts, by names."""
    found = {}
    forms: tuple[Representation, ...] = ("quaternion", "quaternion_to_vision")
    for form in forms:
        known = Attitudes(matrices).values(form)
        for given, said, order in (("x, y, z, w", "w, x, y, z", -1), ("w, x, y, z", "x, y, z, w", 1)):
            # The numbers as they were read, then as they were meant: both have length 1.
            text = f"quaternions were given in the order {given} and read as {said}"
            found[f"{form} {given}"] = text, Attitudes.of(form, np.roll(known, -order, axis=1)).matrices
    return found


def read_as(block: Block, name: str) -> Block:
    """Return a block whose attitudes are read in another way; see :func:`attitude_readings`."""
    _, matrices = attitude_readings(block)[name]
    form: Representation = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
    return block.replace(photo_attitudes=Attitudes(matrices).values(form))


def _scaled(block: Block, photos: Floats | None = None, points: Floats | None = None) -> Block:
    """Return a block with the axes of its positions scaled."""
    if points is not None:
        return block.replace(point_positions=block.point_positions * points)
    observed = block.photo_positions_observed
    if photos is None:
        return block
    return block.replace(
        photo_positions=block.photo_positions * photos,
        photo_positions_observed=None if observed is None else observed * photos,
    )


def _exchanged(block: Block, *, points: bool) -> Block:
    """Return a block with the first two coordinates of photos or of points exchanged."""
    order = [1, 0, 2]
    if points:
        return block.replace(
            point_positions=block.point_positions[:, order], point_sd=block.point_sd[:, order]
        )
    observed = block.photo_positions_observed
    return block.replace(
        photo_positions=block.photo_positions[:, order],
        photo_position_sd=block.photo_position_sd[:, order],
        photo_positions_observed=None if observed is None else observed[:, order],
    )


def _centres(block: Block, axes: Floats) -> Block:
    """Return a block whose positions are C = -R't of translations t; R = F A', F' = `axes`."""
    turned = block.photo_positions @ axes
    return block.replace(photo_positions=-np.einsum("pji,pj->pi", _to_photo(block), turned))


def _positions(block: Block) -> Iterator[Hypothesis]:
    known = bool(given_points(block).any())
    geographic = block.spheroid is not None
    for what, own in (("photos", True), ("points", False)):
        if not (own or known):
            continue
        others = "points" if own else "photos"
        # Several at once, then single axes.
        for name, axes, text in (
            (f"feet in heights of {what}", (2,), f"heights of the {what} are in feet, all else in metres"),
            (
                f"feet in positions of {what}" if own else "feet in points",
                (0, 1, 2),
                f"positions of the {what} are in feet, those of the {others} in metres"
                f" (in {block.linear_unit} here)",
            ),
            (f"feet in X of {what}", (0,), f"X of the {what} are in feet, all else in metres"),
            (f"feet in Y of {what}", (1,), f"Y of the {what} are in feet, all else in metres"),
        ):
            if not geographic or axes == (2,):
                factor: Floats = np.where(np.isin(np.arange(3), axes), FOOT, 1.0)
                change = partial(_scaled, photos=factor) if own else partial(_scaled, points=factor)
                yield Hypothesis(name, text, change)
    if geographic:
        yield from _geographic(block)
        return
    yield Hypothesis(
        "X and Y of photos", "X and Y of the photos are exchanged", partial(_exchanged, points=False)
    )
    # R = F A' in the axes of computer vision, A' in those of the photo
    for said, of_axes in (("x right, y down, z forward", _TO_VISION), ("x right, y up, z back", np.eye(3))):
        yield Hypothesis(
            "t for C",
            f"positions of the photos are translations t of x = R X + t ({said}), not projection centres"
            " C = -R't",
            partial(_centres, axes=of_axes),
        )
    if known:
        yield Hypothesis(
            "X and Y of points", "X and Y of the points are exchanged", partial(_exchanged, points=True)
        )


def _to_photo(block: Block) -> Floats:
    """(P, 3, 3) M, object to photo."""
    form: Representation = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
    matrices: Floats = Attitudes.of(form, block.photo_attitudes).matrices.transpose(0, 2, 1)
    return matrices


def _geographic(block: Block) -> Iterator[Hypothesis]:
    for what, positions in (("photos", block.photo_positions), ("points", block.point_positions)):
        if not (np.abs(positions[:, 0]) > _HALF_TURN).any():
            text = f"longitude and latitude of the {what} are exchanged"
            change = partial(_exchanged, points=what == "points")
            yield Hypothesis(f"longitude and latitude of {what}", text, change)
