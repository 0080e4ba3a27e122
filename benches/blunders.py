"""Plant gross errors in simulated blocks and take them out: how many are found, what is lost, what remains.

`--blocks 200` prints the table of docs/blunders.md, with the processor time of a block of each row; `--time
20x50` the time of snooping beside a plain adjustment of a large block with one percent of gross errors;
`--pairs` how exchanged names are reported.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogram import Block, Result, adjust, simulate, snoop
from photogram.errors import AdjustmentError
from photogram.results.snooping_result import Snooped

SMALLEST, LARGEST = 4.0, 100.0
"""Of the planted errors, in standard deviations."""


@dataclass(frozen=True)
class Planted:
    """A block with gross errors.

    Attributes
    ----------
    block
        The block.
    images, control
        Which images and points have them.
    """

    block: Block
    images: frozenset[int] = frozenset()
    control: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Outcome:
    """What has become of a block.

    Attributes
    ----------
    planted, found
        Gross errors, and how many of them are out or named as what cannot be told apart from what is out.
    testable, found_testable
        The same of those that are large enough for the test of their own group: an expected T of 1.5 times
        that which is found in 80 of 100 cases.
    false, disputed
        Good observations that were taken out, and those of them whose rival, named, was the bad one.
    sigma0
        The standard deviation of unit weight that remains.
    error, error_before
        Root mean square of (adjusted - true) / standard deviation of the coordinates of points, after
        snooping and with the gross errors; standard deviations a priori.
    """

    planted: int
    found: int
    testable: int
    found_testable: int
    false: int
    disputed: int
    sigma0: float
    error: float
    error_before: float


def clean(block: Block, random: np.random.Generator) -> Planted:
    """Plant nothing."""
    return Planted(block)


def share(part: float) -> Callable[[Block, np.random.Generator], Planted]:
    """Return what plants errors in a share of the images, in any direction."""

    def plant(block: Block, random: np.random.Generator) -> Planted:
        bad = np.flatnonzero(random.random(len(block.image_xy)) < part)
        size = random.uniform(SMALLEST, LARGEST, len(bad)) * block.image_sd[bad, 0]
        angle = random.uniform(0, math.tau, len(bad))
        xy = block.image_xy.copy()
        xy[bad] += size[:, np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return Planted(block.replace(image_xy=xy), frozenset(bad.tolist()))

    return plant


def wrong_names(block: Block, random: np.random.Generator) -> Planted:
    """Exchange the names of two points on a photo."""
    photo = int(random.integers(len(block.photo_ids)))
    a, b = random.choice(np.flatnonzero(block.image_photos == photo), 2, replace=False).tolist()
    xy = block.image_xy.copy()
    xy[[a, b]] = xy[[b, a]]
    return Planted(block.replace(image_xy=xy), frozenset({a, b}))


def scrambled_names(block: Block, random: np.random.Generator) -> Planted:
    """Give the images of a photo each other's names."""
    photo = int(random.integers(len(block.photo_ids)))
    own = np.flatnonzero(block.image_photos == photo)
    other = random.permutation(own)
    xy = block.image_xy.copy()
    xy[own] = xy[other]
    return Planted(block.replace(image_xy=xy), frozenset(own[own != other].tolist()))


def wrong_control(block: Block, random: np.random.Generator) -> Planted:
    """Put an error of 4 to 100 standard deviations into a coordinate of a control point."""
    point = int(random.choice(np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))))
    axis = int(random.integers(3))
    positions = block.point_positions.copy()
    size = random.uniform(SMALLEST, LARGEST) * random.choice([-1, 1])
    positions[point, axis] += size * block.point_sd[point, axis]
    return Planted(block.replace(point_positions=positions), control=frozenset({point}))


CASES: dict[str, Callable[[Block, np.random.Generator], Planted]] = {
    "none": clean,
    "0.1 % of the images": share(0.001),
    "1 %": share(0.01),
    "5 %": share(0.05),
    "names of two points exchanged": wrong_names,
    "all names of a photo scrambled": scrambled_names,
    "a wrong coordinate of control": wrong_control,
}


def simulated(seed: int) -> tuple[Block, Block]:
    """Return a block of three strips of six photos, and the truth."""
    made = simulate(
        strips=3, photos_per_strip=6, points_per_photo=30, side_overlap=0.35, control_spacing=2, seed=seed
    )
    return made.block, made.truth


