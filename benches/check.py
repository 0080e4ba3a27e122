"""Plant one mistake or gross error in each of many networks; count what `photogram.diagnose` names."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import giant_check as planted
from giant_check import GULF, explained, hits, seeds
from photogram import Attitudes, Block, Camera, Simulation, adjust, diagnose, simulate
from photogram.network.geometry import rotation_matrix
from photogram.network.observations import Position
from photogram.network.simulated_observations import with_distances, with_gnss
from photogram.network.unknowns import LeverArm


@dataclass(frozen=True)
class Planted(planted.Planted):
    """A network with an error; `said` is in the text of a finding that names a mistake of a whole set."""

    said: str = ""


Plant = Callable[[int, np.random.Generator], planted.Planted]
EXPECTED = 10.0
"""Test value to be expected of an error whose size is chosen by what checks it."""


def main() -> None:
    """Print how many planted errors are named, and how many grave findings are false."""
    arguments = parser().parse_args()
    print(f"Networks {arguments.first} to {arguments.first + arguments.networks - 1} of every kind.\n")
    print("| planted | networks | named rightly | with false grave findings |")
    print("|---|---:|---:|---:|")
    total = np.zeros(3, dtype=int)
    for name, plant in KINDS.items():
        if arguments.kinds and name not in arguments.kinds:
            continue
        rows = [
            outcome(plant, seed, arguments.verbose) for seed in seeds(arguments.first, arguments.networks)
        ]
        counts = np.array([(1, named, false > 0) for named, false in rows]).sum(axis=0)
        named = f"{counts[1]}" if name != "nothing" else "-"
        print(f"| {name} | {counts[0]} | {named} | {counts[2]} |", flush=True)
        if name != "nothing":
            total += counts
    if total[0]:
        print(f"| all but nothing | {total[0]} | {total[1]} | {total[2]} |")


def parser() -> argparse.ArgumentParser:
    """Describe the options."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--networks", type=int, default=20, help="networks of every kind of error")
    options.add_argument("--first", type=int, default=6000, help="number of the first network: its seed")
    options.add_argument("--verbose", action="store_true", help="print what is not named and what is false")
    options.add_argument("kinds", nargs="*", metavar="KIND", help="kinds of error; all by default")
    return options


def outcome(plant: Plant, seed: int, verbose: bool) -> tuple[bool, int]:
    """Return whether all that was planted is named, and the number of grave findings that are false."""
    case = plant(seed, np.random.default_rng([seed, 2]))
    found = diagnose(case.block, threads=1)
    said = getattr(case, "said", "")
    named = all(
        any(hits(finding, target, kinds) and said in finding.text for finding in found.grave)
        for target, kinds in zip(case.targets, case.kinds, strict=True)
    )
    false = [finding for finding in found.grave if not explained(finding, case)]
    if verbose and (not named or false):
        print(
            f"  seed {seed}: {'named' if named else 'NOT NAMED'} {str(case.targets)[:80]}, {len(false)} false"
        )
        for finding in found.grave[:4]:
            print(f"    {'false' if finding in false else 'right'}: {finding.kind}: {finding.text[:150]}")
        if not named:
            for finding in found.findings[:4]:
                print(f"    {finding.level}: {finding.kind}: {finding.text[:150]}")
    return named, len(false)


def network(seed: int, *, rectangular: bool = False, **more: object) -> Block:
    """Simulate a network; see :func:`simulation_of`."""
    return simulation_of(seed, rectangular=rectangular, **more).block


def simulation_of(seed: int, *, rectangular: bool = False, **more: object) -> Simulation:
    """Simulate a network: its size, density, space, sense and control follow from the seed."""
    choice = np.random.default_rng([seed, 3])
    space = GULF if choice.integers(2) and not rectangular else {}
    return simulate(
        **{
            "strips": int(choice.integers(2, 5)),
            "photos_per_strip": int(choice.integers(5, 10)),
            "points_per_photo": int(choice.integers(20, 60)),
            "side_overlap": float(choice.choice([0.2, 0.3, 0.6])),
            "control_spacing": int(choice.integers(2, 5)),
            "control_sd": float(choice.choice([0.05, 0.5])),
            "photo_to_ground": bool(choice.integers(2)),
            "seed": seed,
            **space,
            **more,
        }
    )


