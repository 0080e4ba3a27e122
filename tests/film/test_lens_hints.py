"""What images say against the lens of a certificate: its sign, its principal point."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import Block, Message, Result, adjust
from photogram.diagnosis.after_adjustment import diagnosed
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


def lens_hints(result: Result) -> list[Message]:
    """Return the messages on lenses that an adjustment gets."""
    return [each for each in diagnosed(result).messages if each.code.startswith("film-lens.")]


TURNED = "distortion = [-4, -9, -11, -7, -1, 7]", "distortion = [4, 9, 11, 7, 1, -7]"


def test_distortion_with_the_other_sign_is_named(tmp_path: Path) -> None:
    result = adjust(read(archive(tmp_path, turned=TURNED)).block)
    [hint] = lens_hints(result)
    assert (hint.code, hint.phrase.fields["camera"]) == ("film-lens.sign", "rc10-2345")


def test_what_the_hint_says_mends_it(tmp_path: Path) -> None:
    sign = "[certificate.radial] ", "[certificate.radial]\nsign = -1\n"
    result = adjust(read(archive(tmp_path, turned=TURNED, sign=sign)).block)
    given = adjust(read(ARCHIVE).block)
    assert lens_hints(result) == []
    assert result.sums_of_squares.total == pytest.approx(given.sums_of_squares.total, rel=1e-9)


def test_both_terms_of_a_lens_may_have_the_other_sign(tmp_path: Path) -> None:
    assert lens_hints(adjust(project(tmp_path).block)) == []
    path = tmp_path / "cameras.csv"
    text = path.read_text()
    assert "4e-08,-2.2e-12" in text
    path.write_text(text.replace("4e-08,-2.2e-12", "-4e-08,2.2e-12"))
    [hint] = lens_hints(adjust(read(tmp_path).block))
    assert hint.code == "film-lens.sign"


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


def test_all_parameters_of_a_camera_explain_at_least_as_much_as_each(tmp_path: Path) -> None:
    # Their units differ (mm, 1/mm^2), and check points test them as well.
    summary = placed(tmp_path, "autocollimation = [0.0, 0.0]").reliability_summary
    assert summary is not None
    own = summary.hypotheses.code == "camera"
    statistics = dict(zip(summary.hypotheses.component[own], summary.hypotheses.statistic[own], strict=True))
    assert statistics[-1] > max(value for component, value in statistics.items() if component >= 0)


def test_a_principal_point_of_another_place_is_named(tmp_path: Path) -> None:
    [hint] = lens_hints(placed(tmp_path, "autocollimation = [0.03, 0.01]"))
    given = [hint.phrase.fields[name] for name in ("given_x", "given_y")]
    assert (hint.code, given) == ("film-lens.point", pytest.approx([0.03, 0.01]))


def test_a_principal_point_seen_from_the_other_is_named(tmp_path: Path) -> None:
    [hint] = lens_hints(placed(tmp_path, "autocollimation = [-0.05, 0.04]"))
    assert hint.code == "film-lens.signs"
