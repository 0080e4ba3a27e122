"""Variance components of simulated blocks against the truth: the figures of docs/weights.md.

python benches/variance_components.py [runs]
"""

from __future__ import annotations

import sys

import numpy as np

from photogram import simulate, variance_components

TRUE = {"images, strip 1": 4 / 9, "images, strip 2": 4.0, "positions": 1.0}
"""Variances over the given ones."""
IMAGE_SD, POSITION_SD = 0.010, 0.30
BOUND = 1.959964


def main(runs: int) -> None:
    """Print what the components are, how far they scatter, and how often their intervals hold the truth."""
    found = [three(seed) for seed in range(runs)]
    print(f"three components, {runs} runs: 2 strips of 5 photos, positions observed, 4 control points held")
    heads = ("true", "median", "scatter", "its sd", "shortcut", "interval", "plain +-", "at bound")
    print(f"{'group':<18}" + "".join(f"{head:>10}" for head in heads))
    for name, true in TRUE.items():
        each = [one[name] for one in found]
        usable = [one for one in each if not one.held]
        logs = np.array([np.log(one.factor / true) for one in usable])
        sd = np.array([one.sd / one.factor for one in usable])
        least = np.array([one.least_sd / one.factor for one in usable])
        inside = np.mean([one.interval[0] <= true <= one.interval[1] for one in usable])
        plain = np.mean([abs(one.factor - true) <= BOUND * one.sd for one in usable])
        figures = (
            f"{true:>10.3f}{np.median([one.factor for one in each]):>10.3f}{logs.std():>10.3f}"
            f"{np.median(sd):>10.3f}{np.median(least):>10.3f}{100 * inside:>9.1f}%{100 * plain:>9.1f}%"
            f"{100 * (1 - len(usable) / runs):>9.1f}%"
        )
        print(f"{name:<18}{figures}")
    print("scatter, its sd (median of the runs) and the shortcut sqrt(2 / r) are of the logarithm")
    wrong_by_four(max(runs // 10, 5))


def three(seed: int) -> object:
    """Estimate the components of one block whose strips were measured by two hands."""
    simulation = simulate(
        strips=2,
        photos_per_strip=5,
        points_per_photo=25,
        image_sd=IMAGE_SD,
        position_sd=POSITION_SD,
        seed=seed,
    )
    block, random = simulation.block, np.random.default_rng(10_000 + seed)
    first = np.array([name.startswith("01") for name in block.photo_ids])[block.image_photos]
    factors = np.where(first, TRUE["images, strip 1"], TRUE["images, strip 2"])[:, np.newaxis]
    noise = random.normal(size=block.image_xy.shape) * IMAGE_SD * np.sqrt(factors)
    block = block.replace(image_xy=simulation.truth.image_xy + noise)
    return variance_components(block, "strip", held=["control"], equality=False)


def wrong_by_four(runs: int) -> None:
    """Print what becomes of image standard deviations that are four times too small."""
    factors, errors = [], []
    for seed in range(runs):
        simulation = simulate(strips=3, photos_per_strip=6, points_per_photo=40, position_sd=0.1, seed=seed)
        block, truth = simulation.block, simulation.truth
        wrong = block.replace(image_sd=block.image_sd / 4)
        found = variance_components(wrong, equality=False)
        factors.append(found["images"].factor_of_sd)
        sizes = [
            np.sqrt(((each.photo_positions - truth.photo_positions) ** 2).mean())
            for each in (found.first, found.result)
        ]
        errors.append(sizes)
    given, corrected = np.array(errors).mean(axis=0)
    low, high = np.quantile(factors, [0.025, 0.975])
    print(
        f"image sds four times too small, {runs} runs: corrected by {np.mean(factors):.3f}"
        f" (95 percent of the runs: {low:.2f} to {high:.2f});"
        f" rms error of stations {given:.4f} m before, {corrected:.4f} m after"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
