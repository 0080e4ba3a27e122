"""Simulated GNSS, inertial units, distances, rigs: what is exact is exact, the truth is found again."""

import numpy as np
import pytest

from message_codes import raises
from photogram import Attitudes, InputError, Spheroid, adjust, simulate
from photogram.network import with_distances, with_gnss, with_inertial, with_rig

SPACES = [None, Spheroid.clarke_1866()]
ARM = np.array([0.2, -0.4, 1.1])
TURN = np.array([0.01, -0.02, 0.03])


def simulation(spheroid, **options):
    return simulate(
        strips=3,
        photos_per_strip=5,
        points_per_photo=30,
        side_overlap=0.5,
        spheroid=spheroid,
        position_error=5.0,
        seed=3,
        **options,
    )


def flown(spheroid, seed=1, **options):
    made = with_gnss(
        simulation(spheroid, **options),
        lever_arm=ARM,
        lever_arm_sd=0.02,
        shift_sd=0.3,
        drift_sd=0.01,
        seed=seed,
    )
    return with_distances(
        with_inertial(made, boresight=TURN, seed=seed), scale=1.001, constant=0.4, unknown=True, seed=seed
    )


@pytest.mark.parametrize("photo_to_ground", [False, True])
@pytest.mark.parametrize("spheroid", SPACES, ids=["rectangular", "geographic"])
def test_the_truth_is_free_of_errors(spheroid, photo_to_ground):
    made = with_rig(flown(spheroid, photo_to_ground=photo_to_ground), [[0.5, 0.1, -0.2]], [[0.3, 0.1, 0.2]])
    assert np.isfinite(made.truth.image_xy).all()
    result = adjust(made.truth)
    assert result.converged
    assert np.nanmax(np.abs(result.residuals)) < 1e-5
    for kind, each in result.kinds.items():
        assert np.nanmax(np.abs(each.residuals) / each.sd) < 1e-3, kind


@pytest.mark.parametrize("spheroid", SPACES, ids=["rectangular", "geographic"])
def test_the_truth_is_found_again(spheroid):
    ratios, variances = [], []
    for seed in range(12):
        made = flown(spheroid, seed)
        result = adjust(made.block)
        variances.append(result.variance_of_unit_weight)
        true = {(each.KIND, each.name): each for each in made.truth.unknowns}
        for each in result.unknowns:
            own = true[each.kind, each.name]
            if each.kind == "boresight":
                turned = own.attitude.T @ each.attitude
                error = Attitudes(turned[np.newaxis]).values("rotation_vector")[0]
            else:
                error = (each.position - own.position)[: len(each.components)]
            ratios.append(error @ np.linalg.solve(each.cofactors, error) / len(error))
    assert np.mean(variances) == pytest.approx(1, abs=0.05)
    assert np.mean(ratios) == pytest.approx(1, abs=0.25)


def test_a_rig_is_found_again():
    positions, turns = [[0.5, 0.1, -0.2], [-0.4, 0.2, 0.1]], [[0.3, 0.1, 0.2], [-0.2, 0.25, 0.0]]
    made = with_rig(simulation(None), positions, turns)
    assert len(made.block.photo_ids) == 45
    assert len(made.block.mounts) == 30
    again = with_rig(simulation(None), positions, turns)
    np.testing.assert_array_equal(again.block.image_xy, made.block.image_xy)
    result = adjust(made.block)
    assert result.converged
    assert result.variance_of_unit_weight == pytest.approx(1, abs=0.1)
    for each, position, turn in zip(result.unknowns, positions, turns, strict=True):
        true = Attitudes.of("rotation_vector", [turn]).matrices[0]
        turned = Attitudes((true.T @ each.attitude)[np.newaxis]).values("rotation_vector")[0]
        error = np.concatenate([each.position - position, turned])
        assert error @ np.linalg.solve(each.cofactors, error) < 25
    assert np.isfinite(result.photo_sd).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda own: with_gnss(own, sd=0.0), "error.positive"),
        (lambda own: with_gnss(own, drift_sd=-1.0), "error.not-negative"),
        (lambda own: with_inertial(own, sd=np.inf), "error.positive"),
        (lambda own: with_distances(own, count=10**6), "error.range"),
        (lambda own: with_distances(own, scale=1.1), "error.requires"),
        (lambda own: with_rig(own, [0, 0], [0, 0]), "error.shape"),
        (lambda own: with_gnss(with_rig(own, [0.5, 0, 0], [0, 0, 0])), "simulation.rig-first"),
    ],
)
def test_what_cannot_be_simulated_is_refused(make, message):
    with raises(InputError, message):
        make(simulation(None))
