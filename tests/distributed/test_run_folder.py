"""The folder of a run: one run at a time, and nothing in it that belongs elsewhere."""

import json
import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from test_parts import OPTIONS, tied_block
from test_streamed import project_of

import photogram
from photogram import InputError, adjust_in_parts
from photogram.distributed import Division, plan_in_parts
from photogram.distributed.adjust import fingerprint
from photogram.distributed.executors import connected
from photogram.distributed.files import alone
from photogram.distributed.nodes import CoreEngine
from photogram.distributed.run import partition, read_node
from photogram.distributed.shelf import shelf
from photogram.formats import ReadOptions
from photogram.formats.in_parts import on_disk


@pytest.fixture(scope="module")
def block():
    return photogram.simulate(strips=2, photos_per_strip=8, points_per_photo=12, seed=5).block


@pytest.fixture(scope="module")
def finished(block, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    adjust_in_parts(block, Division(parts=2, folder=folder))
    return folder


@pytest.fixture
def run(finished, tmp_path):
    shelf.clear()
    return shutil.copytree(finished, tmp_path / "run")


def refused(block, run, match, *codes):
    with pytest.raises(InputError, match=match, check=lambda error: not codes or error.code in codes):
        adjust_in_parts(block, Division(parts=2, folder=run))


def test_a_finished_run_is_taken_up(block, run):
    assert adjust_in_parts(block, Division(parts=2, folder=run)).status == "converged"


@pytest.mark.parametrize(
    "content",
    [b"[]", b"{}", b"7", b"\xff", b"{", b'{"state": "1"}'],
    ids=["list", "empty", "number", "bytes", "cut", "incomplete"],
)
@pytest.mark.parametrize("name", ["progress.json", "run.json", "parts/00000/part.json"])
def test_documents_that_are_none_of_a_run_are_refused(block, run, name, content):
    (run / name).write_bytes(content)
    refused(block, run, rf"{name.rsplit('/')[-1]}: ", "file.changed", "parts.no-document", "parts.not-read")


@pytest.mark.parametrize(
    ("name", "member"),
    [("progress.json", "iterations"), ("run.json", "seals"), ("parts/00000/part.json", "node")],
)
def test_documents_that_were_changed_are_refused(block, run, name, member):
    document = json.loads((run / name).read_text())
    del document[member]
    (run / name).write_text(json.dumps(document))
    refused(block, run, "the file was changed after it was written")


def test_a_part_in_the_place_of_another_is_refused(block, run):
    shutil.rmtree(run / "parts" / "00000")
    shutil.copytree(run / "parts" / "00001", run / "parts" / "00000")
    refused(block, run, r"00000/part\.json: ", "parts.other-node")


def test_a_table_of_another_part_is_refused(block, run):
    shutil.copyfile(run / "parts" / "00001" / "points.parquet", run / "parts" / "00000" / "points.parquet")
    refused(block, run, r"points\.parquet: the checksum must agree with part\.json")


def test_the_part_of_another_run_is_refused(block, run, tmp_path):
    other = block.replace(image_xy=block.image_xy + 0.001)
    partition(other, tmp_path / "other", 2, OPTIONS, fingerprint(other, OPTIONS))
    shutil.rmtree(run / "parts" / "00000")
    shutil.copytree(tmp_path / "other" / "parts" / "00000", run / "parts" / "00000")
    refused(block, run, r"00000/part\.json: ", "parts.other-node")


@pytest.mark.parametrize("kind", ["exchanged", "shifted", "cut", "of another node"])
def test_states_are_those_that_were_written(block, run, kind):
    states = sorted((run / "states" / "00000").iterdir())
    contents = [path.read_bytes() for path in states]
    assert len(states) == 2
    for path, other in zip(states, contents[::-1], strict=True):
        if kind == "exchanged":
            path.write_bytes(other)
        elif kind == "shifted":
            with np.load(path) as file:
                arrays = dict(file)
            np.savez(path, **{**arrays, "values": np.roll(arrays["values"], 1)})
        elif kind == "cut":
            path.write_bytes(path.read_bytes()[:-40])
        else:
            shutil.copyfile(run / "states" / "00001" / path.name, path)
    refused(block, run, r"states/00000/\d+\.npz: ", "parts.other-state", "parts.not-read")


def test_the_progress_of_another_run_is_refused(block, run, tmp_path):
    other = block.replace(image_xy=block.image_xy + 0.001)
    adjust_in_parts(other, Division(parts=2, folder=tmp_path / "other"))
    shutil.copyfile(tmp_path / "other" / "progress.json", run / "progress.json")
    refused(block, run, r"progress\.json: ", "parts.other-progress")


def test_two_runs_in_one_folder_are_refused(block, tmp_path):
    with alone(tmp_path):
        refused(block, tmp_path, rf"process {os.getpid()} on", "parts.busy")
    assert adjust_in_parts(block, Division(parts=2, folder=tmp_path)).status == "converged"


def test_a_run_of_another_process_holds_its_folder_until_it_dies(block, tmp_path):
    code = "import sys, pathlib; from photogram.distributed.files import alone\n"
    code += "with alone(pathlib.Path(sys.argv[1])): print('in', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", code, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as holder:
        holder.stdout.readline()
        with pytest.raises(InputError, match=f"process {holder.pid} on"):
            plan_in_parts(block, Division(parts=2, folder=tmp_path))
        holder.kill()
    plan_in_parts(block, Division(parts=2, folder=tmp_path))


def test_more_parts_than_photos_are_refused(block, tmp_path):
    with pytest.raises(InputError, check=lambda error: error.code == "parts.too-many"):
        adjust_in_parts(block, Division(parts=100_000, folder=tmp_path))
    assert not (tmp_path / "parts").exists()
    assert len(plan_in_parts(block, Division(parts=16)).tree) == 31


def test_a_run_from_disk_has_the_same_limits(block, tmp_path):
    path = project_of(block, tmp_path / "project")

    def plan(parts):
        with on_disk(path, ReadOptions(), tmp_path / "run", Division(parts=parts)) as run:
            run.plan()

    with pytest.raises(InputError, check=lambda error: error.code == "parts.too-many"):
        plan(100_000)
    with alone(tmp_path / "run"), pytest.raises(InputError, check=lambda error: error.code == "parts.busy"):
        plan(2)


@pytest.mark.skipif(not os.path.exists("/proc/net/tcp"), reason="no /proc/net")
def test_a_local_cluster_listens_on_this_machine_alone():
    pytest.importorskip("distributed")
    with connected("local", 2, 2**28) as client:
        processes = {os.getpid(), *client.run(os.getpid).values()}
        found = {process: _listening(process) for process in processes}
    # The scheduler with its page is in this process; each worker has its own.
    assert all(len(each) >= 2 for each in found.values()), found
    assert {address for each in found.values() for address in each} == {"0100007F"}


def _listening(process):
    """Return the addresses of the sockets that a process listens on, as the system writes them."""
    held = []
    for each in Path(f"/proc/{process}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed meanwhile
            held.append(os.readlink(each))
    inodes = {match[1] for each in held if (match := re.fullmatch(r"socket:\[(\d+)\]", each))}
    tables = [path.read_text().splitlines()[1:] for path in Path("/proc/net").glob("tcp*")]
    rows = [line.split() for table in tables for line in table]
    return [row[1].split(":")[0] for row in rows if row[3] == "0A" and row[9] in inodes]


def test_unknowns_of_nodes_below_have_their_names_where_they_are_undetermined(tmp_path):
    block = tied_block()
    manifest = partition(block, tmp_path, 4, OPTIONS, fingerprint(block, OPTIONS))
    parts = [read_node(tmp_path, manifest, node) for node in range(len(manifest.tree))]
    larger = [each for each in parts if len(each.common) > len(each.block.unknowns)]
    assert larger
    for each in larger:
        last = len(each.common) - 1
        combination = ([], [], [last], [], [])
        failure = CoreEngine().failure(tmp_path, each.node, ("undetermined photos", "", [combination], []))
        assert f"moving {each.common[last].title}" in str(failure)
