"""Blocks in parts by the core: what one process gives."""

import re

import numpy as np
import pytest
from test_parts import tied_block

import photogram
from example_scripts import load
from message_codes import raises
from photogram import (
    AdjustmentError,
    AsPublished,
    Distance,
    InputError,
    OutOfMemoryError,
    RankError,
    adjust,
    adjust_in_parts,
    adjust_started,
)
from photogram.distributed import Division, plan_in_parts
from photogram.distributed import adjust as of_blocks
from photogram.distributed.nodes import CoreEngine
from photogram.distributed.run import read_manifest
from photogram.network import Drift, Relative, with_gnss, with_rig


@pytest.fixture(scope="module")
def block():
    return photogram.simulate(strips=6, photos_per_strip=24, points_per_photo=40, seed=3).block


@pytest.fixture(scope="module")
def whole(block):
    return adjust(block)


def agrees(found, whole, least=1e-9, *, tied=False):
    """Compare with one process: values in standard deviations, cofactors as correlations.

    Points that are tied are intersected anew after a long first step in one process, and not in parts: the
    way there is another one, and the end the same.
    """
    sd = np.sqrt(np.diagonal(whole.photo_cofactors, axis1=1, axis2=2))
    free = sd > 0
    values = [np.hstack([each.photo_positions, each.photo_attitudes]) for each in (found, whole)]
    assert np.abs((values[0] - values[1])[free] / sd[free]).max() < least
    point_sd = np.sqrt(np.diagonal(whole.point_cofactors, axis1=1, axis2=2))
    used = np.isfinite(point_sd) & (point_sd > 0)
    assert np.abs((found.point_positions - whole.point_positions)[used] / point_sd[used]).max() < least
    for name, deviations in (("photo_cofactors", sd), ("point_cofactors", point_sd)):
        scale = np.einsum("ij,ik->ijk", deviations, deviations)
        apart = getattr(found, name) - getattr(whole, name)
        good = np.isfinite(scale) & (scale > 0)
        assert np.abs(apart[good] / scale[good]).max() < least
    for name in ("residuals", "redundancy", "photo_redundancy", "point_redundancy", "point_rays"):
        np.testing.assert_allclose(getattr(found, name), getattr(whole, name), rtol=0, atol=least)
    # Where the redundancy is next to nothing, test values are quotients of rounding.
    tested = whole.redundancy > 1e-3
    np.testing.assert_allclose(found.standardized[tested], whole.standardized[tested], rtol=0, atol=1e-6)
    assert found.status == whole.status
    assert len(found.iterations) == len(whole.iterations)
    assert found.degrees_of_freedom == whole.degrees_of_freedom
    assert found.variance_of_unit_weight == pytest.approx(whole.variance_of_unit_weight, rel=1e-11)
    last = -1 if tied else 0
    for one, other in zip(found.iterations[last:], whole.iterations[last:], strict=True):
        assert one.weighted_sum_of_squares == pytest.approx(other.weighted_sum_of_squares, rel=1e-11)
        assert tied or one.largest_change == pytest.approx(other.largest_change, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("parts", [2, 4, 16])
def test_parts_give_what_one_process_gives(block, whole, parts):
    found = adjust_in_parts(block, Division(parts=parts))
    agrees(found, whole)
    assert found.messages == whole.messages
    assert found.sums_of_squares.total == pytest.approx(whole.sums_of_squares.total, rel=1e-11)
    assert sorted(found.photo_order.tolist()) == list(range(len(block.photo_ids)))


def gross():
    """Return a block with GNSS positions and gross errors in its images."""
    made = photogram.simulate(strips=4, photos_per_strip=12, points_per_photo=40, seed=3)
    block = with_gnss(made, sd=0.05, seed=2).block
    xy = block.image_xy.copy()
    xy[::97] += 0.2 * np.sign(np.random.default_rng(5).standard_normal(xy[::97].shape))
    return block.replace(image_xy=xy)


@pytest.mark.parametrize(("make", "loss"), [(tied_block, "huber"), (gross, "cauchy")])
def test_losses_weight_in_parts_what_they_do_in_one_process(make, loss):
    block = make()
    whole = adjust(block, loss=loss)
    found = adjust_in_parts(block, Division(parts=4), loss=loss)
    agrees(found, whole, 1e-6, tied=make is tied_block)
    np.testing.assert_allclose(found.image_weights, whole.image_weights, rtol=0, atol=1e-7)
    assert (whole.image_weights < 0.5).sum() > 2
    assert "loss of scale" in " ".join(map(str, whole.messages))
    assert found.messages == whole.messages


def test_cameras_ties_and_common_unknowns_cross_cuts():
    block = tied_block()
    block = block.replace(
        observations=[each for each in block.observations if not isinstance(each, Relative)]
    )
    whole, found = adjust(block), adjust_in_parts(block, Division(parts=4))
    agrees(found, whole, tied=True)
    for one, other in zip(found.cameras, whole.cameras, strict=True):
        np.testing.assert_allclose(one.values, other.values, rtol=1e-12)
        np.testing.assert_allclose(one.cofactors, other.cofactors, rtol=1e-8, atol=1e-20)
    for one, other in zip(found.unknowns, whole.unknowns, strict=True):
        np.testing.assert_allclose(one.cofactors, other.cofactors, rtol=1e-8, atol=1e-20)
        np.testing.assert_allclose(one.redundancy, other.redundancy, rtol=1e-8)
        assert one.observations == other.observations
    assert list(found.kinds) == list(whole.kinds)
    for kind, other in whole.kinds.items():
        for name in ("residuals", "redundancy", "standardized", "squares"):
            np.testing.assert_allclose(
                getattr(found.kinds[kind], name), getattr(other, name), rtol=1e-6, atol=1e-8
            )


def freed(block):
    """Return a block without control."""
    return block.replace(point_sd=np.full_like(block.point_sd, np.inf))


@pytest.mark.parametrize("parts", [2, 6])
def test_a_free_block_is_held_as_in_one_process(block, parts):
    """Its datum is that of the same photos, in whichever nodes they are."""
    found, whole = adjust_in_parts(freed(block), Division(parts=parts)), adjust(freed(block))
    assert len(whole.datum.held) == 7
    assert found.datum == whole.datum
    assert found.messages == whole.messages
    agrees(found, whole, 1e-6)


def test_what_observations_leave_open_of_a_free_block_is_held():
    """With a distance scale is given, and six unknowns are held."""
    made = photogram.simulate(strips=4, photos_per_strip=12, points_per_photo=40, seed=3)
    block, ends = freed(made.block), made.truth.point_positions[[0, -1]]
    distance = Distance(
        block.point_ids[0], block.point_ids[-1], float(np.linalg.norm(ends[1] - ends[0])), sd=0.01
    )
    block = block.replace(observations=[distance])
    found, whole = adjust_in_parts(block, Division(parts=3)), adjust(block)
    assert len(whole.datum.held) == 6
    assert found.datum == whole.datum
    agrees(found, whole, 1e-6, tied=True)


def test_a_held_photo_is_held_in_the_results_of_its_nodes(block, tmp_path):
    found = adjust_in_parts(freed(block), Division(parts=4, folder=tmp_path / "run"))
    names = {photo for photo, _ in found.datum.held}
    for node in range(len(read_manifest(tmp_path / "run").tree)):
        of_node = photogram.read_result(tmp_path / "run" / "results" / f"{node:05d}")
        held = {photo for photo, _ in of_node.datum.held}
        assert held == names & set(of_node.block.photo_ids)


@pytest.mark.parametrize("unit_variance", ["free", "unity", "redundancy"])
def test_every_unit_variance_is_that_of_one_process(block, unit_variance):
    weighted = block.replace(photo_position_sd=np.full((len(block.photo_ids), 3), 5.0))
    found = adjust_in_parts(weighted, Division(parts=3), unit_variance=unit_variance)
    agrees(found, adjust(weighted, unit_variance=unit_variance))


def test_nodes_are_scaled_by_what_all_redundancy_numbers_give(tmp_path):
    """They are known when all nodes are inverted, and written."""
    block, folder = tied_block(), tmp_path / "run"
    whole = adjust(block, unit_variance="redundancy")
    found = adjust_in_parts(block, Division(parts=2, folder=folder), unit_variance="redundancy")
    agrees(found, whole, tied=True)
    sd = dict(zip(block.photo_ids, whole.photo_sd, strict=True))
    for node in range(3):
        of_node = photogram.read_result(folder / "results" / f"{node:05d}")
        assert of_node.variance_of_unit_weight == found.variance_of_unit_weight
        expected = np.array([sd[name] for name in of_node.block.photo_ids])
        np.testing.assert_allclose(of_node.photo_sd, expected, rtol=1e-8)
    for one, other in zip(of_node.cameras, whole.cameras, strict=True):
        np.testing.assert_allclose(one.sd, other.sd, rtol=1e-8)
    with raises(InputError, "adjust.redundancy-numbers"):
        adjust_in_parts(block, Division(parts=2), unit_variance="redundancy", covariance=False)


@pytest.mark.parametrize(("percent", "limit"), [(5.0, 4), (1e-6, 8), (1e-9, 2)])
def test_the_iteration_of_1987_is_that_of_one_process(percent, limit):
    block, options = tied_block(), {"tolerance": AsPublished(percent), "max_iterations": limit}
    whole, found = adjust(block, **options), adjust_in_parts(block, Division(parts=3), **options)
    agrees(found, whole)
    assert found.messages == whole.messages
    assert (whole.status == "converged") == (limit > 2)


def test_weighted_cameras_and_unknowns_count_in_the_free_unit_variance():
    block = tied_block()
    whole = adjust(block, unit_variance="free")
    found = adjust_in_parts(block, Division(parts=2), unit_variance="free")
    assert found.degrees_of_freedom == whole.degrees_of_freedom
    assert found.variance_of_unit_weight == pytest.approx(whole.variance_of_unit_weight, rel=1e-9)


def test_photos_without_poses_are_started_and_adjusted_in_parts(block):
    started = photogram.first_values(block.replace(photo_positions=np.nan, photo_attitudes=np.nan))
    found = adjust_started(started, by=adjust_in_parts, division=Division(parts=2))
    assert type(found) is not photogram.Result
    agrees(found, adjust_started(started))


def test_without_covariances(block):
    whole = adjust(block, covariance=False)
    found = adjust_in_parts(block, Division(parts=4), covariance=False)
    np.testing.assert_allclose(found.photo_positions, whole.photo_positions, rtol=0, atol=1e-9)
    assert np.isnan(found.photo_cofactors).all()
    assert found.variance_of_unit_weight == pytest.approx(whole.variance_of_unit_weight, rel=1e-11)


def test_memory_decides_whether_there_are_parts(block, whole, monkeypatch):
    assert type(adjust_in_parts(block, Division(memory="1GB"))) is photogram.Result
    monkeypatch.setattr(of_blocks, "WHOLE", 1e9 / len(block.image_xy))
    found = adjust_in_parts(block, Division(memory="1GB"))
    assert type(found) is not photogram.Result
    agrees(found, whole)


def test_a_rig_across_parts():
    simulated = photogram.simulate(strips=4, photos_per_strip=12, points_per_photo=40, seed=3)
    block = with_rig(simulated, [[0.3, 0.0, 0.05]], [[0.0, 0.5, 0.02]], seed=1).block
    found, alone = adjust_in_parts(block, Division(parts=4)), adjust(block)
    agrees(found, alone)
    for one, other in zip(found.unknowns, alone.unknowns, strict=True):
        assert (np.abs(one.values - other.values) <= 1e-9 * one.sd).all()


def test_drifts_of_strips_across_parts():
    simulated = photogram.simulate(strips=4, photos_per_strip=24, points_per_photo=40, seed=3)
    made = with_gnss(simulated, sd=0.05, shift_sd=0.5, drift_sd=0.01, seed=2)
    block = made.block
    drifts = [each for each in block.unknowns if isinstance(each, Drift)]
    assert len(drifts) == 4
    assert all(each.epoch is None for each in drifts)
    found, alone = adjust_in_parts(block, Division(parts=4)), adjust(block)
    agrees(found, alone)
    for one, other in zip(found.unknowns, alone.unknowns, strict=True):
        assert one.name == other.name
        assert (np.abs(one.values - other.values) <= 1e-9 * one.sd).all()
        np.testing.assert_allclose(one.cofactors, other.cofactors, rtol=1e-8)


def test_a_plan_is_what_is_needed(block, tmp_path):
    plan = plan_in_parts(block, Division(parts=4, folder=tmp_path))
    assert plan.of("images").sum() == len(block.image_xy)
    assert sum(plan.photos) == len(block.photo_ids)
    engine, contributions = CoreEngine(), {}
    for node, children in enumerate(read_manifest(tmp_path).tree.children):
        own = engine.node(tmp_path, node)
        formed = own.form(
            own.initial, [contributions.pop(c) for c in children], damping=0.0, curved=False, threads=1
        )
        contributions[node] = formed.contribution
        sent = sum(each.nbytes for each in contributions[node])
        assert sent == plan.predictions[node]["contribution_bytes"]
    figures = {fact.name: (fact.value, fact.note) for fact in plan.document().highlights}
    assert figures["Parts"] == ("4", "3 separators")
    assert figures["Workers"] == ("1", "")
    assert plan.document().table("levels").frame().nodes.tolist() == [1, 2, 4]
    assert "Predicted time" in plan.report()


def test_a_plan_that_does_not_fit_says_what_would(block):
    plan = plan_in_parts(block, Division(parts=2, memory=4_000_000))
    with pytest.raises(OutOfMemoryError, check=lambda error: error.code == "parts.node-too-large"):
        plan.check()


def test_a_run_is_taken_up_in_its_folder_alone(block, whole, tmp_path):
    def stop(told):
        if told.phase == "iteration":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        adjust_in_parts(block, Division(parts=2, folder=tmp_path), progress=stop)
    agrees(adjust_in_parts(block, Division(parts=2, folder=tmp_path)), whole)
    with pytest.raises(InputError, check=lambda error: error.code == "parts.other-run"):
        adjust_in_parts(block, Division(parts=2, folder=tmp_path), tolerance=1e-3)


def test_what_is_not_determined_is_named(block):
    """One control point gives a place, and is the user's datum: what it leaves open is not held."""
    sd = np.full_like(block.point_sd, np.inf)
    control = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[0]
    sd[control] = block.point_sd[control]
    with pytest.raises(RankError):
        adjust_in_parts(block.replace(point_sd=sd), Division(parts=2))


def test_what_parts_cannot_do_is_refused(block):
    found = adjust_in_parts(block, Division(parts=2))
    with pytest.raises(AdjustmentError, check=lambda error: error.code == "parts.one-process"):
        found.covariances()
    with pytest.raises(InputError, check=lambda error: error.code == "parts.memory"):
        Division(memory="much")
    with pytest.raises(InputError, match=r"^parts"):
        Division(parts=0)
    with pytest.raises(InputError, match=r"less than 2\^63"):
        Division(memory="9" * 400 + "GB")


def test_the_example_is_right(capsys):
    script = load("in_parts")
    script.main()
    assert re.search(r"parts +4 \(3 separators\)", capsys.readouterr().out)
    block = script.flown(seed=12)
    values, redundancy = script.apart(adjust_in_parts(block, Division(parts=3)), adjust(block))
    assert values < 1e-9
    assert redundancy < 1e-9


def test_what_is_held_is_not_tested_in_parts():
    """Its score needs the normal equations of the whole: the verdict once ended in an error."""
    block = photogram.simulate(strips=3, photos_per_strip=8, points_per_photo=40, seed=4).block
    held = np.isfinite(block.point_sd).all(axis=1)
    positions = block.point_positions.copy()
    positions[np.flatnonzero(held)[3], 2] += 50.0
    wrong = block.replace(
        point_positions=positions, point_sd=np.where(held[:, np.newaxis], 0.0, block.point_sd)
    )
    parts, whole = adjust_in_parts(wrong, Division(parts=2)), adjust(wrong)
    assert parts.verdict.code == whole.verdict.code == "model"
    names = [{each.name.split(":")[0] for each in result.verdict.tests} for result in (parts, whole)]
    assert names[1] - names[0] >= {"fixed values"}
