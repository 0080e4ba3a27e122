"""Sixty photos of an arch without control, self-calibrating, against the report of an independent program.

The data stay outside the repository. Frame 1 is held by name; the rule of minimum constraints then holds the
one coordinate of another photo that differs most from it, Y of frame 19, as the other program did.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from photogram import Block, Camera, Result, adjust

PIXEL = 24.0 / 3744
"""Millimetres: rows of a sensor 24 mm high."""
GIVEN = {"c": -24.3581, "xp": 18.1143, "yp": -12.0, "K1": 2.174e-4, "K2": -1.518e-7}
"""camera.xml, the origin in the upper left corner and y up."""


@pytest.fixture(scope="module")
def expected(roma: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((roma / "expected_dbat.json").read_text())
    return found


@pytest.fixture(scope="module")
def block(roma: Path) -> Block:
    return read(roma)


def read(roma: Path) -> Block:
    """Return the block from its raw start: points unknown, frame 1 held, a camera that is known."""
    images = np.loadtxt(roma / "markpts.txt", delimiter=",", comments="#")
    frames = np.loadtxt(roma / "initial_eo.txt", delimiter=",", comments="#")
    photos, points = images[:, 0].astype(int), images[:, 1].astype(int)
    ids, rows = np.unique(points, return_inverse=True)
    held = np.where(frames[:, 0] == 1, 0.0, np.inf)[:, np.newaxis] * np.ones(3)
    return Block(
        photo_ids=[str(int(frame)) for frame in frames[:, 0]],
        photo_positions=frames[:, 1:4],
        photo_attitudes=np.radians(frames[:, 4:7]),
        photo_position_sd=held,
        photo_attitude_sd=held,
        cameras=[Camera("brown", GIVEN)],
        point_ids=[str(point) for point in ids],
        point_positions=np.full((len(ids), 3), np.nan),
        image_photos=photos - 1,
        image_points=rows,
        image_xy=images[:, 2:4] * [PIXEL, -PIXEL],
        image_sd=np.array(PIXEL),
    )


def adjusted(block: Block, *free: str, **given: float) -> Result:
    """Adjust with some parameters of the camera free, some others given."""
    camera = Camera("brown", GIVEN | given, sd=dict.fromkeys(free, np.inf))
    result = adjust(block.replace(cameras=[camera]))
    assert result.converged
    return result


@pytest.fixture(scope="module")
def calibrated(block: Block) -> Result:
    return adjusted(block, "c", "xp", "yp", "K1", "K2")


def printed(value: float) -> float:
    """Return half a unit of the last digit that a figure is printed to."""
    mantissa, _, exponent = f"{value!r}".partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(0.5 * 10.0 ** (int(exponent or 0) - decimals))


def test_variance_redundancy_and_datum(calibrated: Result, expected: dict[str, Any]) -> None:
    assert np.sqrt(calibrated.variance_of_unit_weight) == pytest.approx(expected["sigma0"], abs=5e-7)
    assert calibrated.degrees_of_freedom == expected["redundancy"]
    assert calibrated.redundancy.sum() == pytest.approx(expected["redundancy"], rel=1e-6)
    fixed = [each.phrase.fields["fixed"] for each in calibrated.messages if each.code == "free.minimum"]
    assert len(fixed) == 1
    assert "Y of 19" in ", ".join(map(str, fixed[0]))


def test_camera_to_the_printed_digits(calibrated: Result, expected: dict[str, Any]) -> None:
    camera = calibrated.cameras[0]
    assert camera.photos == 60
    assert 2 * camera.images == expected["observations"]
    for name, sign, of in (
        ("cc", -1, "c"),
        ("px", 1, "xp"),
        ("py", -1, "yp"),
        ("K1", 1, "K1"),
        ("K2", 1, "K2"),
    ):
        value, sd = expected["camera"][name]
        assert sign * camera.value(of) == pytest.approx(value, abs=1.01 * printed(value)), name
        assert camera.deviation(of) == pytest.approx(sd, abs=1.01 * printed(sd)), name


def test_frames_to_the_printed_digits(calibrated: Result, expected: dict[str, Any]) -> None:
    angles, sd_angles = (
        np.degrees(each) for each in (calibrated.photo_attitudes, calibrated.photo_sd[:, 3:])
    )
    for row, name in enumerate(calibrated.block.photo_ids):
        frame = expected["photos"][name]
        values = [*zip("XYZ", calibrated.photo_positions[row], calibrated.photo_sd[row], strict=False)]
        values += [
            (f"{angle}_deg", angles[row, k], sd_angles[row, k])
            for k, angle in enumerate(("omega", "phi", "kappa"))
        ]
        for axis, value, sd in values:
            assert value == pytest.approx(frame[axis], abs=1e-6), (name, axis)
            if frame[f"sd_{axis}"] is None:
                assert sd == 0, (name, axis)
            else:
                assert sd == pytest.approx(frame[f"sd_{axis}"], abs=1.01 * printed(frame[f"sd_{axis}"]))


@pytest.mark.parametrize(
    ("free", "given", "sigma0", "redundancy"),
    [
        (("c", "xp", "yp", "b1", "K1", "K2", "K3", "P1", "P2"), {}, 0.566548, 101797),
        ((), {"b1": 0.000998889}, 0.623075, 101806),
    ],
)
def test_variants(
    block: Block, free: tuple[str, ...], given: dict[str, float], sigma0: float, redundancy: int
) -> None:
    result = adjusted(block, *free, **given)
    assert np.sqrt(result.variance_of_unit_weight) == pytest.approx(sigma0, abs=5.1e-7)
    assert result.degrees_of_freedom == redundancy
