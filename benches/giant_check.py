"""Plant one error in each of many simulated projects; count what `giant check` names, and what is false."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogram import Block, adjust, diagnose, simulate
from photogram.diagnosis import Finding
from photogram.giant import Project
from photogram.network.geometry import Spheroid

GULF = {"spheroid": Spheroid.clarke_1866(), "origin": (math.radians(-95), math.radians(29.5), 0.0)}


@dataclass(frozen=True)
class Planted:
    """A block with an error, and what a finding must name to have found it.

    Attributes
    ----------
    block
        The block.
    targets
        The errors: for each the photos and the points that a grave finding of it names, all of them. A photo
        or point that is in no target is innocent.
    kinds
        For each target the kinds of finding that count; empty for any.
    test
        The test value to be expected of the one error, its size x root of redundancy number / standard
        deviation; NaN where it is not known.
    """

    block: Block
    targets: list[set[str]]
    kinds: list[set[str]]
    test: float = math.nan


def main() -> None:
    """Print how many planted errors are named, and how many grave findings are false."""
    arguments = parser().parse_args()
    print(f"Projects {arguments.first} to {arguments.first + arguments.projects - 1} of every kind.\n")
    print(
        "| planted | projects | errors | named | projects with false grave findings | false grave findings |"
    )
    print("|---|---:|---:|---:|---:|---:|")
    for name, plant in KINDS.items():
        if arguments.kinds and name not in arguments.kinds:
            continue
        rows = [
            outcome(plant, seed, arguments.verbose) for seed in seeds(arguments.first, arguments.projects)
        ]
        errors, named, false = (sum(row[k] for row in rows) for k in range(3))
        spoilt = sum(row[2] > 0 for row in rows)
        print(f"| {name} | {len(rows)} | {errors} | {named} | {spoilt} | {false} |", flush=True)


def parser() -> argparse.ArgumentParser:
    """Describe the options."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--projects", type=int, default=40, help="projects of every kind of error")
    options.add_argument("--first", type=int, default=1000, help="number of the first project: its seed")
    options.add_argument("--verbose", action="store_true", help="print what is not named and what is false")
    options.add_argument("kinds", nargs="*", metavar="KIND", help="kinds of error; all by default")
    return options


def seeds(first: int, number: int) -> range:
    """Return the seeds of some projects."""
    return range(first, first + number)


def project(seed: int) -> Block:
    """Simulate a project: its size, density, space, sense and control follow from the seed."""
    choice = np.random.default_rng([seed, 1])
    return simulate(
        strips=int(choice.integers(2, 5)),
        photos_per_strip=int(choice.integers(5, 10)),
        points_per_photo=int(choice.integers(20, 60)),
        side_overlap=float(choice.choice([0.2, 0.3, 0.6])),
        control_spacing=int(choice.integers(2, 5)),
        control_sd=float(choice.choice([0.05, 0.5])),
        photo_to_ground=bool(choice.integers(2)),
        seed=seed,
        **(GULF if choice.integers(2) else {}),
    ).block


def outcome(
    plant: Callable[[Block, np.random.Generator], Planted], seed: int, verbose: bool
) -> tuple[int, ...]:
    """Return the errors planted, those that are named, and the grave findings that name no error."""
    planted = plant(project(seed), np.random.default_rng([seed, 2]))
    found = diagnose(Project.from_block(planted.block), threads=1)
    named = [
        any(hits(finding, target, kinds) for finding in found.grave)
        for target, kinds in zip(planted.targets, planted.kinds, strict=True)
    ]
    false = [finding for finding in found.grave if not explained(finding, planted)]
    if verbose and (not all(named) or false):
        print(
            f"  seed {seed}: {[t for t, n in zip(planted.targets, named, strict=True) if not n]} not named,"
            f" {len(false)} false; planted {planted.targets if len(str(planted.targets)) < 80 else '...'}"
            + ("" if math.isnan(planted.test) else f", expected test value {planted.test:.1f}")
        )
        for finding in false[:3]:
            print(f"    false: {finding.kind}: {finding.text[:150]}")
    return len(named), sum(named), len(false)


def hits(finding: Finding, target: set[str], kinds: set[str]) -> bool:
    """Whether a finding names an error."""
    return target <= {*finding.photos, *finding.points} and (not kinds or finding.kind in kinds)


def explained(finding: Finding, planted: Planted) -> bool:
    """Whether a grave finding is about a planted error: of its kind, or naming nothing else."""
    guilty = set().union(*planted.targets) if planted.targets else set()
    names = {*finding.points} or {*finding.photos}
    if any(
        hits(finding, target, kinds) for target, kinds in zip(planted.targets, planted.kinds, strict=True)
    ):
        return True
    # The guide's own hint at a wrong sign or kappa is right to name the photo.
    if finding.kind == "control-above-camera":
        return guilty.issuperset(finding.photos)
    return bool(names) and names <= guilty


def clean(block: Block, rng: np.random.Generator) -> Planted:
    """Plant nothing."""
    return Planted(block, [], [])


def image_error(size: float) -> Callable[[Block, np.random.Generator], Planted]:
    """Plant an error of one image coordinate of a point with three rays or more."""

    def plant(block: Block, rng: np.random.Generator) -> Planted:
        return with_image_error(block, rng, size, [])

    return plant


def with_image_error(block: Block, rng: np.random.Generator, size: float, others: list[set[str]]) -> Planted:
    """Add an image error of a size in millimetres to a block that has other errors already."""
    guilty = set().union(*others) if others else set()
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    several = np.flatnonzero(rays[block.image_points] >= 3)
    rows = [
        row
        for row in rng.permutation(several).tolist()
        if not guilty & {block.photo_ids[block.image_photos[row]], block.point_ids[block.image_points[row]]}
    ]
    xy = block.image_xy.copy()
    xy[rows[0], rng.integers(2)] += size * rng.choice([-1, 1])
    photo, point = block.photo_ids[block.image_photos[rows[0]]], block.point_ids[block.image_points[rows[0]]]
    return Planted(block.replace(image_xy=xy), [*others, {photo, point}], [set()] * (len(others) + 1))


