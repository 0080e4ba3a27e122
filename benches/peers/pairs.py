"""Blocks beside their plain sisters, photogram alone: free networks, and a camera for each photo.

python benches/peers/pairs.py free 100x500 [...] [--repetitions N]
python benches/peers/pairs.py cameras 50x100 [...] [--repetitions N]

`free`: inner constraints over all points, beside the same block with control. `cameras`: a camera of eight
weighted parameters for each photo, blocks of fourteen, beside one known camera. All with covariances and
redundancy numbers, from the same initial values, interleaved; processor time is compared.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from machine import processor
from runs import Size
from self_calibration import TRUE

import photogram
from photogram import Block, Camera, InnerConstraints

SD = {"fx": 0.02, "fy": 0.02, "cx": 0.02, "cy": 0.02, "k1": 2e-4, "k2": 2e-4, "p1": 2e-5, "p2": 2e-5}
HEADS = {"free": ("control", "inner constraints"), "cameras": ("known camera", "one for each photo")}


def blocks(kind: str, size: Size) -> tuple[Block, Block]:
    """Return the plain block and its sister."""
    shape = {"strips": size.strips, "photos_per_strip": size.photos_per_strip, "seed": 1}
    if kind == "free":
        plain = photogram.simulate(**shape).block
        return plain, plain.replace(point_sd=np.full(plain.point_sd.shape, np.inf))
    known = [Camera("opencv", TRUE[0], unit="mm", name="camera")]
    random, own = np.random.default_rng(2), []
    for photo in range(size.photos):
        given = {name: value + SD[name] * random.standard_normal() for name, value in TRUE[0].items()}
        own.append(Camera("opencv", given, SD, unit="mm", name=f"camera {photo}"))
    plain = photogram.simulate(**shape, cameras=known, start_cameras=known).block
    return plain, plain.replace(cameras=own, photo_cameras=np.arange(size.photos))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=HEADS)
    parser.add_argument("sizes", nargs="*", type=Size.parse, default=[Size(20, 50)], metavar="STRIPSxPHOTOS")
    parser.add_argument("--repetitions", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{processor()}; seconds of processor time, the least of {arguments.repetitions}\n")
    plain, other = HEADS[arguments.kind]
    head = ["photos", plain, "steps", other, "steps", "ratio"]
    print("| " + " | ".join(head) + " |\n|" + "---:|" * len(head))
    datum = InnerConstraints() if arguments.kind == "free" else None
    for size in arguments.sizes:
        pair = blocks(arguments.kind, size)
        seconds, steps = [np.inf, np.inf], [0, 0]
        for _ in range(arguments.repetitions):
            for side, block in enumerate(pair):
                start = time.process_time()
                result = photogram.adjust(block, datum=datum if side else None)
                seconds[side] = min(seconds[side], time.process_time() - start)
                steps[side] = len(result.iterations)
                assert result.converged
                # Two results of the largest blocks need not fit.
                del result
        cells = [f"{size.photos:,}", f"{seconds[0]:.2f}", str(steps[0]), f"{seconds[1]:.2f}", str(steps[1])]
        print("| " + " | ".join([*cells, f"{seconds[1] / seconds[0]:.2f}"]) + " |", flush=True)


if __name__ == "__main__":
    main()
