"""Attitudes in every representation: golden figures, round trips, propagation, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import photogram
from golden_data import golden
from message_codes import raises
from photogram import Attitudes
from photogram.network.attitudes import Representation

NAMES: dict[str, Representation] = {
    "omega_phi_kappa": "omega_phi_kappa",
    "omega_phi_kappa_photo_to_ground": "omega_phi_kappa_photo_to_ground",
    "phi_omega_kappa": "phi_omega_kappa",
    "azimuth_tilt_swing": "azimuth_tilt_swing",
    "yaw_pitch_roll_ned_nadir": "yaw_pitch_roll",
    "quaternion_photo_to_object_wxyz": "quaternion",
    "quaternion_vision_from_object_wxyz": "quaternion_to_vision",
    "rotation_vector_photo_to_object": "rotation_vector",
    "rotation_vector_vision_from_object": "rotation_vector_to_vision",
    "rotation_vector_object_to_photo_bal": "rotation_vector_to_photo",
}


def cases(name: str) -> list[tuple[int, dict, dict]]:
    """All golden attitudes with the figures of one representation."""
    found = [
        (index, case, case["representations"][name])
        for index, case in enumerate(golden("network", "attitudes.json")["cases"])
    ]
    assert len(found) == 20
    return found


def differences(own: np.ndarray, given: np.ndarray, name: str) -> float:
    """Return the largest: of angles modulo a turn, of quaternions and near half a turn up to the sign."""
    if name.startswith("quaternion"):
        return min(np.abs(own - given).max(), np.abs(own + given).max())
    if name.startswith("rotation_vector"):
        half = np.linalg.norm(given) > math.pi - 1e-6
        return min(np.abs(own - given).max(), np.abs(own + given).max() if half else math.inf)
    return np.abs((own - given + math.pi) % (2 * math.pi) - math.pi).max()


def test_the_golden_file_has_these_representations() -> None:
    first = golden("network", "attitudes.json")["cases"][0]["representations"]
    assert set(first) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_golden_attitudes(name: str) -> None:
    for index, case, figures in cases(name):
        matrix = np.array(case["matrix_photo_to_object"])
        attitude = Attitudes(matrix[None], np.array(case["cofactors_rotation_step"])[None])
        given = np.array(figures["values"])
        own = attitude.values(NAMES[name])[0]
        limit = 1e-8 if index in (11, 19) else 1e-13
        assert differences(own, given, name) < limit, (index, own, given)
        back = Attitudes.of(NAMES[name], given[None]).matrices[0]
        assert np.abs(back - matrix).max() < (1e-8 if figures["singular"] else 1e-14), index
        covariance = attitude.covariances(NAMES[name])[0]
        weak = np.linalg.cond(np.array(figures.get("jacobian_from_rotation_step", np.eye(3)))) > 1e4
        if figures["singular"]:
            assert np.isnan(covariance).all()
        elif differences(own, given, name) == np.abs(own - given).max():
            expected = np.array(figures["cofactors"])
            scale = np.abs(expected).max()
            assert np.abs(covariance - expected).max() < (1e-5 if weak else 1e-9) * scale, index
        if figures["singular"] or weak:
            continue  # double precision cannot hold in these numbers what the step would need
        step = Attitudes.of(NAMES[name], own[None], covariance[None]).step_covariances
        assert step is not None
        expected = np.array(case["cofactors_rotation_step"])
        assert np.abs(step[0] - expected).max() < 1e-9 * np.abs(expected).max()


def test_golden_matrix_of_vision() -> None:
    for case in golden("network", "attitudes.json")["cases"]:
        attitude = Attitudes(np.array(case["matrix_photo_to_object"])[None])
        vision = np.array(case["matrix_vision_from_object"])
        assert np.abs(attitude.values("matrix_to_vision")[0] - vision).max() < 1e-15
        assert (
            np.abs(Attitudes.of("matrix_to_vision", vision[None]).matrices - attitude.matrices).max() < 1e-14
        )


def random_attitudes(count: int) -> Attitudes:
    return Attitudes.of("quaternion", np.random.default_rng(7).normal(size=(count, 4)))


@pytest.mark.parametrize("name", ["matrix", "matrix_to_photo", "matrix_to_vision", "matrix_from_vision"])
def test_matrices_come_back(name: Representation) -> None:
    attitudes = random_attitudes(50)
    back = Attitudes.of(name, attitudes.values(name))
    assert np.abs(back.matrices - attitudes.matrices).max() < 1e-14


def test_positions_and_translations() -> None:
    attitudes = random_attitudes(20)
    centres = np.random.default_rng(8).normal(size=(20, 3))
    assert np.abs(attitudes.positions(attitudes.translations(centres)) - centres).max() < 1e-14


def test_angles_are_those_of_the_block() -> None:
    angles = np.array([[0.1, -0.2, 2.0], [3.0, 1.2, -1.0]])
    ground_to_photo = Attitudes.of("omega_phi_kappa", angles).values("matrix_to_photo")
    assert np.array_equal(ground_to_photo, photogram.network.geometry.rotation_matrix(angles))


@pytest.mark.parametrize(
    ("mounting", "kappa"),
    [("top forward", 0.0), ("top right", -90.0), ("top back", 180.0), ("top left", 90.0)],
)
def test_mountings(mounting: str, kappa: float) -> None:
    """An aircraft that flies north: the top of the picture points where the mounting says."""
    flown = Attitudes.of("yaw_pitch_roll", np.zeros((1, 3)), mounting=mounting)
    up_in_picture = flown.matrices[0, :, 1]
    expected = [-math.sin(math.radians(kappa)), math.cos(math.radians(kappa)), 0.0]
    assert np.abs(up_in_picture - expected).max() < 1e-15
    assert np.abs(flown.values("yaw_pitch_roll", mounting=mounting)).max() < 1e-15


def test_covariances_against_draws() -> None:
    """Yaw, pitch, roll of drawn omega, phi, kappa scatter as propagated."""
    random = np.random.default_rng(3)
    covariance = np.diag([1e-3, 2e-3, 5e-4]) ** 2
    mean = np.array([0.2, -0.4, 1.0])
    given = Attitudes.of("omega_phi_kappa", mean[None], covariance[None])
    drawn = Attitudes.of("omega_phi_kappa", random.multivariate_normal(mean, covariance, size=20_000))
    scatter = np.cov(drawn.values("yaw_pitch_roll").T)
    own = given.covariances("yaw_pitch_roll")[0]
    assert np.abs(scatter - own).max() < 0.04 * np.abs(own).max()
    assert np.allclose(given.standard_deviations("omega_phi_kappa"), [[1e-3, 2e-3, 5e-4]])


def test_few_digits_are_enough() -> None:
    attitudes = random_attitudes(20)
    rounded = Attitudes.of("matrix", attitudes.matrices.round(7))
    products = rounded.matrices @ rounded.matrices.transpose(0, 2, 1)
    assert np.abs(products - np.eye(3)).max() < 1e-13


def test_refusals() -> None:
    right = np.eye(3)[None]
    refused = [
        (lambda: Attitudes(np.diag([1.0, 1.0, -1.0])[None]), "attitude.mirrored"),
        (lambda: Attitudes.of("matrix", 2 * right), "attitude.orthonormal"),
        (lambda: Attitudes.of("quaternion", [[1, 0, 0, 0], [0, 0, 0, 0]]), "attitude.quaternion"),
        (lambda: Attitudes.of("omega_phi_kappa", [[0, 0, math.inf]]), "error.finite"),
        (lambda: Attitudes.of("quaternion", [[1, 0, 0]]), r"\(n, 4\)"),
        (lambda: Attitudes.of("gon", [[1, 0, 0]]), "representation: must be one of omega_phi_kappa"),
        (
            lambda: Attitudes.of("yaw_pitch_roll", [[1, 0, 0]], mounting="up"),
            "mounting: must be one of top forward",
        ),
        (lambda: Attitudes(right).covariances("matrix"), "attitude.no-covariances"),
        (lambda: Attitudes.of("omega_phi_kappa", [[1, 0, 0]], np.eye(3)), "covariances: must have the shape"),
    ]
    for attempt, message in refused:
        with raises(photogram.InputError, message):
            attempt()


def test_the_figure_is_drawn_as_it_stands_in_the_documentation(monkeypatch: pytest.MonkeyPatch) -> None:
    docs = Path(__file__).parents[1] / "docs"
    monkeypatch.syspath_prepend(str(docs))
    import conventions_figure

    x, y, z = conventions_figure.axes("omega_phi_kappa", np.zeros(3))
    assert np.array_equal(np.array([x, y, z]), np.eye(3))
    drawn = conventions_figure.figure()
    assert (docs / "conventions.svg").read_text(encoding="utf-8").count("<text") == drawn.count("<text")


def test_the_code_of_the_page_runs() -> None:
    page = (Path(__file__).parents[1] / "docs" / "conventions.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    names: dict[str, object] = {}
    exec(code, names)
    flown = names["flown"]
    assert isinstance(flown, Attitudes)
    kappa = np.degrees(flown.values("omega_phi_kappa")[:, 2])
    assert np.abs((kappa + [90.0, 271.0] + 180.0) % 360.0 - 180.0).max() < 0.1
    assert np.allclose(np.degrees(flown.standard_deviations("omega_phi_kappa")), 0.01, rtol=2e-3)
    for row in page.split("## Numbers")[1].split("**Mounting**")[0].splitlines():
        for name in (
            [part.strip("` ") for part in row.split("|")[1].split(",")] if row.startswith("| `") else []
        ):
            flown.values(name)  # type: ignore[arg-type]
