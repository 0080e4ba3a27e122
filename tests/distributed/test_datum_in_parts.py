"""Datums of blocks in parts: those of one process."""

import numpy as np
import pytest
from test_blocks import agrees, freed

import photogram
from message_codes import raises
from photogram import (
    AdjustmentError,
    Camera,
    Distance,
    InnerConstraints,
    InputError,
    MinimumConstraints,
    Position,
    Spheroid,
    adjust,
    adjust_in_parts,
)
from photogram.distributed import Division, plan_in_parts
from photogram.distributed.run import read_manifest
from photogram.network import Shift

SIZE = {"strips": 4, "photos_per_strip": 10, "points_per_photo": 40, "seed": 3}


@pytest.fixture(scope="module")
def block():
    return freed(photogram.simulate(**SIZE).block)


def in_both(block, parts=4, least=1e-9, **options):
    """Adjust in parts and in one process, to rounding; compare; return both.

    Cofactors are compared as correlations; values in standard deviations, of which small datums leave little.
    """
    options.setdefault("tolerance", 1e-9)
    found = adjust_in_parts(block, Division(parts=parts), **options)
    whole = adjust(block, **options)
    assert found.datum.row == whole.datum.row
    for name in ("kind", "held", "points", "photos", "attitudes", "scale"):
        assert getattr(found.datum, name) == getattr(whole.datum, name)
    for kind in ("photo", "point"):
        q, other = getattr(found, f"{kind}_cofactors"), getattr(whole, f"{kind}_cofactors")
        sd = np.sqrt(np.diagonal(other, axis1=1, axis2=2))
        scale = np.einsum("ij,ik->ijk", sd, sd)
        assert (scale > 0).mean() > 0.9
        assert np.abs((q - other)[scale > 0] / scale[scale > 0]).max() < least
        assert (q[scale == 0] == 0).all()
        apart = getattr(found, f"{kind}_positions") - getattr(whole, f"{kind}_positions")
        assert np.abs(apart[sd[:, :3] > 0] / sd[:, :3][sd[:, :3] > 0]).max() < 1e-6
    np.testing.assert_allclose(found.photo_attitudes, whole.photo_attitudes, rtol=0, atol=1e-9)
    for name in ("residuals", "redundancy"):
        np.testing.assert_allclose(getattr(found, name), getattr(whole, name), rtol=0, atol=1e-9)
    assert found.status == whole.status == "converged"
    assert found.degrees_of_freedom == whole.degrees_of_freedom
    assert found.variance_of_unit_weight == pytest.approx(whole.variance_of_unit_weight, rel=1e-9)
    assert found.datum.lost == pytest.approx(whole.datum.lost, rel=0.1)
    for one, other in zip(found.cameras, whole.cameras, strict=True):
        np.testing.assert_allclose(one.cofactors, other.cofactors, rtol=least, atol=1e-20)
    for one, other in zip(found.unknowns, whole.unknowns, strict=True):
        scale = np.sqrt(np.outer(*[np.diag(other.cofactors)] * 2))
        assert np.abs((one.cofactors - other.cofactors)[scale > 0] / scale[scale > 0]).max() < least
    assert found.messages == whole.messages
    return found, whole


CHOSEN = {
    "all points": lambda block: InnerConstraints(),
    "all points and photos": lambda block: InnerConstraints(photos=None),
    "some": lambda block: InnerConstraints(block.point_ids[::50], block.photo_ids[3:5]),
    "scale as it is held": lambda block: InnerConstraints(scale=False),
    "attitudes": lambda block: InnerConstraints((), photos=None, attitudes=None),
    "attitudes of some": lambda block: InnerConstraints(
        block.point_ids[::9], attitudes=block.photo_ids[7:30:9], radius=500.0
    ),
    "one photo": lambda block: InnerConstraints(
        (), photos=[block.photo_ids[22]], attitudes=[block.photo_ids[22]], scale=False
    ),
}


