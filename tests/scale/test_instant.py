"""Small things feel instant: pytest -m speed."""

import subprocess
import sys
import time

import pytest

from photogram import adjust, simulate

pytestmark = pytest.mark.speed

IMPORT = "import time, photogram; print(time.process_time())"


def test_import_takes_less_than_300_ms() -> None:
    """Of processor time in a new interpreter, NumPy and the interpreter included: the best of ten."""
    seconds = []
    while not seconds or (min(seconds) >= 0.3 and len(seconds) < 10):
        done = subprocess.run([sys.executable, "-c", IMPORT], check=True, capture_output=True)
        seconds.append(float(done.stdout))
    assert min(seconds) < 0.3


def test_five_photos_take_less_than_20_ms() -> None:
    """With all covariances and redundancy numbers: the best of twenty."""
    block = simulate(strips=1, photos_per_strip=5, seed=1).block
    seconds = []
    for _ in range(20):
        start = time.perf_counter()
        adjust(block)
        seconds.append(time.perf_counter() - start)
    assert min(seconds) < 0.02
