"""Settings by the names of jigsaw: what they mean, what is told, what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from message_codes import refused
from photogram.formats.isis.solving import PARAMETERS, REFUSED, Settings, deviations, read_settings


def test_defaults_are_those_of_jigsaw():
    own = read_settings("")
    assert own == Settings()
    assert (own.ck_degree, own.ck_solve_degree, own.spk_degree, own.spk_solve_degree) == (2, 2, 2, 2)
    assert own.coefficients == (0, 1)
    assert own.twist
    assert not own.radius


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_setting_changes_its_field(name):
    words = {"ck_degree": "5", "ck_solve_degree": "4", "spk_degree": "3", "spk_solve_degree": "6"}
    words |= {"multiplier": "7.5"}
    words |= {"angles": "all", "positions": "all", "twist": "no", "axes": "rectangular", "held": "held.lis"}
    own = PARAMETERS[name]
    value = words.get(own.field, "7.5" if len(own.names) > 1 else "yes")
    found = read_settings(f"{name.lower()} = {value}")
    changed = [each for each in vars(found) if getattr(found, each) != getattr(Settings(), each)]
    assert changed == [own.field]
    if len(own.names) > 1:
        assert getattr(found, own.field)[own.names.index(name)] == 7.5


@pytest.mark.parametrize(
    ("words", "angles", "positions"),
    [
        ("CAMSOLVE=none SPSOLVE=position", 0, 1),
        ("CAMSOLVE=angles SPSOLVE=velocities", 1, 2),
        ("camsolve=VELOCITIES spsolve=ACCELERATIONS", 2, 3),
        ("CAMSOLVE=all CKSOLVEDEGREE=4 SPSOLVE=all SPKSOLVEDEGREE=0", 5, 1),
    ],
)
def test_how_many_coefficients_are_unknown(words, angles, positions):
    own = read_settings(words)
    assert own.coefficients == (positions, angles)


def test_coefficients_beyond_the_third_have_no_weight():
    found = deviations((0.1, 0.2, None), 4, 5)
    np.testing.assert_array_equal(found[:, 0], [0.1, 0.2, np.inf, np.inf, 0.0, 0.0])


def test_a_command_line_of_jigsaw_is_read():
    own = read_settings("jigsaw fromlist=cubes.lis cnet=in.net CAMSOLVE=all MaxIts=10 observations=no")
    assert own.angles == "all"
    assert [each.fields["what"] for each in own.remarks] == ["FROMLIST", "CNET", "MAXITS"]


def test_a_file_of_settings(tmp_path):
    path = tmp_path / "settings.txt"
    path.write_text("# of a colleague\nCAMSOLVE = velocities   # and drift\n\nTWIST=no\n")
    own = read_settings(str(path))
    assert (own.angles, own.twist) == ("second", False)
    path.write_text("TWIST=no\nCAMSOLVE=sideways\n")
    with refused("format.unknown what=value value=sideways") as caught:
        read_settings(str(path))
    assert caught.value.record == 2


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("CAMSOLV=all", "error.unknown.close kind=setting of jigsaw name=CAMSOLV close=CAMSOLVE"),
        ("CKDEGREE=9", "isis.degree most=8"),
        ("CKDEGREE=2.5", "isis.degree most=8"),
        ("TWIST=perhaps", "format.unknown what=value value=perhaps names=['yes', 'no']"),
        ("POINT_RADIUS_SIGMA=-3", "format.positive name=the number value="),
        ("SPACECRAFT_POSITION_SIGMA=far", "format.positive name=the number value="),
        ("REJECTION_MULTIPLIER=0", "format.positive name=the number value=0"),
        ("SOLVETARGETBODY=yes", "isis.refused"),
        ("CAMSOLVE=all TWIST", "isis.syntax value=TWIST"),
        ('TWIST="yes', "isis.syntax"),
    ],
)
def test_what_is_no_setting_is_refused(words, sentence):
    with refused(sentence):
        read_settings(words)


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_declared_default_is_that_of_the_field(name):
    own, defaults = PARAMETERS[name], Settings()
    if own.kind == "path":
        assert getattr(defaults, own.field) is None
    else:
        assert read_settings(f"{name}={own.default}") == defaults


def test_the_page_tells_of_every_setting():
    page = (Path(__file__).parents[3] / "docs" / "planetary.md").read_text(encoding="utf-8")
    section = page[page.index("## Settings") : page.index("## Files")]
    assert "<!-- generated: jigsaw -->" in section
    assert "<!-- generated: jigsaw otherwise -->" in section
    assert set(REFUSED) <= set(re.findall(r"`([A-Z][A-Z0-9_]+)`", section))
