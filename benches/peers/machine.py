"""What the machine can do: its dense matrix-product rate, and how long a small block takes on it.

python benches/peers/machine.py rate|small prints one of them as JSON.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

_SIZE = 2048
_REPETITIONS = 5


def product_rate() -> float:
    """Return the multiply-adds a second of NumPy's product of square matrices (its BLAS, all processors)."""
    a, b = np.random.default_rng(0).standard_normal((2, _SIZE, _SIZE))
    return _SIZE**3 / _least(lambda: a @ b)


def import_seconds() -> float:
    """Import photogram, and NumPy with it, in a new interpreter; less what that takes itself."""
    return _interpreter_seconds("import photogram") - _interpreter_seconds("pass")


def _interpreter_seconds(code: str) -> float:
    return _least(lambda: subprocess.run([sys.executable, "-c", code], check=True))


def small_block_seconds() -> float:
    """Adjust five photographs, with everything."""
    import photogram

    block = photogram.simulate(strips=1, photos_per_strip=5, seed=1).block
    return _least(lambda: photogram.adjust(block))


def processor() -> str:
    """Return the name of the processor and how many there are."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    for line in cpuinfo.read_text().splitlines() if cpuinfo.exists() else []:
        if line.startswith("model name"):
            name = line.partition(":")[2].strip()
    return f"{name}, {os.cpu_count()} processors"


def _least(work: Callable[[], object]) -> float:
    times = []
    for _ in range(_REPETITIONS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


if __name__ == "__main__":
    if sys.argv[1:] == ["rate"]:
        print(json.dumps({"product": product_rate()}))
    else:
        print(json.dumps({"import": import_seconds(), "small block": small_block_seconds()}))