def of_block(plant: Callable[[Block, np.random.Generator], Planted]) -> Plant:
    """Plant an error of the check of projects."""
    return lambda seed, rng: plant(network(seed), rng)


def of_all(
    kind: str, said: str, change: Callable[[Block], dict[str, object]], *, rectangular: bool = True
) -> Plant:
    """Plant a mistake of a whole set: it is named by a finding of the kind that says what it is."""

    def plant(seed: int, _rng: np.random.Generator) -> Planted:
        block = network(seed, rectangular=rectangular)
        return Planted(block.replace(**change(block)), [set()], [{kind}], said=said)

    return plant


def image_error(block: Block, rng: np.random.Generator) -> Planted:
    """Move an image coordinate by what makes its test value 10."""
    adjusted = adjust(block, threads=1)
    rows, axes = np.nonzero(adjusted.redundancy > 0.1)
    pick = int(rng.integers(len(rows)))
    row, axis = int(rows[pick]), int(axes[pick])
    xy = block.image_xy.copy()
    size = EXPECTED * block.image_sd[row, axis] / math.sqrt(adjusted.redundancy[row, axis])
    xy[row, axis] += size * rng.choice([-1, 1])
    photo, point = block.photo_ids[block.image_photos[row]], block.point_ids[block.image_points[row]]
    # With two rays the other image is as good a suspect, and both are named.
    return Planted(block.replace(image_xy=xy), [{photo, point}], [set()])


