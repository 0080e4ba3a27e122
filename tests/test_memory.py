"""Work that the machine cannot hold is refused."""

from __future__ import annotations

import contextlib
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from message_codes import raises
from photogram import AdjustmentError, InputError, OutOfMemoryError, adjust, memory, simulate
from photogram.collection import adjust as adjust_collection
from photogram.collection import simulate as simulate_collection

MEMINFO = "MemTotal:       16000 kB\nMemFree:         100 kB\nMemAvailable:    8000 kB\n"
FREE = 8192000
V2 = "sys/fs/cgroup/"
V1 = "sys/fs/cgroup/memory/"


@pytest.fixture
def machine(tmp_path):
    """Write what a system tells; return how much of it is available."""

    def write(files):
        for name, text in {"proc/meminfo": MEMINFO, **files}.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return memory.available_memory(tmp_path)

    return write


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, FREE),
        ({"proc/self/cgroup": "0::/\n", V2 + "memory.max": "max\n", V2 + "memory.current": "5\n"}, FREE),
        ({"proc/self/cgroup": "0::/\n", V2 + "memory.max": "3000\n", V2 + "memory.current": "1000\n"}, 2000),
        ({"proc/self/cgroup": "0::/\n", V2 + "memory.max": "3000\n", V2 + "memory.current": "3001\n"}, 0),
        (
            # What the kernel keeps of files it gives back.
            {
                "proc/self/cgroup": "0::/\n",
                V2 + "memory.max": "3000\n",
                V2 + "memory.current": "2900\n",
                V2 + "memory.stat": "anon 900\ninactive_file 2000\n",
            },
            2100,
        ),
        (
            # The group has no limit, one around it has.
            {
                "proc/self/cgroup": "0::/user/job\n",
                V2 + "user/job/memory.max": "max\n",
                V2 + "user/job/memory.current": "100\n",
                V2 + "user/memory.max": "5000\n",
                V2 + "user/memory.current": "600\n",
            },
            4400,
        ),
        (
            # In a container the tree begins at the group.
            {
                "proc/self/cgroup": "0::/docker/0123abcd\n",
                V2 + "memory.max": "3000\n",
                V2 + "memory.current": "1000\n",
            },
            2000,
        ),
        (
            {
                "proc/self/cgroup": "5:cpu,cpuacct:/a\n4:memory:/a/b\n1:name=systemd:/a\n",
                V1 + "a/b/memory.limit_in_bytes": "9223372036854771712\n",
                V1 + "a/b/memory.usage_in_bytes": "10\n",
                V1 + "a/memory.limit_in_bytes": "7000\n",
                V1 + "a/memory.usage_in_bytes": "4000\n",
                V1 + "a/memory.stat": "total_inactive_file 500\n",
            },
            3500,
        ),
        (
            {
                "proc/self/cgroup": "0::/../..\n",
                V2 + "memory.max": "3000\n",
                V2 + "memory.current": "1000\n",
            },
            2000,
        ),
    ],
)
def test_available_memory(machine, files, expected):
    assert machine(files) == expected


@pytest.mark.parametrize(("kind", "field"), [(resource.RLIMIT_AS, 0), (resource.RLIMIT_DATA, 5)])
def test_limits_of_the_process_count(machine, monkeypatch, kind, field):
    def getrlimit(which):
        unlimited = resource.RLIM_INFINITY
        return (5_000_000, unlimited) if which == kind else (unlimited, unlimited)

    monkeypatch.setattr(resource, "getrlimit", getrlimit)
    pages = ["0"] * 7
    pages[field] = "100"
    assert machine({"proc/self/statm": " ".join(pages)}) == 5_000_000 - 100 * resource.getpagesize()


def test_a_system_that_does_not_tell(tmp_path):
    assert memory.available_memory(tmp_path) is None


