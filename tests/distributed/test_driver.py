"""The driver over the tree, with nodes that are solved densely: in one process."""

import resource
from dataclasses import replace

import numpy as np
import pytest
from toy import OPTIONS, ToyEngine, adjusted, kept, make

from photogram import AdjustmentError, RankError, _photocore
from photogram.distributed.driver import Driver
from photogram.distributed.executors import Serial
from photogram.distributed.shelf import shelf
from photogram.distributed.tasks import Job


@pytest.fixture(autouse=True)
def empty_shelf():
    shelf.clear()
    yield
    shelf.clear()


def run(folder, tree, *, options=OPTIONS, memory=None, executor=None, resume=False, progress=None):
    job = Job(folder, ToyEngine(), _photocore.__version__, memory=memory)
    executor = executor or Serial(folder)
    try:
        return Driver(job, tree, executor, options, progress).run(resume=resume)
    finally:
        executor.stop()


def agrees(folder, tree, outcome):
    x, q, redundancy, total, changes = adjusted(folder)
    own, own_q, own_redundancy = kept(folder, len(tree))
    sd = np.sqrt(np.diag(q))
    assert np.abs((own - x) / sd).max() < 1e-9
    known = np.isfinite(own_q)
    assert known.mean() > 0.02
    assert np.diag(known).all()
    assert np.abs((own_q - q) / np.outer(sd, sd))[known].max() < 1e-10
    assert np.abs(own_redundancy - redundancy).max() < 1e-10
    assert sum(outcome.sums_of_squares) == pytest.approx(total, rel=1e-12)
    assert [each.largest_change for each in outcome.iterations] == pytest.approx(changes, rel=1e-5)
    assert outcome.status == "converged"


@pytest.mark.parametrize("parts", [1, 2, 4, 16])
def test_parts_give_what_the_whole_gives(tmp_path, parts):
    tree = make(tmp_path, 40, 60, parts)
    agrees(tmp_path, tree, run(tmp_path, tree))


def test_steps_that_are_rounding_are_the_end(tmp_path):
    tree = make(tmp_path, 40, 60, 4)
    outcome = run(tmp_path, tree, options=replace(OPTIONS, limit=1e-300))
    assert outcome.status == "converged"
    assert len(outcome.iterations) < OPTIONS.max_iterations
    assert all(each.largest_change < 1e-6 for each in outcome.iterations[-5:])


def test_factors_that_do_not_fit_are_formed_again(tmp_path):
    tree = make(tmp_path, 40, 60, 4)
    roomy = run(tmp_path, tree)
    before = kept(tmp_path, len(tree))
    tight = run(tmp_path, tree, memory=1)
    assert tight == roomy
    for one, other in zip(before, kept(tmp_path, len(tree)), strict=True):
        np.testing.assert_array_equal(one, other)
    agrees(tmp_path, tree, tight)


class Shuffled(Serial):
    """Tells of tasks in another order than that in which they were done."""

    random = np.random.default_rng(3)

    def first(self, handles):
        """Return any task."""
        return self.random.choice(np.array(sorted(handles), dtype=object))


def test_the_order_of_arrival_changes_no_bit(tmp_path):
    tree = make(tmp_path, 40, 60, 4)
    expected = run(tmp_path, tree), kept(tmp_path, len(tree))
    found = run(tmp_path, tree, executor=Shuffled(tmp_path)), kept(tmp_path, len(tree))
    assert found[0] == expected[0]
    for one, other in zip(found[1], expected[1], strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_full_disk_leaves_what_the_run_is_taken_up_from(tmp_path):
    tree = make(tmp_path, 40, 60, 4)
    expected = run(tmp_path, tree), kept(tmp_path, len(tree))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)

    def fill(told):
        if told.phase == "iteration":
            resource.setrlimit(resource.RLIMIT_FSIZE, (64, hard))

    directory = tmp_path / "temporary"
    directory.mkdir()
    try:
        with pytest.raises(AdjustmentError, check=lambda error: error.code == "parts.not-written"):
            run(tmp_path, tree, progress=fill, executor=Serial(directory))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(directory.iterdir())
    found = run(tmp_path, tree, resume=True), kept(tmp_path, len(tree))
    # What was formed once more at the values where the run died counts.
    assert replace(found[0], formations=expected[0].formations) == expected[0]
    for one, other in zip(found[1], expected[1], strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("phase", ["form", "solve", "invert"])
def test_a_run_that_is_stopped_is_taken_up(tmp_path, phase):
    tree = make(tmp_path, 40, 60, 4)
    expected = run(tmp_path, tree), kept(tmp_path, len(tree))
    for each in tmp_path.glob("kept*"):
        each.unlink()
    passed = []

    def stop(told):
        passed.append(told.phase)
        if told.phase == phase and passed.count("iteration") >= 1 + (phase == "invert") and told.done == 2:
            raise KeyboardInterrupt

    (tmp_path / "progress.json").unlink()
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, tree, progress=stop)
    found = run(tmp_path, tree, resume=True), kept(tmp_path, len(tree))
    assert replace(found[0], formations=0) == replace(expected[0], formations=0)
    for one, other in zip(found[1], expected[1], strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_is_not_determined_is_told_by_its_node(tmp_path):
    tree = make(tmp_path, 40, 60, 4)
    with np.load(tmp_path / "toy.npz") as file:
        given = dict(file)
    alone = given["point"] == given["point"][0]
    given["homes"][given["point"][0]] = given["homes"][given["point"][1]]
    keep = ~alone
    given["station"], given["point"], given["z"] = (given[name][keep] for name in ("station", "point", "z"))
    np.savez(tmp_path / "toy.npz", **given)
    with pytest.raises(RankError, match="is singular"):
        run(tmp_path, tree)