@pytest.mark.parametrize("parts", [2, 5])
@pytest.mark.parametrize("name", CHOSEN)
def test_inner_constraints_are_those_of_one_process(block, name, parts):
    found, whole = in_both(block, parts, datum=CHOSEN[name](block))
    assert found.datum.kind == "inner constraints"
    np.testing.assert_allclose(found.point_last_corrections, whole.point_last_corrections, atol=1e-6)
    if name == "all points":
        # In no other datum is the sum of variances of the points less.
        held = np.trace(adjust(block).point_cofactors, axis1=1, axis2=2).sum()
        assert np.trace(found.point_cofactors, axis1=1, axis2=2).sum() < 0.5 * held
    if name == "one photo":
        assert (found.photo_cofactors[22] == 0).all()
        assert (found.photo_cofactors[21] != 0).any()


def test_what_observations_leave_open_is_taken_to_the_datum(block):
    """Scale is that of a distance, cameras and points of several parts hang on it."""
    truth = photogram.simulate(**SIZE).truth.point_positions
    ends = Distance(
        block.point_ids[0], block.point_ids[-1], float(np.linalg.norm(truth[0] - truth[-1])), sd=0.01
    )
    found, _ = in_both(block.replace(observations=[ends]), datum=InnerConstraints())
    assert len(found.datum.held) == 6
    assert not found.datum.scale


def test_unknown_cameras_do_not_change_with_the_datum():
    cameras = [Camera("brown", {"c": -152.74}, sd={"c": 0.1}, name=name) for name in ("first", "second")]
    made = photogram.simulate(**SIZE, cameras=cameras[:1]).block
    block = freed(made).replace(cameras=cameras, photo_cameras=np.arange(len(made.photo_ids)) % 2)
    found, _ = in_both(block, least=1e-8, datum=InnerConstraints())
    held = adjust_in_parts(block, Division(parts=3), tolerance=1e-9)
    for one, other in zip(found.cameras, held.cameras, strict=True):
        np.testing.assert_allclose(one.cofactors, other.cofactors, rtol=1e-7, atol=1e-20)


def test_shifts_and_drifts_take_up_what_moves(block):
    """Of all strips together: no node could say it alone."""
    places, noise = photogram.simulate(**SIZE).truth.photo_positions, np.random.default_rng(4)
    shift = Shift("of all strips")
    observed = places + np.array([3.0, 2.0, 1.0]) + noise.normal(0, 0.05, places.shape)
    gnss = [Position(*each, sd=0.05, shift=shift) for each in zip(block.photo_ids, observed, strict=True)]
    found, _ = in_both(block.replace(observations=gnss), datum=InnerConstraints())
    assert [unknown for _, unknown in found.datum.held] == ["X", "Y", "Z"]
    assert (found.unknowns[0].sd > 0.01).all()


def test_two_networks_that_nothing_joins_have_a_datum_each(block):
    photos, points = len(block.photo_ids), len(block.point_ids)
    both = block.replace(
        photo_ids=[*block.photo_ids, *(f"{name}'" for name in block.photo_ids)],
        point_ids=[*block.point_ids, *(f"{name}'" for name in block.point_ids)],
        photo_positions=np.vstack([block.photo_positions, block.photo_positions + np.array([9e3, 0.0, 0.0])]),
        image_photos=np.concatenate([block.image_photos, block.image_photos + photos]),
        image_points=np.concatenate([block.image_points, block.image_points + points]),
        **{
            name: np.concatenate([getattr(block, name)] * 2)
            for name in (
                *("photo_attitudes", "photo_position_sd", "photo_attitude_sd", "point_positions"),
                *("point_sd", "image_xy", "image_sd", "principal_distances"),
            )
        },
        point_check_sd=None,
    )
    found, _ = in_both(both, 4, datum=InnerConstraints())
    assert len(found.datum.held) == 14
    in_both(both, 3, datum=InnerConstraints(points=block.point_ids))


def test_geographic_coordinates_have_the_datum_of_one_process():
    spheroid = Spheroid(6378137.0, 6356752.314)
    made = photogram.simulate(**SIZE, spheroid=spheroid, origin=(0.2, 0.9, 0.0)).block
    in_both(freed(made), least=1e-7, tolerance=1e-7, datum=InnerConstraints())


