"""What images say against the lens of a certificate: its sign, its principal point."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import Block, Result, adjust
from photogram.diagnosis.after_adjustment import diagnosed
from photogram.diagnosis.film_lenses import lens_hints
from photogram.formats import read
from test_film import project

ARCHIVE = files("photogram") / "examples" / "archive"


def archive(folder: Path, **changes: str) -> Path:
    """Return the example, texts of its certificate changed."""
    for each in ARCHIVE.iterdir():
        (folder / each.name).write_bytes(each.read_bytes())
    path = folder / "rc10-2345.toml"
    for old, new in changes.values():
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
    return folder


TURNED = "distortion = [-4, -9, -11, -7, -1, 7]", "distortion = [4, 9, 11, 7, 1, -7]"


def test_distortion_with_the_other_sign_is_named(tmp_path: Path) -> None:
    result = diagnosed(adjust(read(archive(tmp_path, turned=TURNED)).block))
    [hint] = lens_hints(result)
    assert -1 < hint.phrase.fields["times"] < 0
    assert (hint.code, hint.phrase.fields["camera"]) == ("film-lens.sign", "rc10-2345")
    assert hint in result.messages


def test_what_the_hint_says_mends_it(tmp_path: Path) -> None:
    sign = "[certificate.radial] ", "[certificate.radial]\nsign = -1\n"
    result = adjust(read(archive(tmp_path, turned=TURNED, sign=sign)).block)
    given = adjust(read(ARCHIVE).block)
    assert lens_hints(result) == []
    assert result.sums_of_squares.total == pytest.approx(given.sums_of_squares.total, rel=1e-9)


def test_the_score_is_what_another_adjustment_gives(tmp_path: Path) -> None:
    """The golden block with both terms turned: the sum of squares falls to that of the block as it is."""
    given = adjust(project(tmp_path).block)
    assert lens_hints(given) == []
    path = tmp_path / "cameras.csv"
    text = path.read_text()
    assert "4e-08,-2.2e-12" in text
    path.write_text(text.replace("4e-08,-2.2e-12", "-4e-08,2.2e-12"))
    turned = adjust(read(tmp_path).block)
    [hint] = lens_hints(turned)
    assert hint.code == "film-lens.sign"
    from photogram.diagnosis.film_lenses import _Fall

    camera = turned.cameras[0]
    names = [camera.names.index(name) for name in ("c", "A1", "A2")]
    # c is as it was: what is correlated with the terms is to stay where it is.
    move = np.array([[0.0], [-2.0], [-2.0]]) * camera.given.values[names][:, np.newaxis]
    fall = _Fall.of(turned, camera, names, move)
    assert fall.moved[0] == pytest.approx(1.0, abs=3 * fall.sd[0])
    left = turned.sums_of_squares.total - given.sums_of_squares.total
    assert left == pytest.approx((2 * fall.moved[0] - 1) / fall.sd[0] ** 2, rel=1e-3)


POINT = "autocollimation = [0.004, -0.012]"


def placed(folder: Path, given: str) -> Result:
    """Return the example adjusted, photos observed where a principal point at (0.05, -0.04) has them."""
    folder.mkdir(exist_ok=True)
    sure = "autocollimation = [0.05, -0.04]\nsd_principal_point = 1e-6"
    true = adjust(read(archive(folder, point=(POINT, sure))).block)
    block: Block = read(archive(folder, point=(POINT, given))).block
    return adjust(
        block.replace(photo_positions=true.photo_positions, photo_position_sd=np.full((6, 3), 0.05))
    )


def test_a_principal_point_that_is_the_indicated_one_is_named(tmp_path: Path) -> None:
    assert lens_hints(placed(tmp_path, "autocollimation = [0.05, -0.04]")) == []
    [hint] = lens_hints(placed(tmp_path, "autocollimation = [0.0, 0.0]"))
    assert (hint.code, hint.phrase.fields["camera"]) == ("film-lens.indicated", "rc10-2345")


def test_a_principal_point_of_another_place_is_named(tmp_path: Path) -> None:
    [hint] = lens_hints(placed(tmp_path, "autocollimation = [0.03, 0.01]"))
    given = [hint.phrase.fields[name] for name in ("given_x", "given_y")]
    assert (hint.code, given) == ("film-lens.point", pytest.approx([0.03, 0.01]))


def test_a_principal_point_seen_from_the_other_is_named(tmp_path: Path) -> None:
    [hint] = lens_hints(placed(tmp_path, "autocollimation = [-0.05, 0.04]"))
    assert hint.code == "film-lens.signs"
