"""The driver on a cluster of two processes: the same bits whoever does what, and workers that die."""

import cloudpickle
import numpy as np
import pytest
import toy
from test_driver import agrees, run
from toy import OPTIONS, ToyEngine, kept, make

from photogram import InputError, _photocore
from photogram.distributed.driver import Driver
from photogram.distributed.executors import Workers, check_workers, connected
from photogram.distributed.tasks import Job

cloudpickle.register_pickle_by_value(toy)


@pytest.fixture(scope="module")
def client():
    with connected("local", 2, 2**30) as found:
        yield found


@pytest.fixture(autouse=True)
def both_workers(client):
    """Wait for a worker that the test before has killed: it is started again."""
    client.wait_for_workers(2, timeout=60)


def on(client, folder, tree, engine=None):
    job = Job(folder, engine or ToyEngine(), _photocore.__version__, threads=1)
    executor = Workers(client)
    try:
        return Driver(job, tree, executor, OPTIONS).run()
    finally:
        executor.stop()


@pytest.fixture
def alone(tmp_path):
    """Return a network in four parts, and what one process gives."""
    tree = make(tmp_path, 40, 60, 4)
    outcome = run(tmp_path, tree)
    return tree, outcome, kept(tmp_path, len(tree))


def same(folder, tree, expected):
    for one, other in zip(kept(folder, len(tree)), expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_two_workers_give_the_bits_of_one_process(client, tmp_path, alone):
    tree, outcome, expected = alone
    assert on(client, tmp_path, tree) == outcome
    same(tmp_path, tree, expected)
    agrees(tmp_path, tree, outcome)


@pytest.mark.parametrize("kill", [("form", 0), ("solve", 2), ("keep", 1)], ids=lambda each: each[0])
def test_a_worker_that_dies_costs_its_tasks_alone(client, tmp_path, alone, kill):
    tree, outcome, expected = alone
    for each in tmp_path.glob("kept*"):
        each.unlink()
    assert on(client, tmp_path, tree, ToyEngine(kill)) == outcome
    assert (tmp_path / f"killed-{kill[0]}-{kill[1]}").exists()
    same(tmp_path, tree, expected)


def test_what_an_earlier_run_has_left_does_not_count_as_held(client, tmp_path):
    *_, before = check_workers(client, tmp_path)
    client.run(_leave, 200 << 20)
    assert min(client.run(_left).values()) == 1
    *_, held = check_workers(client, tmp_path)
    assert max(client.run(_left).values()) == 0
    assert held < before + (100 << 20)


def _leave(size):
    from photogram.distributed.shelf import shelf

    shelf.put(("node", "elsewhere", 0), b"x" * size, float(size))


def _left():
    from photogram.distributed.shelf import shelf

    return len(shelf._kept)


def test_another_version_is_refused(client, tmp_path, monkeypatch):
    workers, limit, held = check_workers(client, tmp_path)
    assert (workers, limit) == (2, 2**30)
    assert 2**26 < held < 2**30
    monkeypatch.setattr(_photocore, "__version__", "0.0.1")
    with pytest.raises(InputError, match="tcp://", check=lambda error: error.code == "parts.versions"):
        check_workers(client, tmp_path)


def test_a_folder_that_workers_do_not_see_is_refused(client, tmp_path):
    with pytest.raises(InputError, check=lambda error: error.code == "parts.no-shared-disk"):
        check_workers(client, tmp_path / "nowhere")
