"""Runs of all sides on blocks of several sizes, kept in a directory so that none is done twice."""

from __future__ import annotations

import functools
import hashlib
import json
import pickle
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from agreement import Agreement
from start import intersections

import photogram
from photogram import _photocore

HERE = Path(__file__).parent

Record = Mapping[str, Any]
"""What a side wrote about its runs (side.py), or `failed` with the reason."""

CHEAP = 5.0
"""Seconds: what takes less is repeated."""


def package(side: str) -> str:
    """Return the package of a side: the setting follows its name after a colon."""
    return side.partition(":")[0]


def main_step(side: str) -> str:
    """Return the step of a side by which it is compared."""
    return "everything" if package(side) == "photogram" else "solution"


def main_seconds(side: str, record: Record) -> float:
    """Return the seconds of the main step of a side."""
    return float(record["seconds"][main_step(side)])


@dataclass(frozen=True)
class Size:
    """Strips and photographs in a strip, as in 20x50."""

    strips: int
    photos_per_strip: int

    @classmethod
    def parse(cls, text: str) -> Size:
        """Read STRIPSxPHOTOS; raises ValueError."""
        strips, photos = (int(part) for part in text.split("x"))
        if strips < 1 or photos < 2:
            raise ValueError("at least one strip of two photographs")
        return cls(strips, photos)

    @property
    def photos(self) -> int:
        """Photographs in all."""
        return self.strips * self.photos_per_strip

    def __str__(self) -> str:
        return f"{self.strips}x{self.photos_per_strip}"


@dataclass(frozen=True)
class Plan:
    """What is to be run.

    Attributes
    ----------
    work
        The directory of the results.
    seed
        Of the simulated blocks.
    sides
        Which sides; photogram first.
    peers_up_to
        Photographs in the largest block that the peers are given.
    repetitions
        Of sides that take less than `CHEAP` seconds.
    limit
        Seconds that a side may take before it is stopped.
    marginals
        Seconds after which gtsam's marginals are extrapolated.
    """

    work: Path
    seed: int
    sides: list[str]
    peers_up_to: int
    repetitions: int
    limit: float
    marginals: float

    def sides_of(self, size: Size) -> list[str]:
        """Sides that are given a block: strips and the largest blocks are photogram's alone."""
        peers = size.strips > 1 and size.photos <= self.peers_up_to
        return [side for side in self.sides if peers or side == "photogram"]


@dataclass(frozen=True)
class Measured:
    """What the runs on one block gave.

    Attributes
    ----------
    size
        The block.
    photos, points, images
        Their numbers.
    product
        The machine's matrix-product rate beside the runs, multiply-adds a second.
    records
        Of every side that was given the block.
    agreements
        Of the peers that say that they have converged.
    """

    size: Size
    photos: int
    points: int
    images: int
    product: float
    records: Mapping[str, Record]
    agreements: Mapping[str, Agreement]

    @property
    def ours(self) -> Record | None:
        """The record of photogram; None where it failed."""
        record = self.records["photogram"]
        return None if "failed" in record else record