def wrong_name(block: Block, rng: np.random.Generator) -> Planted:
    """Give an image of a point with three rays or more the name of a point that is not on the photo."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    row = int(rng.choice(np.flatnonzero(rays[block.image_points] >= 3)))
    photo = int(block.image_photos[row])
    there = block.image_points[block.image_photos == photo]
    others = np.flatnonzero((rays >= 3) & ~np.isin(np.arange(len(rays)), there))
    points = block.image_points.copy()
    points[row] = int(rng.choice(others))
    names = {block.photo_ids[photo], block.point_ids[points[row]]}
    return Planted(block.replace(image_points=points), [names], [set()])


def exchanged_axes(block: Block, rng: np.random.Generator) -> Planted:
    """Exchange x and y on one photo."""
    photo = int(rng.integers(len(block.photo_ids)))
    own = (block.image_photos == photo)[:, np.newaxis]
    name = block.photo_ids[photo]
    xy = np.where(own, block.image_xy[:, [1, 0]], block.image_xy)
    return Planted(block.replace(image_xy=xy), [{name}], [{"mirrored"}])


def control_error(block: Block, rng: np.random.Generator) -> Planted:
    """Move a held component of control by what makes its test value 10."""
    redundancy = np.nan_to_num(adjust(block, threads=1).point_redundancy)
    rows, axes = np.nonzero(np.isfinite(block.point_sd) & (redundancy > 1e-3))
    pick = int(rng.integers(len(rows)))
    point, axis = int(rows[pick]), int(axes[pick])
    positions = block.point_positions.copy()
    positions[point, axis] += EXPECTED * block.point_sd[point, axis] / math.sqrt(redundancy[point, axis])
    return Planted(block.replace(point_positions=positions), [{block.point_ids[point]}], [set()])


def station_error(seed: int, rng: np.random.Generator) -> Planted:
    """Move the observed position of a photo, as of GNSS, by what makes its test value 10."""
    block = network(seed, position_sd=0.1)
    redundancy = adjust(block, threads=1).photo_redundancy[:, :3]
    rows, axes = np.nonzero(redundancy > 1e-2)
    pick = int(rng.integers(len(rows)))
    photo, axis = int(rows[pick]), int(axes[pick])
    observed = (
        block.photo_positions if block.photo_positions_observed is None else block.photo_positions_observed
    )
    observed = observed.copy()
    size = EXPECTED * block.photo_position_sd[photo, axis] / math.sqrt(redundancy[photo, axis])
    observed[photo, axis] += size
    return Planted(
        block.replace(photo_positions_observed=observed), [{block.photo_ids[photo]}], [{"station-misfit"}]
    )


def with_positions(change: Callable[[Block, Position], dict[str, object]], said: str, **gnss: float) -> Plant:
    """Plant a mistake in all positions of photos observed by GNSS."""

    def plant(seed: int, _rng: np.random.Generator) -> Planted:
        simulation = simulation_of(seed, rectangular=True, photos_per_strip=7)
        block = with_gnss(simulation, **{"sd": 0.05, "seconds": 5.0, "seed": seed, **gnss}).block
        # What was flown, not what the initial values are.
        flown = block.replace(photo_positions=simulation.truth.photo_positions)
        changed = [
            Position(
                **{
                    "photo": each.photo,
                    "position": each.position,
                    "sd": 0.05,
                    "lever_arm": each.lever_arm.value if isinstance(each.lever_arm, LeverArm) else 0.0,
                    "time": each.time,
                    **change(flown, each),
                }
            )
            for each in block.observations
        ]
        changed_block = block.replace(observations=changed)
        return Planted(changed_block, [set()], [{"observed-positions"}], said=said)

    return plant


def later(block: Block, position: Position) -> dict[str, object]:
    """Return the position of a fiftieth of a second later, at five seconds from photo to photo."""
    axis = np.argmax(np.abs(np.diff(block.photo_positions[:2], axis=0)[0]))
    row = block.photo_ids.index(position.photo)
    strip = [i for i, name in enumerate(block.photo_ids) if name[:2] == position.photo[:2]]
    velocity = np.zeros(3)
    velocity[axis] = np.gradient(block.photo_positions[strip, axis], 5.0)[strip.index(row)]
    return {"position": np.asarray(position.position) + 0.02 * velocity}


def used_twice(block: Block, rng: np.random.Generator) -> Planted:
    """Give two pass points that share no photo one name."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    given = np.isfinite(block.point_positions).any(axis=1)
    points = np.flatnonzero((rays >= 2) & ~given)
    photos = {point: {*block.image_photos[block.image_points == point].tolist()} for point in points.tolist()}
    pairs = [
        (p, q)
        for p in points.tolist()
        for q in points.tolist()
        if p < q and not photos[p] & photos[q] and rays[p] + rays[q] >= 5
    ]
    one, other = pairs[int(rng.integers(len(pairs)))]
    image_points = np.where(block.image_points == other, one, block.image_points)
    name = block.point_ids[one]
    return Planted(block.replace(image_points=image_points), [{name}], [{"name-used-twice"}])


def millimetres(seed: int, _rng: np.random.Generator) -> Planted:
    """Give observed distances in millimetres."""
    block = with_distances(simulation_of(seed, rectangular=True), count=8, seed=seed).block
    longer = [replace(each, length=1000 * each.length) for each in block.observations]
    said = "observed distances are in millimetres"
    return Planted(block.replace(observations=longer), [set()], [{"convention"}], said=said)


def lens(factor: float, power: int, said: str) -> Plant:
    """Give a lens whose radial terms are wrong: multiplied by a power of the principal distance."""

    def plant(seed: int, _rng: np.random.Generator) -> Planted:
        camera = Camera("brown", {"c": -152.74, "K1": -1e-7, "K2": 2e-12})
        block = network(seed, cameras=[camera])
        terms = {"K1": factor * 152.74**power * -1e-7, "K2": factor * 152.74 ** (2 * power) * 2e-12}
        wrong = replace(camera, parameters={**camera.parameters, **terms})
        return Planted(block.replace(cameras=[wrong]), [set()], [{"lens"}], said=said)

    return plant