@pytest.mark.parametrize(
    "options",
    [
        {"loss": "huber", "tolerance": 1e-8},
        {"covariance": "none"},
        {"unit_variance": "redundancy"},
        {"unit_variance": "unity"},
    ],
)
def test_a_datum_goes_with_other_options(block, options):
    xy = block.image_xy.copy()
    xy[::97] += 0.1
    block, least = block.replace(image_xy=xy), 1e-6 if "loss" in options else 1e-9
    if options.get("covariance") != "none":
        in_both(block, 3, least, datum=InnerConstraints(), **options)
        return
    options = {"covariance": False, "datum": InnerConstraints(), "tolerance": 1e-9}
    found, whole = adjust_in_parts(block, Division(parts=3), **options), adjust(block, **options)
    np.testing.assert_allclose(found.point_positions, whole.point_positions, rtol=0, atol=1e-8)
    assert found.datum == whole.datum


def test_what_is_held_is_chosen(block):
    photo, other = block.photo_ids[13], block.photo_ids[35]
    for datum in (
        MinimumConstraints(photo),
        MinimumConstraints(photo, (other, "Y")),
        MinimumConstraints(),
    ):
        in_both(block, 3, datum=datum)
    assert (photo, "omega") in in_both(block, 2, datum=MinimumConstraints(photo))[0].datum.held


def test_nodes_say_what_their_values_refer_to(block, tmp_path):
    found = adjust_in_parts(
        block, Division(parts=3, folder=tmp_path), datum=InnerConstraints(), unit_variance="redundancy"
    )
    for node in range(len(read_manifest(tmp_path).tree)):
        of_node = photogram.read_result(tmp_path / "results" / f"{node:05d}")
        assert of_node.datum.kind == "inner constraints"
        assert of_node.datum.scale
        rows = [block.photo_ids.index(name) for name in of_node.block.photo_ids]
        np.testing.assert_allclose(of_node.photo_sd, found.photo_sd[rows], rtol=1e-9)


def test_a_run_that_died_ends_in_its_datum(block, tmp_path):
    division, datum = Division(parts=4, folder=tmp_path), InnerConstraints(photos=None)

    def stop(told):
        if told.phase == "invert" and told.done == 3:
            raise KeyboardInterrupt

    plan = plan_in_parts(block, division, datum=datum)
    assert plan.largest > plan_in_parts(block, Division(parts=4)).largest
    with pytest.raises(KeyboardInterrupt):
        adjust_in_parts(block, division, datum=datum, progress=stop)
    agrees(adjust_in_parts(block, division, datum=datum), adjust(block, datum=datum), 1e-6)
    with pytest.raises(InputError, check=lambda error: error.code == "parts.other-run"):
        adjust_in_parts(block, division)


def test_a_datum_that_cannot_be_is_refused_before_anything_is_adjusted(block):
    told = []
    for points in (block.point_ids[:1], [block.point_ids[0]] * 3):
        with raises(InputError, "free.few"):
            adjust_in_parts(block, Division(parts=2), datum=InnerConstraints(points), progress=told.append)
    assert not [each for each in told if each.phase == "iteration"]
    with raises(InputError, "error.absent"):
        adjust_in_parts(block, Division(parts=2), datum=InnerConstraints(["nowhere"]))
    with pytest.raises(InputError, match=r"^datum"):
        adjust_in_parts(block, Division(parts=2), datum="outer")
    held = photogram.simulate(**SIZE).block
    with pytest.raises(AdjustmentError, check=lambda error: error.code == "parts.not-free"):
        adjust_in_parts(held, Division(parts=2), datum=InnerConstraints())


def test_two_workers_give_the_bits_of_parts_one_after_the_other(block):
    divisions = Division(parts=4), Division(parts=4, cluster="local", workers=2)
    one, other = (adjust_in_parts(block, each, datum=InnerConstraints()) for each in divisions)
    for name in ("photo_positions", "photo_cofactors", "point_cofactors", "redundancy"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