def outcome(plant: Callable[[Block, np.random.Generator], Planted], seed: int) -> Outcome:
    """Plant errors in a block, snoop, and compare with the truth."""
    block, truth = simulated(seed)
    planted = plant(block, np.random.default_rng([seed, 7]))
    snooped = snoop(planted.block)
    return judged(planted, block, truth, snooped, adjusted(planted.block))


def adjusted(block: Block) -> Result | None:
    """Adjust a block with its errors; None where they leave nothing to adjust."""
    try:
        return adjust(block)
    except AdjustmentError:
        return None


def judged(planted: Planted, block: Block, truth: Block, snooped: Snooped, before: Result | None) -> Outcome:
    """Compare what was taken out with what was planted."""
    image = {
        (int(point), int(photo)): row
        for row, (point, photo) in enumerate(zip(block.image_points, block.image_photos, strict=True))
    }
    bad = {
        f"image of point {block.point_ids[p]} on photo {block.photo_ids[q]}": row
        for (p, q), row in image.items()
    }
    names = {name for name, row in bad.items() if row in planted.images}
    names |= {f"control point {block.point_ids[point]}" for point in planted.control}

    def is_bad(name: str) -> bool:
        photo = name.removeprefix("all of")
        return any(name.endswith(own) or own.endswith(photo) for own in names)

    out = snooped.removed
    whole = {entry.name.removeprefix("all of") for entry in out if entry.kind == "photo"}
    named = [entry.name for entry in out]
    named += [name for name in bad if any(name.endswith(photo) for photo in whole)]
    rivals = {rival.name for entry in out for rival in entry.in_dispute}
    found = {own for own in names if any(name.endswith(own) for name in named) or own in rivals}
    false = [entry for entry in out if not is_bad(entry.name)]
    disputed = [entry for entry in false if any(is_bad(rival.name) for rival in entry.in_dispute)]
    testable = large(planted, block, names)
    variance = snooped.result.variance_of_unit_weight
    return Outcome(
        planted=len(names),
        found=len(found),
        testable=len(testable),
        found_testable=len(found & testable),
        false=len(false) - len(disputed),
        disputed=len(disputed),
        sigma0=math.sqrt(variance) if variance else math.nan,
        error=error(snooped.result, truth),
        error_before=math.inf if before is None else error(before, truth),
    )


def large(planted: Planted, block: Block, names: set[str]) -> set[str]:
    """Return the planted errors that their own group shows: d' R d of 1.5 lambda0 or more."""
    reliability = adjust(block).reliability(level=0.05 / len(block.image_xy))
    suspects, tests = reliability.suspects, reliability.tests
    number = {str(suspects.name(group)): group for group in range(len(suspects))}
    found = set()
    for name in names:
        group = number[name]
        rows = suspects.rows(group)
        if suspects.kind(group) == "image":
            image = group_image(block, name)
            shift = (planted.block.image_xy - block.image_xy)[image] / block.image_sd[image]
        else:
            point = block.point_ids.index(name.removeprefix("control point "))
            shift = (planted.block.point_positions - block.point_positions)[point] / block.point_sd[point]
        r = reliability.trial.own_block(group)
        if tests.rank[group] and shift[: len(rows)] @ r @ shift[: len(rows)] > 1.5 * reliability.lambda0(
            int(tests.rank[group])
        ):
            found.add(name)
    return found


def group_image(block: Block, name: str) -> int:
    """Return the row of an image that is called so."""
    point, photo = name.removeprefix("image of point ").split(" on photo ")
    at = (block.image_points == block.point_ids.index(point)) & (
        block.image_photos == block.photo_ids.index(photo)
    )
    return int(np.flatnonzero(at)[0])


def error(result: Result, truth: Block) -> float:
    """Return the root mean square of the errors of points over their standard deviations a priori."""
    variances = np.diagonal(result.point_cofactors, axis1=1, axis2=2)
    difference = result.point_positions - truth.point_positions
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = difference**2 / variances
    return math.sqrt(float(np.mean(ratio[np.isfinite(ratio)])))


