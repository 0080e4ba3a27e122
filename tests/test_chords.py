"""Near the end of a block that calibrates its cameras a step is followed by a chord (docs/adjustment.md)."""

import numpy as np
import pytest

import photogram
from photogram import Camera, adjust, adjust_in_parts
from photogram.distributed import Division, driver, tasks

TRUE = {"fx": 152.7, "fy": 152.7, "cx": 0.02, "cy": -0.01, "k1": -6e-4, "k2": 2e-4, "p1": 2e-5, "p2": -3e-5}
FREE = dict.fromkeys(TRUE, np.inf)
START = {"fx": 152.8, "fy": 152.8, "cx": 0.0, "cy": 0.0}


@pytest.fixture(scope="module")
def block():
    lenses = [Camera("opencv", TRUE, unit="mm", name=name) for name in ("A", "B")]
    starts = [Camera("opencv", START, FREE, unit="mm", name=name) for name in ("A", "B")]
    shape = {"strips": 4, "photos_per_strip": 14, "points_per_photo": 40, "seed": 5}
    return photogram.simulate(**shape, cameras=lenses, start_cameras=starts).block


def apart(one, other):
    """Return by how much poses differ at the most, in standard deviations."""
    sd = np.sqrt(np.diagonal(one.photo_cofactors, axis1=1, axis2=2))
    values = [np.hstack([each.photo_positions, each.photo_attitudes]) for each in (one, other)]
    return (np.abs(values[0] - values[1]) / sd).max()


def lengths(result):
    return [iteration.largest_change for iteration in result.iterations]


@pytest.fixture(scope="module")
def plain(block):
    """Adjust by plain steps, which a loss takes; so far out, it leaves everything as it is."""
    return adjust(block, loss=("huber", 1e6))


@pytest.mark.parametrize("parts", [None, 1, 2, 5])
def test_a_chord_takes_the_place_of_a_formation(block, plain, parts):
    found = adjust(block) if parts is None else adjust_in_parts(block, Division(parts=parts))
    assert found.converged
    assert found.formations == len(found.iterations) == len(plain.iterations) - 1
    # Chords fall by about as much as full steps: the last of both is about as long.
    assert lengths(found)[-1] == pytest.approx(lengths(plain)[-1], rel=0.5)
    assert apart(found, plain) < 1e-6
    for one, other in zip(found.cameras, plain.cameras, strict=True):
        assert (np.abs(one.values - other.values) < 1e-6 * np.sqrt(np.diag(one.cofactors))).all()
    scale = np.sqrt(np.einsum("kii,kjj->kij", found.photo_cofactors, found.photo_cofactors))
    assert (np.abs(found.photo_cofactors - plain.photo_cofactors) / scale).max() < 1e-6


def test_parts_take_the_steps_of_one_process(block):
    one, parts = adjust(block), adjust_in_parts(block, Division(parts=3))
    assert lengths(parts) == pytest.approx(lengths(one), rel=1e-6)


def test_a_factor_that_is_lost_on_the_way_of_a_chord_is_formed_again(block, monkeypatch):
    lost = []

    def losing(job, number, *given):
        if not lost:
            lost.append(number)
            tasks.shelf.drop(lambda key: key[0] == "factor")
        return tasks.solved_chord(job, number, *given)

    expected = adjust_in_parts(block, Division(parts=3))
    monkeypatch.setattr(driver, "solved_chord", losing)
    found = adjust_in_parts(block, Division(parts=3))
    assert lost
    assert lengths(found) == lengths(expected)
    assert apart(found, expected) < 1e-12


def test_without_a_factor_there_is_no_chord(block, monkeypatch):
    def losing(job, number, *given):
        tasks.shelf.drop(lambda key: key[0] == "factor")
        return tasks.reduced_chord(job, number, *given)

    expected = adjust_in_parts(block, Division(parts=3))
    monkeypatch.setattr(driver, "reduced_chord", losing)
    found = adjust_in_parts(block, Division(parts=3))
    assert len(found.iterations) == len(expected.iterations) + 1
    assert apart(found, expected) < 1e-6


def test_known_cameras_take_plain_steps(block):
    known = block.replace(cameras=[Camera("opencv", TRUE, unit="mm", name=name) for name in ("A", "B")])
    found, plain = adjust(known), adjust_in_parts(known, Division(parts=2))
    assert len(found.iterations) == len(plain.iterations)
    assert apart(found, plain) < 1e-9