def exchanged_names(block: Block, rng: np.random.Generator) -> Planted:
    """Exchange two points on a photo."""
    photo = int(rng.integers(len(block.photo_ids)))
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    own = np.flatnonzero((block.image_photos == photo) & (rays[block.image_points] >= 3))
    one, other = rng.permutation(own)[:2].tolist()
    xy = block.image_xy.copy()
    xy[[one, other]] = xy[[other, one]]
    target = {block.photo_ids[photo], *(block.point_ids[block.image_points[row]] for row in (one, other))}
    return Planted(block.replace(image_xy=xy), [target], [{"exchanged-points"}])


def mirrored_photo(axis: int) -> Callable[[Block, np.random.Generator], Planted]:
    """Change the sign of x or of y on one photo."""

    def plant(block: Block, rng: np.random.Generator) -> Planted:
        photo = int(rng.integers(len(block.photo_ids)))
        xy = block.image_xy.copy()
        xy[block.image_photos == photo, axis] *= -1
        name = block.photo_ids[photo]
        return Planted(block.replace(image_xy=xy), [{name}], [{"mirrored", "bad-photo"}])

    return plant


def mirrored_block(axis: int) -> Callable[[Block, np.random.Generator], Planted]:
    """Change the sign of x or of y on all photos."""

    def plant(block: Block, rng: np.random.Generator) -> Planted:
        xy = block.image_xy.copy()
        xy[:, axis] *= -1
        return Planted(block.replace(image_xy=xy), [set(block.photo_ids)], [{"mirrored"}])

    return plant


def exchanged_control(block: Block, rng: np.random.Generator) -> Planted:
    """Exchange the coordinates of two control points."""
    return Planted(*_exchanged_control(block, rng), [set()])


def _exchanged_control(block: Block, rng: np.random.Generator) -> tuple[Block, list[set[str]]]:
    full = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    one, other = rng.permutation(full[rays[full] >= 2])[:2].tolist()
    positions = block.point_positions.copy()
    positions[[one, other]] = positions[[other, one]]
    return block.replace(point_positions=positions), [{block.point_ids[one], block.point_ids[other]}]


def exchanged_control_and_image(block: Block, rng: np.random.Generator) -> Planted:
    """Exchange two control points, and move an image by a millimetre."""
    exchanged, targets = _exchanged_control(block, rng)
    return with_image_error(exchanged, rng, 1.0, targets)


def wrong_control(size: float) -> Callable[[Block, np.random.Generator], Planted]:
    """Move one control point in one axis, in metres."""

    def plant(block: Block, rng: np.random.Generator) -> Planted:
        full = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
        rays = np.bincount(block.image_points, minlength=len(block.point_ids))
        point, axis = int(rng.permutation(full[rays[full] >= 2])[0]), int(rng.integers(3))
        positions = block.point_positions.copy()
        error = size / (6.4e6 if block.geographic and axis < 2 else 1)
        positions[point, axis] += error
        redundancy = float(adjust(block, threads=1).point_redundancy[point, axis])
        test = error * math.sqrt(redundancy) / float(block.point_sd[point, axis])
        return Planted(block.replace(point_positions=positions), [{block.point_ids[point]}], [set()], test)

    return plant


def turned_photo(block: Block, rng: np.random.Generator) -> Planted:
    """Turn the kappa of one photo by 180 degrees."""
    photo = int(rng.integers(len(block.photo_ids)))
    attitudes = block.photo_attitudes.copy()
    attitudes[photo, 2] += math.pi
    return Planted(block.replace(photo_attitudes=attitudes), [{block.photo_ids[photo]}], [{"kappa"}])


def scrambled_photo(block: Block, rng: np.random.Generator) -> Planted:
    """Give the images of one photo the names of each other at random."""
    photo = int(rng.integers(len(block.photo_ids)))
    rows = np.flatnonzero(block.image_photos == photo)
    xy = block.image_xy.copy()
    xy[rows] = xy[rng.permutation(rows)]
    return Planted(block.replace(image_xy=xy), [{block.photo_ids[photo]}], [{"bad-photo"}])


def displaced_station(block: Block, rng: np.random.Generator) -> Planted:
    """Displace the initial station of one photo by 2 km: no error of a measurement, to be named as such."""
    photo = int(rng.integers(len(block.photo_ids)))
    positions = block.photo_positions.copy()
    positions[photo, 0] += 2000 / (6.4e6 if block.geographic else 1)
    return Planted(block.replace(photo_positions=positions), [{block.photo_ids[photo]}], [set()])


KINDS: dict[str, Callable[[Block, np.random.Generator], Planted]] = {
    "nothing": clean,
    "image 0.2 mm": image_error(0.2),
    "image 1 mm": image_error(1.0),
    "image 10 mm": image_error(10.0),
    "exchanged names": exchanged_names,
    "mirrored photo, x": mirrored_photo(0),
    "mirrored photo, y": mirrored_photo(1),
    "mirrored block, x": mirrored_block(0),
    "mirrored block, y": mirrored_block(1),
    "kappa of a photo 180 deg": turned_photo,
    "names of a photo scrambled": scrambled_photo,
    "initial station 2 km off": displaced_station,
    "control 5 m": wrong_control(5.0),
    "control 500 m": wrong_control(500.0),
    "exchanged control": exchanged_control,
    "exchanged control, image 1 mm": exchanged_control_and_image,
}

if __name__ == "__main__":
    main()