def test_a_block_that_does_not_fit_is_refused(monkeypatch):
    # More photos than fit anywhere.
    block = simulate(strips=3, photos_per_strip=40, seed=2).block
    monkeypatch.setattr("photogram.network.core_arrays.available_memory", lambda: 1 << 20)
    with pytest.raises(
        OutOfMemoryError, match=r"takes \d+\.\d MiB of memory, and 1\.0 MiB are free"
    ) as raised:
        adjust(block)
    assert isinstance(raised.value, MemoryError)
    assert isinstance(raised.value, AdjustmentError)
    monkeypatch.setattr("photogram.network.core_arrays.available_memory", lambda: 1 << 30)
    assert adjust(block).converged


def test_a_collection_that_does_not_fit_is_refused(monkeypatch):
    collection = simulate_collection(photos=4, points=20).collection
    monkeypatch.setattr("photogram.collection.result.available_memory", lambda: 1 << 20)
    with pytest.raises(OutOfMemoryError, match=r"of memory, and 1\.0 MiB are free"):
        adjust_collection(collection)


def test_what_would_not_fit_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 2**30)
    memory.require(2**30, "a table")
    with pytest.raises(OutOfMemoryError, match="a table requires 2 GiB of memory, but only 1 GiB are free"):
        memory.require(2**31, "a table")
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    memory.require(2**60, "a table")


def test_an_allocation_of_python_that_fails_is_named():
    with (
        pytest.raises(OutOfMemoryError, match="reading requires more memory than is free"),
        memory.turned("reading"),
    ):
        raise MemoryError
    with pytest.raises(InputError), memory.turned("reading"):
        raise InputError("something else")


def test_absurd_numbers_of_threads(small_block):
    expected = adjust(small_block, threads=1)
    for threads in (4000, 2**62):
        result = adjust(small_block, threads=threads)
        assert (result.photo_positions == expected.photo_positions).all()
    for threads in (0, -1):
        with raises(InputError, "error.least"):
            adjust(small_block, threads=threads)
    for threads in (2.5, 2**70):
        with pytest.raises(InputError, match="threads: must be an integer"):
            adjust(small_block, threads=threads)


def test_a_limit_of_addresses_is_divided_among_fewer_threads(machine, monkeypatch, tmp_path):
    """Products of matrices take twice the cache for each thread."""
    cache = {"sys/devices/system/cpu/cpu0/cache/index3/size": "32768K\n"}
    own = (64 << 20) + memory.STACK
    limit = 8 * own
    monkeypatch.setattr(
        resource,
        "getrlimit",
        lambda kind: (limit if kind == resource.RLIMIT_AS else resource.RLIM_INFINITY, 0),
    )
    machine({**cache, "proc/self/statm": "0 0 0 0 0 0 0"})
    assert memory.addresses_of_a_thread(tmp_path) == own
    assert memory.threads_that_fit(100, tmp_path) == 3
    assert memory.threads_that_fit(2, tmp_path) == 2
    limit = own // 2
    assert memory.threads_that_fit(4, tmp_path) == 1
    assert memory.available_memory(tmp_path) == 0


EXITING = 0x4
"""A flag of the kernel: all work of a thread is done; it may be listed for a moment after it was joined."""


def alive():
    """Return the threads of this process that have not ended."""
    found = set()
    for task in os.listdir("/proc/self/task"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            flags = Path("/proc/self/task", task, "stat").read_text().rpartition(")")[2].split()[6]
            found |= set() if int(flags) & EXITING else {task}
    return found


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="this system does not list threads")
def test_threads_have_ended_when_an_adjustment_returns():
    """Until they have, they keep buffers that those of the next adjustment may need."""
    block = simulate(strips=1, photos_per_strip=3, points_per_photo=8, seed=1).block
    adjust(block, threads=1)
    before = alive()
    for _ in range(20):
        adjust(block, threads=3)
        assert alive() <= before


