"""An adjustment that the machine cannot hold is refused."""

import pytest

from photogram import AdjustmentError, adjust
from photogram.memory import available_memory

MEMINFO = "MemTotal:       16000 kB\nMemFree:         100 kB\nMemAvailable:    8000 kB\n"


@pytest.mark.parametrize(
    ("group", "expected"),
    [
        ({}, 8192000),
        ({"memory.max": "max\n", "memory.current": "5\n"}, 8192000),
        ({"memory.max": "3000000\n", "memory.current": "1000000\n"}, 2000000),
        ({"memory.max": "3000000\n", "memory.current": "3000001\n"}, 0),
    ],
)
def test_available_memory(tmp_path, group, expected):
    for name, text in {**group, "meminfo": MEMINFO}.items():
        (tmp_path / name).write_text(text)
    assert available_memory(tmp_path / "meminfo", tmp_path) == expected


def test_a_system_that_does_not_tell(tmp_path):
    assert available_memory(tmp_path / "meminfo", tmp_path) is None


def test_a_block_that_does_not_fit_is_refused(small_block, monkeypatch):
    monkeypatch.setattr("photogram.adjustment.available_memory", lambda: 1 << 14)
    with pytest.raises(AdjustmentError, match=r"takes 0\.0 GiB of memory, and 0\.0 GiB are free"):
        adjust(small_block)
    monkeypatch.setattr("photogram.adjustment.available_memory", lambda: 1 << 20)
    assert adjust(small_block).converged
