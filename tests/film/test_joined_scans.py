"""Scans that were joined of two parts: each is a film of its own."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram import InputError, Result, adjust
from photogram.cli import app
from photogram.diagnosis.after_adjustment import diagnosed
from photogram.diagnosis.films import seam_hints
from photogram.formats import read
from photogram.results.film_report import film_table

ARCHIVE = files("photogram") / "examples" / "archive"
SHIFT = (1.5, 3.0)
"""Pixels, of the second half."""


def cells(path: Path) -> list[list[str]]:
    return [line.split(",") for line in path.read_text().splitlines() if not line.startswith("#")]


def written(path: Path, rows: list[list[str]]) -> None:
    path.write_text("\n".join(map(",".join, rows)) + "\n")


def joined(folder: Path, axis: int, seam: bool = True) -> Path:
    """Write the example with the second half of one scan shifted, and say so where that is asked for."""
    for each in ARCHIVE.iterdir():
        (folder / each.name).write_bytes(each.read_bytes())
    for table in ("images.csv", "fiducial_images.csv"):
        rows = cells(folder / table)
        for row in rows:
            if row[0] == "83-2" and float(row[2 + axis]) > 6000.0:
                row[2:4] = [repr(float(value) + by) for value, by in zip(row[2:4], SHIFT, strict=True)]
        written(folder / table, rows)
    if seam:
        head, *rows = cells(folder / "photos.csv")
        line = ("seam_column", "seam_row")[axis]
        written(
            folder / "photos.csv",
            [[*head, line], *([*row, "6000" if row[0] == "83-2" else ""] for row in rows)],
        )
    return folder


def adjusted(folder: Path) -> Result:
    return adjust(read(folder).block)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_half_of_its_own_takes_the_shift_up(tmp_path: Path, axis: int) -> None:
    given, result = adjusted(Path(str(ARCHIVE))), adjusted(joined(tmp_path, axis))
    # Six more unknowns, of which three are known to 1e-4.
    assert result.degrees_of_freedom == given.degrees_of_freedom - 3
    assert result.sums_of_squares.total < given.sums_of_squares.total + 1e-6
    first, second = (result.film[result.block.photo_ids.index(name)] for name in ("83-2", "83-2 half 2"))
    sd = result.film_sd[result.block.photo_ids.index("83-2")]
    by = 0.02 * np.array(SHIFT) * [1.0, -1.0]
    assert np.abs(second[:2] - first[:2] - by).max() < 3 * sd[:2].max()
    assert result.photo_positions[1] == pytest.approx(result.photo_positions[-1])
    assert np.abs(result.point_positions - given.point_positions).max() < 0.1
    assert seam_hints(result) == []


def test_a_shift_that_is_none_costs_three_degrees_of_freedom(tmp_path: Path) -> None:
    """Halves that were not shifted: the sum of squares falls by what three unknowns may take."""
    given = adjusted(Path(str(ARCHIVE)))
    folder = joined(tmp_path, 0)
    for table in ("images.csv", "fiducial_images.csv"):
        (folder / table).write_bytes((ARCHIVE / table).read_bytes())
    fall = given.sums_of_squares.total - adjusted(folder).sums_of_squares.total
    assert 0 <= fall < 16.3


def test_the_hint_says_what_to_give(tmp_path: Path) -> None:
    [hint] = seam_hints(diagnosed(adjusted(joined(tmp_path, 0, seam=False))))
    assert hint.code == "film-check.seam.column"


def test_marks_of_the_other_half_are_not_lost(tmp_path: Path) -> None:
    result = adjusted(joined(tmp_path, 0))
    [lost] = [each for each in film_table(result) if each.name == "lost"]
    assert [*lost.values] == ["", "", "", "ul", "", "", ""]
    assert "83-2 half 2" in result.document().table("films").columns[0].values


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    folder = joined(tmp_path, 1)
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["convert", str(folder), str(out), "--to", "plain"])
    assert done.exit_code == 0, done.output
    one, other = adjusted(folder), adjusted(out)
    assert other.sums_of_squares.total == pytest.approx(one.sums_of_squares.total, rel=1e-9)
    assert other.degrees_of_freedom == one.degrees_of_freedom


def test_halves_are_fitted_before(tmp_path: Path) -> None:
    folder = joined(tmp_path, 0)
    done = CliRunner().invoke(
        app, ["adjust", str(folder), "--set", "film.interior=before", "--out", str(tmp_path / "out")]
    )
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"seam_column": "6000", "seam_row": "6000"}, "either seam_column or seam_row"),
        ({"seam_column": "6000", "film": "", "scanner": "", "mirrored": ""}, "a seam and must have a film"),
    ],
)
def test_seams_that_cannot_be_are_refused(tmp_path: Path, row: dict[str, str], message: str) -> None:
    folder = joined(tmp_path, 0, seam=False)
    head, *rows = cells(folder / "photos.csv")
    head += ["seam_column", "seam_row"]
    rows = [[*each, "", ""] for each in rows]
    for name, value in row.items():
        rows[1][head.index(name)] = value
    written(folder / "photos.csv", [head, *rows])
    with pytest.raises(InputError, match=message):
        read(folder)
