"""What nodes take is what the plan says, and a process gives up what does not fit."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import photogram
from photogram import InnerConstraints
from photogram.distributed import Division, plan_in_parts
from photogram.distributed.shelf import Shelf
from photogram.memory import give_back, resident_memory

STATUS = Path("/proc/self/status")
BASE = 8 << 20
MEASURE = """
import sys
from pathlib import Path
import numpy as np
from photogram.distributed.nodes import CoreEngine
from photogram.memory import give_back, resident_memory

def held():
    give_back()
    return resident_memory()

def most():
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return 1024 * int(lines["VmHWM"].split()[0])

engine, folder, number, columns = CoreEngine(), Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
# Once, so that what libraries keep for themselves is there before anything is measured.
engine.node(folder, number)
before = held()
node = engine.node(folder, number)
print(held() - before)
Path("/proc/self/clear_refs").write_text("5")
formed = node.form(node.initial, [], damping=0.0, curved=False, threads=0)
outer, datum = len(node.outer), None
if columns:
    b, t = np.ones((2, columns, len(node.initial)))
    formed.reduce(b.copy(), threads=0)
print(held() - before)
if columns:
    w = formed.complete(np.zeros(columns * outer), threads=0)
    datum = t, w, np.eye(columns), node.initial, 1.0, []
found, _ = formed.invert(np.zeros(outer * (outer + 1) // 2), node.initial, datum=datum, threads=0)
engine.keep(folder, number, found, 1.0)
print(most() - before)
"""


@pytest.mark.skipif(not STATUS.exists(), reason="only Linux tells what a process holds")
@pytest.mark.parametrize("datum", [None, InnerConstraints()])
def test_a_node_takes_what_the_plan_says(tmp_path, datum):
    block = photogram.simulate(strips=32, photos_per_strip=80, control="none", seed=3).block
    plan = plan_in_parts(block, Division(parts=2, folder=tmp_path), datum=datum)
    largest = int(np.argmax(plan.of("memory_bytes")))
    said = plan.predictions[largest]
    # What allocators keep for themselves is not that of the node.
    plain = {
        "ARROW_DEFAULT_MEMORY_POOL": "system",
        "MALLOC_ARENA_MAX": "1",
        "MALLOC_TRIM_THRESHOLD_": "65536",
    }
    node, formed, most = _measured(tmp_path, largest, 0 if datum is None else 7, plain)
    if datum is not None:
        # B and T lie on disk between.
        formed -= 2 * 8 * 7 * plan.of("points")[largest]
    # A part of it does not grow with the node.
    assert node == pytest.approx(said["node_bytes"], abs=BASE)
    assert formed == pytest.approx(said["node_bytes"] + said["factor_bytes"], rel=0.2)
    assert most == pytest.approx(said["memory_bytes"], rel=0.2)


def _measured(run, number, columns, environment):
    command = [sys.executable, "-c", MEASURE, str(run), str(number), str(columns)]
    everything = {**os.environ, **environment}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=everything)
    return [int(line) for line in done.stdout.split()]


@pytest.mark.skipif(resident_memory() is None, reason="nothing tells here what a process holds")
def test_what_a_process_holds_is_what_it_has_taken():
    give_back()
    before = resident_memory()
    taken = np.ones(2**24)
    held = resident_memory()
    assert before is not None
    assert held is not None
    assert held - before == pytest.approx(taken.nbytes, rel=0.1)
    del taken
    give_back()
    after = resident_memory()
    assert after is not None
    assert after - before < 2**24


def test_nodes_go_before_factors_and_the_last_ones_first(monkeypatch):
    monkeypatch.setattr("photogram.distributed.shelf.resident_memory", lambda: None)
    shelf = Shelf()
    for number in range(3):
        shelf.put(("node", "run", number), number, 10.0)
        shelf.put(("factor", "run", number, "at"), number, 20.0)

    def kept():
        return list(shelf._kept)

    shelf.make_room(20.0, 100, ("run", 2))
    assert kept() == [
        ("node", "run", 0),
        ("factor", "run", 0, "at"),
        ("factor", "run", 1, "at"),
        ("node", "run", 2),
        ("factor", "run", 2, "at"),
    ]
    shelf.make_room(40.0, 100, ("run", 2))
    assert kept() == [("factor", "run", 0, "at"), ("node", "run", 2), ("factor", "run", 2, "at")]
    shelf.make_room(1000.0, 100, ("run", 2))
    assert kept() == [("node", "run", 2), ("factor", "run", 2, "at")]
    shelf.make_room(1000.0, None, ("run", 0))
    assert len(kept()) == 2
