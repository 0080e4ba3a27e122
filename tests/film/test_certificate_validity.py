"""Which certificate of a camera is that of a flight, and what is told of its date."""

from importlib.resources import files
from pathlib import Path

import pytest
from typer.testing import CliRunner

from message_codes import coded, has_code
from photogram import InputError
from photogram.cli import app
from photogram.errors import ContradictionError
from photogram.formats import Project, ReadOptions, read

ARCHIVE = files("photogram") / "examples" / "archive"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the packaged archive with certificates of four years; that of 1986 is of a longer lens."""
    for each in ARCHIVE.iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    text = (tmp_path / "rc10-2345.toml").read_text()
    for year, c in ((1977, 152.387), (1980, 152.387), (1983, 152.387), (1986, 152.407)):
        own = text.replace("1983-05-11", f"{year}-05-11").replace("c = 152.387", f"c = {c}")
        (tmp_path / f"{year}.toml").write_text(own)
    return tmp_path


def dated(folder: Path, *years: int, flown: str = "1983-07-02", more: tuple[str, ...] = ()) -> Project:
    named = ", ".join(f"'{year}.toml'" for year in years)
    return read(
        folder,
        ReadOptions(
            settings=[f"film.certificate=[{named}]", *([f"film.flown={flown}"] * bool(flown)), *more]
        ),
    )


def told(own: Project, code: str, **fields: object) -> bool:
    return any(has_code(message, code, **fields) for message in own.messages)


def said(own: Project) -> str:
    return " ".join(map(str, own.messages))


@pytest.mark.parametrize(
    ("flown", "year"),
    [
        ("1984-01-01", 1983),
        ("1983-05-11", 1983),
        ("1983-05-10", 1980),
        ("1960-01-01", 1977),
        ("1990-01-01", 1986),
    ],
)
def test_the_last_before_the_flight_is_taken(folder: Path, flown: str, year: int) -> None:
    own = dated(folder, 1986, 1977, 1983, 1980, flown=flown)
    assert f"the certificate is of {year}-05-11, one of 4" in said(own)
    assert own.block.cameras[0].parameters["c"] == pytest.approx(-152.3528 - 0.02 * (year == 1986), abs=1e-4)


def test_old_certificates_and_later_ones_are_told(folder: Path) -> None:
    assert not told(dated(folder, 1983), "films.before-flight")
    days = {"day": "1983-07-02", "years": pytest.approx(6.14, abs=0.01)}
    assert told(dated(folder, 1977), "films.before-flight", certificate="1977-05-11", **days)
    days["years"] = pytest.approx(2.86, abs=0.01)
    assert told(dated(folder, 1986), "films.after-flight", certificate="1986-05-11", **days)
    text = (folder / "1983.toml").read_text()
    (folder / "1983.toml").write_text(text.replace("date = 1983-05-11\n", ""))
    assert told(dated(folder, 1983), "films.undated-flight", day="1983-07-02")


def test_a_change_after_the_flight_is_told(folder: Path) -> None:
    assert told(dated(folder, 1983, 1986), "films.changed", before="1983-05-11", after="1986-05-11")
    assert not told(dated(folder, 1980, 1983, flown="1981-01-01"), "films.changed")


def test_certificates_of_which_none_can_be_chosen_are_refused(folder: Path) -> None:
    text = (folder / "project.toml").read_text()
    (folder / "project.toml").write_text(text.replace("flown = 1983-07-02\n", ""))
    with pytest.raises(InputError, match=r"several certificates"):
        dated(folder, 1980, 1983, flown="")
    (folder / "1977.toml").write_text((folder / "1983.toml").read_text())
    with pytest.raises(
        ContradictionError, check=coded("films.same-date", day="1983-05-11", other="1977.toml")
    ):
        dated(folder, 1977, 1983)
    (folder / "1980.toml").write_text((folder / "1980.toml").read_text().replace("date = 1980-05-11\n", ""))
    with pytest.raises(InputError, check=coded("films.undated", certificate="rc10-2345")):
        dated(folder, 1980, 1983)
    (folder / "1986.toml").write_text((folder / "1986.toml").read_text().replace("rc10-2345", "rc10-99"))
    with pytest.raises(InputError, match=r"the camera rc10-2345, got rc10-2345, rc10-99"):
        dated(folder, 1983, 1986)
    with pytest.raises(InputError, match=r"--set film.flown=May 1983: \[film\] flown: must be a date"):
        dated(folder, 1983, flown="May 1983")


def test_a_camera_of_another_year_is_a_camera_by_itself(folder: Path) -> None:
    path = folder / "photos.csv"
    days = iter(["flown", "", "", "1981-06-01", "", "", ""])
    lines = path.read_text().splitlines()
    path.write_text("\n".join(each if each[0] == "#" else f"{each},{next(days)}" for each in lines) + "\n")
    with pytest.raises(InputError, match=r"record 5: .*with 1983-05-11 .* a camera for each"):
        dated(folder, 1980, 1983)
    path.write_text(path.read_text().replace("1981-06-01", "1981"))
    with pytest.raises(InputError, match=r"column flown: must be a date as 1983-07-02, got '1981'"):
        dated(folder, 1980, 1983)


def test_a_certificate_of_another_lens_ends_with_code_4(folder: Path) -> None:
    (folder / "cameras.csv").write_text("camera,model,c\nrc10-2345,brown_forward,213.9\n")
    ended = CliRunner().invoke(app, ["adjust", str(folder), "--out", str(folder / "out")])
    assert ended.exit_code == 4
    with pytest.raises(
        ContradictionError, match=r"must have the c of its certificate, 152.387 mm, got 213.9 mm"
    ):
        read(folder)