def table(blocks: int, first: int, cases: list[str]) -> list[str]:
    """Print the table of the documentation; below it how long a block takes, and what the level promises."""
    lines = [
        "| planted | blocks | errors | found | large | found | good ones out | blocks with any | in dispute"
        " | sigma0 | error of coordinates in sd, before | after |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    print(*lines, sep="\n", flush=True)
    notes = []
    for name, plant in CASES.items():
        if cases and name not in cases:
            continue
        start = time.process_time()
        all_ = [outcome(plant, seed) for seed in range(first, first + blocks)]
        notes.append(f"{name} {(time.process_time() - start) / blocks:.2f} s")
        total = {key: sum(getattr(each, key) for each in all_) for key in ("planted", "found", "testable")}
        found_testable = sum(each.found_testable for each in all_)
        false, disputed = sum(each.false for each in all_), sum(each.disputed for each in all_)
        spoilt = sum(each.false > 0 for each in all_)

        def percent(part: int, whole: int) -> str:
            return f"{100 * part / whole:.1f} %" if whole else "-"

        lines.append(
            f"| {name} | {blocks} | {total['planted']} | {percent(total['found'], total['planted'])} |"
            f" {total['testable']} | {percent(found_testable, total['testable'])} | {false} |"
            f" {percent(spoilt, blocks)} | {disputed} | {np.median([each.sigma0 for each in all_]):.3f} |"
            f" {np.median([each.error_before for each in all_]):.2f} |"
            f" {np.median([each.error for each in all_]):.2f} |"
        )
        print(lines[-1], flush=True)
        if plant is clean:
            low, high = (100 * each for each in interval(spoilt, blocks))
            notes.append(
                f"(of {blocks} blocks without gross errors {spoilt}: {low:.1f} to {high:.1f} percent)"
            )
    print("\nProcessor time of a block, with the adjustments it is compared with: " + ", ".join(notes))
    return lines


def pairs(blocks: int, first: int) -> None:
    """Print how often exchanged names are reported as a pair, and how often a pair is that is none."""
    print("| planted | blocks | reported as the pair | on one photo of two | other pairs reported |")
    print("|---|---:|---:|---:|---:|")
    for name in ("names of two points exchanged", "none"):
        named = doubtful = others = 0
        for seed in range(first, first + blocks):
            block, _ = simulated(seed)
            planted = CASES[name](block, np.random.default_rng([seed, 7]))
            rows = sorted(planted.images) if name.endswith("exchanged") else []
            points = {block.point_ids[block.image_points[row]] for row in rows}
            for each in snoop(planted.block).exchanged:
                photo = block.photo_ids[block.image_photos[rows[0]]] if rows else ""
                is_pair = set(each.points) == points and photo in each.photos
                named, others = named + is_pair, others + (not is_pair)
                doubtful += is_pair and len(each.photos) > 1
        counts = (f"{named}", f"{doubtful}") if name.endswith("exchanged") else ("-", "-")
        print(f"| {name} | {blocks} | {counts[0]} | {counts[1]} | {others} |", flush=True)


def interval(part: int, whole: int) -> tuple[float, float]:
    """Return the 95 percent interval of a share (Wilson 1927)."""
    z, share = 1.959963984540054, part / whole
    middle = (share + z**2 / (2 * whole)) / (1 + z**2 / whole)
    half = z / (1 + z**2 / whole) * math.sqrt(share * (1 - share) / whole + z**2 / (4 * whole**2))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def times(size: str, rounds: int) -> None:
    """Print the processor time of snooping beside that of a plain adjustment, in turn, the fastest counts."""
    strips, photos = (int(part) for part in size.split("x"))
    block = simulate(strips=strips, photos_per_strip=photos, seed=1).block
    bad = share(0.01)(block, np.random.default_rng(5))
    seconds: dict[str, list[float]] = {"plain": [], "snooping": []}
    for _ in range(rounds):
        for name, work in (("plain", lambda: adjust(block)), ("snooping", lambda: snoop(bad.block))):
            start = time.process_time()
            found = work()
            seconds[name].append(time.process_time() - start)
    plain, own = min(seconds["plain"]), min(seconds["snooping"])
    assert isinstance(found, Snooped)
    print(
        f"{len(block.photo_ids)} photos, {len(block.image_xy)} images, {len(bad.images)} gross errors:"
        f" plain adjustment {plain:.2f} s, snooping {own:.2f} s of processor time, {own / plain:.1f} times;"
        f" {len(found.outcome.rounds)} rounds, {len(found.removed)} groups out"
    )


def main() -> None:
    """Print the table, or times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=200)
    parser.add_argument("--first", type=int, default=1000, help="seed of the first block")
    parser.add_argument("--cases", nargs="*", default=[], help="what to plant; everything when not given")
    parser.add_argument("--time", metavar="STRIPSxPHOTOS", help="time one large block instead")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pairs", action="store_true", help="how exchanged names are reported instead")
    arguments = parser.parse_args()
    if arguments.time:
        times(arguments.time, arguments.rounds)
        return
    if arguments.pairs:
        pairs(arguments.blocks, arguments.first)
        return
    table(arguments.blocks, arguments.first, arguments.cases)


if __name__ == "__main__":
    main()