SHORT = """
import resource, sys, threading
from pathlib import Path
from photogram import OutOfMemoryError, adjust, simulate

block = simulate(strips=3, photos_per_strip=12, seed=2).block
said = []
limited = threading.Event()

def work(threads):
    limited.wait()
    try:
        said.append(adjust(block, threads=threads).status)
    except OutOfMemoryError:
        said.append("refused")

# The threads of Python stand before the limit: what is short is what the adjustments would take.
workers = [threading.Thread(target=work, args=(own,)) for own in (1, None)]
for each in workers:
    each.start()
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
limit = used + int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
limited.set()
for each in workers:
    each.join()
print(*said)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="this system has no such limits")
@pytest.mark.parametrize("room", [0.05, 0.5, 1.2, 3.5])
def test_short_addresses_are_an_error_and_no_abort(room):
    """Two adjustments at once in threads of Python, with addresses for so many threads of the core.

    What a thread takes is an upper bound (buffers, stack, reserve), and is given back when it ends: between
    what is less than the buffers alone and what is enough for both, an adjustment has its addresses where the
    other does not hold them at that moment, so that each may end either way; an abort is never right.
    """
    own = memory.addresses_of_a_thread() or 160 << 20
    command = [sys.executable, "-c", SHORT, str(int(room * own) + (64 << 20))]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.split()) == 2
    assert set(done.stdout.split()) <= {"converged", "refused"}
    if room in (0.05, 3.5):
        assert set(done.stdout.split()) == {"converged" if room > 1 else "refused"}


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="this system does not list threads")
def test_no_threads_are_started_beside_those_of_the_adjustment():
    """A pool of the whole process, which solvers of a library would start, may find no threads."""
    code = "import os; from photogram import adjust, simulate; adjust(simulate(strips=1, photos_per_strip=3,"
    code += " points_per_photo=8).block, threads=2); print(len(os.listdir('/proc/self/task')))"
    own = {**os.environ, "RAYON_NUM_THREADS": "7", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=own, capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.stdout, done.stderr) == ("1\n", "")


ANOTHER_BEGINS = """
import resource, threading
from pathlib import Path
import numpy as np
from photogram import OutOfMemoryError, adjust, simulate
from photogram._photocore import normal

block = simulate(strips=2, photos_per_strip=6, seed=2).block
numbers = np.zeros(1_900_000)
unlimited = resource.getrlimit(resource.RLIMIT_AS)
done = []

def fails(progress):
    if done or progress.iteration is None:
        return
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + (2 << 20), unlimited[1]))
    # It takes the reserve.
    normal(numbers)
    resource.setrlimit(resource.RLIMIT_AS, unlimited)
    other = threading.Thread(target=lambda: done.append(adjust(block).status))
    other.start()
    other.join()

try:
    done.append(adjust(block, progress=fails, tolerance=1e-12).status)
except OutOfMemoryError:
    done.append("refused")
print(*done)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="this system has no such limits")
def test_a_job_that_begins_does_not_make_another_forget_that_memory_is_short():
    done = subprocess.run(
        [sys.executable, "-c", ANOTHER_BEGINS], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.stdout, done.stderr) == ("converged refused\n", "")


SHORT_THREADS = """
import threading
import numpy as np
from photogram import adjust, memory, resect, simulate

block = simulate(strips=2, photos_per_strip=3, points_per_photo=8, seed=1).block
ground = np.array([[0.0, 0, 10], [800, 50, 20], [750, 900, 0], [30, 820, 40], [400, 420, 5]])
xy = np.array([[-40.0, -44], [42, -39], [37, 48], [-37, 41], [1, -1]])

def after(times, work):
    for _ in range(times):
        each = threading.Thread(target=work)
        each.start()
        each.join()
    return memory.resident_memory()

def resected():
    resect(ground, xy, -152.0, image_sd=0.5)

after(20, lambda: adjust(block))
first = after(100, resected)
print(after(400, resected) - first)
"""


@pytest.mark.skipif(memory.resident_memory() is None, reason="this system does not tell what a process holds")
def test_threads_of_python_leave_nothing_behind():
    """One that became a pool of its own would leave 13 KiB: it is one for as long as the process lives."""
    done = subprocess.run(
        [sys.executable, "-c", SHORT_THREADS], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.stderr == ""
    assert int(done.stdout) < 400 * (4 << 10), f"{int(done.stdout) / 400 / 1024:.1f} KiB each"