def quaternions(block: Block) -> dict[str, object]:
    """Return attitudes whose quaternions were taken in another order."""
    to_object = rotation_matrix(block.photo_attitudes)
    if not block.photo_to_ground:
        to_object = to_object.transpose(0, 2, 1)
    read = np.roll(Attitudes(to_object).values("quaternion"), 1, axis=1)
    form = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
    return {"photo_attitudes": Attitudes.of("quaternion", read).values(form)}


def feet(*axes: int) -> np.ndarray:
    """Return factors that turn metres into feet."""
    return np.where(np.isin(np.arange(3), axes), 1 / 0.3048, 1.0)


KINDS: dict[str, Plant] = {
    "nothing": of_block(planted.clean),
    "image, test value 10": of_block(image_error),
    "image 1 mm": of_block(planted.image_error(1.0)),
    "wrong name of an image": of_block(wrong_name),
    "exchanged names on a photo": of_block(planted.exchanged_names),
    "names of a photo scrambled": of_block(planted.scrambled_photo),
    "mirrored photo, x": of_block(planted.mirrored_photo(0)),
    "mirrored photo, y": of_block(planted.mirrored_photo(1)),
    "x and y of a photo exchanged": of_block(exchanged_axes),
    "kappa of a photo 180 deg": of_block(planted.turned_photo),
    "y of all images down": of_all(
        "mirrored",
        "y of the images has the wrong sign",
        lambda block: {"image_xy": block.image_xy * [1, -1]},
    ),
    "pixels from the corner, y down": of_all(
        "convention", "pixels", lambda block: {"image_xy": (block.image_xy * [1, -1] + 115.0) / 0.02}
    ),
    "degrees read as radians": of_all(
        "convention",
        "degrees and were read as radians",
        lambda block: {"photo_attitudes": np.degrees(block.photo_attitudes)},
    ),
    "stations in feet": of_all(
        "convention",
        "positions of the photos are in feet",
        lambda block: {"photo_positions": block.photo_positions * feet(0, 1, 2)},
    ),
    "heights of stations in feet": of_all(
        "convention",
        "heights of the photos are in feet",
        lambda block: {"photo_positions": block.photo_positions * feet(2)},
    ),
    "control in feet": of_all(
        "convention",
        "positions of the points are in feet",
        lambda block: {"point_positions": block.point_positions * feet(0, 1, 2)},
    ),
    "heights of control in feet": of_all(
        "control-set",
        "heights of the control are in feet",
        lambda block: {"point_positions": block.point_positions * feet(2)},
        rectangular=False,
    ),
    "X of control in feet": of_all(
        "convention",
        "X of the points are in feet",
        lambda block: {"point_positions": block.point_positions * feet(0)},
    ),
    "X and Y of control exchanged": of_all(
        "convention",
        "X and Y of points are exchanged",
        lambda block: {"point_positions": block.point_positions[:, [1, 0, 2]]},
    ),
    "control, test value 10": of_block(control_error),
    "exchanged control, image 1 mm": of_block(planted.exchanged_control_and_image),
    "observed position of a photo, test value 10": station_error,
    "observed positions above the ellipsoid": with_positions(
        lambda _, each: {"position": np.add(each.position, [0, 0, 46.2])}, "ellipsoidal"
    ),
    "observed positions in feet": with_positions(
        lambda _, each: {"position": np.asarray(each.position) / 0.3048}, "are in feet"
    ),
    "observed positions of 0.02 s later": with_positions(later, "time offset"),
    "lever arm with the wrong sign": with_positions(
        lambda _, each: {"lever_arm": -np.asarray(each.lever_arm.value)},
        "lever arm",
        lever_arm=[1.2, 0.3, 2.5],
    ),
    "observed distances in millimetres": millimetres,
    "one name for two points": of_block(used_twice),
    "radial terms with the wrong sign": lens(-1.0, 0, "wrong sign"),
    "radial terms divided by the principal distance": lens(1.0, 2, "divided by the principal distance"),
    "quaternions in another order": of_all("convention", "quaternions", quaternions),
}

if __name__ == "__main__":
    main()
