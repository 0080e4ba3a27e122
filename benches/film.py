"""Photographs on film with eight marks each beside the same block from refined coordinates: docs/film.md.

    python benches/film.py 20x50                strips x photographs

All are adjusted in turn in one process, all covariances included; the median of each phase counts, and so
does that of the processor time of the whole adjustment in the core and around it. A second table has what
films cost by the count: multiply-adds of the reduction of points, of a factor and of the inverse.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np

from photogram import Block, adjust, simulate
from photogram.network.films import (
    Film,
    FilmPlacement,
    FilmSize,
    Mark,
    Pattern,
    Readings,
    Roll,
    Scan,
    Scanner,
    Weights,
)
from photogram.network.observations import Fiducial, KnownFilm, KnownTogether

PITCH, ORIGIN, HALF = 0.02, 6000.0, 113.0
"""mm a pixel, the pixel amid a scan, half the format in mm."""
IMAGE_SD = 0.5
"""Pixels: 0.010 mm, as the images of the block have."""
SHARED_SD = {"scanner": (4e-6, 4e-6, 6e-6), "pattern": 0.006}


@dataclass(frozen=True)
class Films:
    """Films of a block; `shared`: with a weighted scanner and pattern; `before`: known, without marks."""

    shared: bool = False
    before: bool = False

    def of(self, block: Block) -> Block:
        """Return the block with its images as readings of films, and eight marks on each."""
        random = np.random.default_rng(1)
        count = len(block.photo_ids)
        size = random.normal(0.0, 1e-4, (count, 3))
        placement = random.normal(0.0, [0.6, 0.6, 0.002], (count, 3))
        places = HALF * np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y])
        marks = [Mark(f"mark {k}", place) for k, place in enumerate(places.tolist())]
        scanner = Scanner("scanner", sd=SHARED_SD["scanner"] if self.shared else 0.0)
        weights = [Weights("w1 w2", (0.0, 0.0), sd=SHARED_SD["pattern"])] if self.shared else []
        pattern = Pattern("w1 w2", HALF, weights) if self.shared else None
        roll, counted = Roll("roll", 0.0, 5e-4), Readings(PITCH, (ORIGIN, ORIGIN), down=True)
        of = block.image_photos
        images = readings(block.image_xy, size[of], placement[of])
        scans, observations = [], [KnownTogether("certificate", marks, sd=0.002)]
        held = 0.0 if self.before else np.inf
        for k, name in enumerate(block.photo_ids):
            own = FilmPlacement(name, placement[k], held), FilmSize(name, size[k], held)
            film = Film(*own, scanner, counted, roll=None if self.before else roll, pattern=pattern)
            scans.append(Scan(name, film))
            read = readings(places, size[[k] * 8], placement[[k] * 8]) + random.normal(0.0, 0.2, (8, 2))
            observations.append(KnownFilm(name, *own, roll, ("m", "b1", "b2"), 0.0, sd=1e-4))
            observations += [
                Fiducial(name, mark, film, xy, sd=0.2) for mark, xy in zip(marks, read.tolist(), strict=True)
            ]
        return block.replace(
            passages=scans,
            observations=[*block.observations, *([] if self.before else observations)],
            image_xy=images,
            image_sd=IMAGE_SD,
        )


def readings(q: np.ndarray, size: np.ndarray, placement: np.ndarray) -> np.ndarray:
    """Return (n, 2) columns and rows of (n, 2) places in mm, each on a film of its own."""
    ((x, y), (m, b1, b2), (t1, t2, theta)) = (each.T for each in (q, size, placement))
    e = np.array([x + (m + b1) * x + b2 * y, y + b2 * x + (m - b1) * y])
    cos, sin = np.cos(theta), np.sin(theta)
    right, up = cos * e[0] - sin * e[1] + t1, sin * e[0] + cos * e[1] + t2
    return np.column_stack([ORIGIN + right / PITCH, ORIGIN - up / PITCH])


PHASES = ("form", "factor", "solve", "invert", "cofactors")
COUNTED = ("reduction", "factor", "inverse")
"""Of what multiply-adds are counted, each done once."""


def measured(block: Block) -> dict[str, float]:
    """Return seconds of each phase, and of the processor for all of it; millions of multiply-adds."""
    start = time.process_time()
    result = adjust(block)
    found = {"processor": time.process_time() - start}
    found |= {name: result.seconds[name] for name in PHASES}
    counts = {name: 1e-6 * result.operations[name] for name in COUNTED}
    return found | {f"{name} count": own for name, own in counts.items()} | {"count": sum(counts.values())}


def compared(size: str, runs: int) -> list[str]:
    """Return the two tables of one size."""
    strips, photos = (int(number) for number in size.split("x"))
    plain = simulate(strips=strips, photos_per_strip=photos, seed=1).block
    kinds = {
        "refined coordinates": plain,
        "films fitted before": Films(before=True).of(plain),
        "films": Films().of(plain),
        "films, scanner, pattern": Films(shared=True).of(plain),
    }
    runs_of: dict[str, list[dict[str, float]]] = {kind: [] for kind in kinds}
    for _ in range(runs):
        for kind, block in kinds.items():
            runs_of[kind].append(measured(block))
    middle = {
        kind: {name: float(np.median([run[name] for run in own])) for name in own[0]}
        for kind, own in runs_of.items()
    }
    counts = {"reduction count": "reduction", "factor count": "factor", "inverse count": "inverse"}
    return [
        f"{strips * photos:,} photographs, {len(plain.image_xy):,} images; seconds:",
        *table(middle, {name: name for name in (*PHASES, "processor")}, ".3f"),
        "",
        "10^6 multiply-adds:",
        *table(middle, counts | {"count": "together"}, ",.0f"),
    ]


def table(middle: dict[str, dict[str, float]], columns: dict[str, str], form: str) -> list[str]:
    """Return values with, in brackets, their ratio to those of refined coordinates."""
    first, rows = middle["refined coordinates"], []
    for kind, own in middle.items():
        cells = [f"{own[name]:{form}} ({own[name] / first[name]:.1f})" for name in columns]
        rows.append(f"| {kind} | {' | '.join(cells)} |")
    return [f"| as | {' | '.join(columns.values())} |", f"|---|{'---:|' * len(columns)}", *rows]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sizes", nargs="+")
    parser.add_argument("--runs", type=int, default=5)
    asked = parser.parse_args()
    for size in asked.sizes:
        print("\n".join(compared(size, asked.runs)), flush=True)


if __name__ == "__main__":
    main()
