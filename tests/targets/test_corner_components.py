"""Variance components of corners: by camera and level, in Python and as an option of the command."""

from importlib.resources import files

import numpy as np
import pytest
from given_targets import rig_small
from typer.testing import CliRunner

from golden_data import shared
from message_codes import refusal
from photogram import InputError
from photogram.cli import app
from photogram.targets import corner_components, read, simulate_corners


@pytest.fixture(scope="module")
def twice_as_bad():
    """Return a rig whose second camera has corners twice as bad as it says."""
    given = simulate_corners(rig_small(), seed=5)
    corners = given.corners
    worse = np.where(corners.cameras[corners.picture] == 1, 2.0, 1.0)
    drawn = simulate_corners(given.replace(corners=corners.replace(sd=corners.sd * worse)), seed=6)
    return drawn.replace(corners=drawn.corners.replace(sd=corners.sd)).adjust()


def test_a_camera_whose_corners_are_worse_is_found(twice_as_bad):
    first, second = twice_as_bad.calibration.corners.camera_names
    found = corner_components(twice_as_bad, ["camera"])
    assert found[f"images, camera {first}"].factor_of_sd == pytest.approx(1, abs=0.06)
    assert found[f"images, camera {second}"].factor_of_sd == pytest.approx(2, abs=0.12)
    both = corner_components(twice_as_bad, ["camera", "level"])
    assert both[f"{second}, level 0"].factor_of_sd == pytest.approx(2, abs=0.15)
    assert both[f"{first}, level 0"].factor_of_sd == pytest.approx(1, abs=0.08)


def test_what_is_no_group(twice_as_bad):
    with refusal("targets.levels others=['photo']"):
        corner_components(twice_as_bad, ["photo", "level"])
    with pytest.raises(InputError, match="must be one of kind, camera, level"):
        corner_components(twice_as_bad, ["strip"])


def test_priors_of_lenses_take_no_part():
    whole = read(shared("targets", "opencv8-0.cameramodel"))
    some = np.arange(186) % 6 == 0
    part = whole.replace(corners=whole.corners.of_pictures(some), poses=np.asarray(whole.poses)[some])
    found = corner_components(part.adjust(), ["level"])
    assert [each.name for each in found.components][:2] == ["level 0", "level 1"]
    total = sum(each.squares for each in found.components)
    assert total == pytest.approx(sum(each.redundancy for each in found.components), rel=1e-4)


def test_it_is_an_option_of_the_command(tmp_path):
    words = [
        "calibrate",
        files("photogram") / "examples" / "board",
        "--out",
        tmp_path / "out",
        "--cross-validate",
        "none",
    ]
    done = CliRunner().invoke(app, [*map(str, words), "--components", "component"])
    assert done.exit_code in (0, 4), done.output
    assert "Variance components" in done.output
    assert "images" in (tmp_path / "out" / "components.txt").read_text()
    assert "Variance components" in (tmp_path / "out" / "report.html").read_text()