class Runs:
    """The runs on one block."""

    def __init__(self, plan: Plan, size: Size) -> None:
        self.plan, self.size = plan, size
        self.directory = plan.work / f"{size}-seed-{plan.seed}"
        self.stem = self.directory / "block"

    def measured(self) -> Measured:
        """Run what has not been run yet and compare the solutions."""
        asked = self.plan.sides_of(self.size)
        missing = [side for side in asked if not self._record(side).exists()]
        if missing:
            self._build()
            self._measure_product()
            self._run_in_turn(missing)
        records = {side: json.loads(self._record(side).read_text()) for side in asked}
        about = json.loads((self.directory / "block.json").read_text())
        return Measured(size=self.size, records=records, agreements=self._agreements(records), **about)

    def _run_in_turn(self, sides: list[str]) -> None:
        """Run sides in turn, so that all meet the same machine, and write their records."""
        found: dict[str, Record] = {}
        for repetition in range(self.plan.repetitions):
            for side in sides:
                before = found.get(side)
                if before is None or ("failed" not in before and main_seconds(side, before) < CHEAP):
                    found[side] = self._better(side, before, self._run(side, repetition))
                    self._record(side).write_text(json.dumps(found[side], indent=1))

    def _agreements(self, records: Mapping[str, Record]) -> dict[str, Agreement]:
        ours = records["photogram"]
        if "failed" in ours:
            return {}
        arrays = self._arrays("photogram")
        return {
            side: Agreement.of((ours, arrays), (record, self._arrays(side)))
            for side, record in records.items()
            if side != "photogram" and "failed" not in record and record["converged"]
        }

    def _arrays(self, side: str) -> dict[str, Any]:
        """Return the arrays of the first run of a side."""
        return dict(np.load(self._output(side, 0).with_suffix(".npz")))

    def _build(self) -> None:
        """Simulate the block, in a process of its own for its memory's sake."""
        self.directory.mkdir(parents=True, exist_ok=True)
        if not self.stem.with_suffix(".pickle").exists():
            command = [HERE / "runs.py", self.size, self.plan.seed, self.stem]
            subprocess.run([sys.executable, *map(str, command)], check=True)

    def _measure_product(self) -> None:
        rate = subprocess.run([sys.executable, HERE / "machine.py", "rate"], check=True, capture_output=True)
        path = self.directory / "block.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | json.loads(rate.stdout)))

    def _run(self, side: str, repetition: int) -> Record:
        print(f"{self.size}: {side}, run {repetition + 1}", file=sys.stderr, flush=True)
        output = self._output(side, repetition)
        # Covariances of the peers take long: once is enough.
        marginals = self.plan.marginals if repetition == 0 else 0.0
        command = [HERE / "side.py", side, self.stem, output, marginals]
        try:
            done = subprocess.run([sys.executable, *map(str, command)], timeout=self.plan.limit, check=False)
        except subprocess.TimeoutExpired:
            return {"failed": f"more than {self.plan.limit:g} s"}
        if done.returncode:
            return {"failed": f"exit status {done.returncode}"}
        return dict(json.loads(output.with_suffix(".json").read_text()))

    @staticmethod
    def _better(side: str, before: Record | None, now: Record) -> Record:
        """Return the faster of two runs, with what was done in one of them only."""
        if before is None or "failed" in now:
            return before or now
        slow, fast = sorted([before, now], key=lambda record: -main_seconds(side, record))
        return {**slow, **fast, **{name: slow[name] | fast[name] for name in ("seconds", "peak")}}

    def _record(self, side: str) -> Path:
        return self.directory / f"{_file_name(side)}.json"

    def _output(self, side: str, repetition: int) -> Path:
        return self.directory / f"{_file_name(side)}-run-{repetition + 1}"


def _file_name(side: str) -> str:
    """Return the stem of a side's files; another build of photogram is another side."""
    build = f"-{_build_of_photogram()}" if package(side) == "photogram" else ""
    return side.replace(":", "-") + build


@functools.cache
def _build_of_photogram() -> str:
    return hashlib.sha256(Path(str(_photocore.__file__)).read_bytes()).hexdigest()[:8]


def main() -> None:
    """Simulate a block and write it with the initial points."""
    size, seed, stem = Size.parse(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    block = photogram.simulate(
        strips=size.strips, photos_per_strip=size.photos_per_strip, seed=seed, position_error=30.0,
        attitude_error=0.01, principal_distance=-152.74, forward_overlap=0.6, side_overlap=0.3,
        points_per_photo=100.0,
    ).block  # fmt: skip
    counts = {
        "photos": len(block.photo_ids),
        "points": len(block.point_ids),
        "images": len(block.image_photos),
    }
    stem.with_suffix(".json").write_text(json.dumps(counts))
    with stem.with_suffix(".pickle").open("wb") as file:
        pickle.dump((block, intersections(block)), file)


if __name__ == "__main__":
    main()
