"""Calibrations with targets beside mrcal.

python benches/targets.py FOLDER [--mrcal PYTHON] [--repetitions N] [--only NAME] [--off PART]

Of opencv8-0.cameramodel and splined-0.cameramodel of mrcal, from a start in which every free number of lens
and views is 1 % off the values that they hold (`--off 0`: from these): ours with all covariances, all
redundancy numbers, the verdict, and two maps of 60 x 40 pixels, at infinity and at 1 m; mrcal's optimization,
without a new search for outliers, and one map, at infinity. Both in turn, medians of processor time (and of
what a clock says). mrcal runs by a Python that has it: `--mrcal`, or the first python3 that does; the splined
one is computed once, mrcal's optimization only.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import statistics
import subprocess
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from photogram.targets import Calibration, read
from photogram.targets.uncertainty import uncertainty_map

MODELS = {"opencv8-0": (0.5, "optimization and one map"), "splined-0": (0.1, "optimization")}
"""What part of mrcal's time ours may take, and of what."""
PYTHONS = ("python3", "/usr/bin/python3")
PEER = """
import json, sys, time, mrcal
from mrcal import cameramodel
def clock():
    return time.process_time(), time.perf_counter()
inputs = cameramodel(sys.argv[1]).optimization_inputs()
inputs["do_apply_outlier_rejection"] = False
larger = 1 + float(sys.argv[3])
inputs["intrinsics"][:, 0 if inputs["do_optimize_intrinsics_core"] else 4 :] *= larger
inputs["frames_rt_toref"] *= larger
start = clock()
found = mrcal.optimize(**inputs)
optimized = clock()
if sys.argv[2] == "map":
    model = cameramodel(optimization_inputs=inputs, icam_intrinsics=0)
    rays, _ = mrcal.sample_imager_unproject(60, 40, *model.imagersize(), *model.intrinsics(), normalize=True)
    mrcal.projection_uncertainty(rays, model, atinfinity=True, what="worstdirection-stdev")
end = clock()
seconds = [b - a for a, b in zip(start, optimized)], [b - a for a, b in zip(optimized, end)]
print(json.dumps([*seconds, float(found["x"] @ found["x"])]))
"""
"""What mrcal computes: processor and clock seconds of optimization and map, the cost."""

Pair = tuple[float, float]
"""Seconds of the processor, and of a clock."""


def clock() -> Pair:
    """Return both times."""
    return time.process_time(), time.perf_counter()


def begun(path: Path, off: float) -> Calibration:
    """Return a calibration whose lens and views begin so much larger than the file has them."""
    found = read(path)
    cameras = [
        camera.replace(
            parameters={
                name: value * (1 + off) if camera.sd.get(name, np.inf) else value
                for name, value in camera.parameters.items()
            },
            knots=None if camera.knots is None else camera.knots * (1 + off),
        )
        for camera in found.cameras
    ]
    poses = np.array(found.poses)
    turns = Rotation.from_matrix(poses[:, :3, :3])
    poses[:, :3, :3] = Rotation.from_rotvec((1 + off) * turns.as_rotvec()).as_matrix()
    poses[:, :3, 3] *= 1 + off
    return found.replace(cameras=cameras, poses=poses)


def ours(path: Path, off: float) -> tuple[list[Pair], str]:
    """Return the times of adjustment and maps, and how it has ended."""
    calibration = begun(path, off)
    times = [clock()]
    found = calibration.adjust()
    times.append(clock())
    for distance in (math.inf, 1.0):
        uncertainty_map(found, 0, distance)
    times.append(clock())
    cost, iterations = found.sums_of_squares.total, len(found.iterations)
    return between(times), f"{found.status}, {iterations} iterations, cost {cost:.6f}"


def between(times: Sequence[Pair]) -> list[Pair]:
    """Return the differences."""
    return [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(times)]


def of_mrcal(python: str, path: Path, off: float, *, with_map: bool) -> tuple[list[Pair], str]:
    """Return the times of optimization and map, and the cost."""
    command = [python, "-c", PEER, str(path), "map" if with_map else "none", str(off)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    *seconds, cost = json.loads(done.stdout.splitlines()[-1])
    return [(each[0], each[1]) for each in seconds], f"cost {cost:.6f}"


def with_mrcal() -> str | None:
    """Return a Python that has mrcal."""
    for python in PYTHONS:
        path = shutil.which(python)
        if path and not subprocess.run([path, "-c", "import mrcal"], capture_output=True).returncode:
            return path
    return None


def median(runs: Sequence[list[Pair]]) -> list[Pair]:
    """Return the medians of what several runs have taken."""
    parts = zip(*runs, strict=True)
    return [(statistics.median(p for p, _ in part), statistics.median(c for _, c in part)) for part in parts]


def row(name: str, what: str, times: Sequence[Pair], told: str) -> str:
    """Return a row of the table: two parts and their sum, on the processor and by the clock."""
    parts = "".join(f"{processor:9.2f} ({by_clock:.2f})".rjust(20) for processor, by_clock in times)
    return f"{name:10} {what:10}{parts}   {told}"


def compared(path: Path, python: str | None, repetitions: int, off: float) -> None:
    """Print the rows of a calibration, and the ratio."""
    limit, of_what = MODELS[path.stem]
    with_map = "map" in of_what
    sides: dict[str, Callable[[], tuple[list[Pair], str]]] = {"photogram": lambda: ours(path, off)}
    if python is not None:
        sides["mrcal"] = lambda: of_mrcal(python, path, off, with_map=with_map)
    runs: dict[str, list[list[Pair]]] = {side: [] for side in sides}
    told = {}
    for _ in range(repetitions if with_map else 1):
        for side, run in sides.items():
            times, told[side] = run()
            runs[side].append(times)
    sums = {}
    for side in sides:
        found = median(runs[side])
        sums[side] = [sum(part[k] for part in found) for k in (0, 1)]
        print(row(path.stem, side, found, told[side]), flush=True)
    if "mrcal" in sums:
        ratios = [own / other for own, other in zip(sums["photogram"], sums["mrcal"], strict=True)]
        print(f"{'':10} ratio to {of_what}: {ratios[0]:.3f} ({ratios[1]:.3f}); at most {limit}", flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--mrcal", help="a Python that has mrcal")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--only", choices=MODELS, help="one of them")
    parser.add_argument("--off", type=float, default=0.01, help="part by which the start is off")
    asked = parser.parse_args()
    python = asked.mrcal or with_mrcal()
    print("seconds of the processor (of a clock); " + (python or "no Python has mrcal"))
    print(f"{'':21}{'solution':>20}{'maps':>20}")
    for name in [asked.only] if asked.only else MODELS:
        compared(asked.folder / f"{name}.cameramodel", python, asked.repetitions, asked.off)


if __name__ == "__main__":
    main()
