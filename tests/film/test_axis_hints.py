"""Films that have changed along one axis, where they are taken for conformal."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import Message, Result, adjust
from photogram.diagnosis.after_adjustment import diagnosed
from photogram.formats import ReadOptions, read

ARCHIVE = files("photogram") / "examples" / "archive"


def archive(folder: Path, model: str, b: tuple[float, float] | None = None) -> Result:
    """Return the archive with films of some model; `b`: all have changed by these b1, b2, not by their own.

    What the example's films have of their own is what the adjustment of the example says.
    """
    for each in ARCHIVE.iterdir():
        (folder / each.name).write_bytes(each.read_bytes())
    if b is not None:
        whole = adjust(read(folder).block, unit_variance="unity")
        own = dict(zip(whole.block.photo_ids, whole.film[:, 4:], strict=True))
        for table in ("images.csv", "fiducial_images.csv"):
            rows = [line.split(",") for line in (folder / table).read_text().splitlines()]
            for row in rows:
                if row[0] in own:
                    form, (b1, b2) = whole.film_forms[row[0]].matrix, np.array(b) - own[row[0]]
                    reading = np.array(row[2:4], dtype=float)
                    x, y = np.linalg.solve(form[:, 1:], reading - form[:, 0])
                    reading += form[:, 1:] @ [b1 * x + b2 * y, b2 * x - b1 * y]
                    row[2:4] = map(repr, reading.tolist())
            (folder / table).write_text("\n".join(map(",".join, rows)) + "\n")
    block = read(folder, ReadOptions(settings=[f"film.model={model}"])).block
    return adjust(block, unit_variance="unity")


def axis_hints(result: Result) -> list[Message]:
    """Return the messages on films along an axis that an adjustment gets."""
    return [each for each in diagnosed(result).messages if each.code == "film-check.axis"]


def test_each_film_along_an_axis_of_its_own(tmp_path: Path) -> None:
    result = diagnosed(archive(tmp_path, "conformal"))
    [hint] = [each for each in result.messages if each.code == "film-check.axis"]
    assert (hint.code, hint.phrase.fields["photos"][0]) == ("film-check.axis", "83-5")
    assert hint.phrase.fields["longer"] == pytest.approx(2 * np.hypot(3.7e-5, 2.03e-4), rel=0.1)
    assert not any(each.code == "film-check.marks.all" for each in result.messages)


@pytest.mark.parametrize(("b", "angle"), [((2e-4, 0.0), 0), ((-1.5e-4, 0.0), 90), ((0.0, 2e-4), 45)])
def test_all_films_along_one_axis(tmp_path: Path, b: tuple[float, float], angle: int) -> None:
    [hint] = axis_hints(archive(tmp_path, "conformal", b))
    assert len(hint.phrase.fields["photos"]) == 6
    assert hint.phrase.fields["longer"] == pytest.approx(2 * np.hypot(*b), rel=0.2)
    found = hint.phrase.fields["angle"]
    assert abs((found - angle + 90) % 180 - 90) < 6


def test_films_that_are_conformal_are_not_told(tmp_path: Path) -> None:
    assert axis_hints(archive(tmp_path, "conformal", (0.0, 0.0))) == []


def test_affine_films_are_not_told(tmp_path: Path) -> None:
    assert axis_hints(archive(tmp_path, "affine", (3e-4, 0.0))) == []


def test_a_single_mark_is_no_axis(tmp_path: Path) -> None:
    archive(tmp_path, "conformal", (0.0, 0.0))
    text = (tmp_path / "fiducial_images.csv").read_text().splitlines()
    keep = [line for line in text if not line.startswith("83-3,m")]  # four corners
    k = next(k for k, line in enumerate(keep) if line.startswith("83-3,ur"))
    row = keep[k].split(",")
    keep[k] = ",".join([*row[:2], repr(float(row[2]) + 6.0), row[3]])
    (tmp_path / "fiducial_images.csv").write_text("\n".join(keep) + "\n")
    result = adjust(read(tmp_path, ReadOptions(settings=["film.model=conformal"])).block)
    assert axis_hints(result) == []
