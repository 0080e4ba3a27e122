"""Values that cannot be: refused with the file, the table and the key, or the record."""

from importlib.resources import files
from pathlib import Path

import pytest

from message_codes import as_check, coded
from photogram import InputError
from photogram.stellar import Air, read_night, read_plain

EXAMPLES = Path(str(files("photogram") / "examples"))
HEAD = "id,ra_deg,dec_deg,pm_ra_mas,pm_dec_mas,parallax_mas,magnitude\n"


@pytest.fixture
def folder(tmp_path):
    copied(tmp_path, "exposures")
    return tmp_path


def copied(folder, example):
    for file in (EXAMPLES / example).iterdir():
        if file.is_file():
            (folder / file.name).write_bytes(file.read_bytes())


def refused(folder, old, new, read=read_night, name="night.toml"):
    file = folder / name
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as raised:
        read(file)
    assert raised.value.file is not None
    return raised.value


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("temperature_K = 278.15", "temperature_K = 10.0", coded("stars.temperature", value=10.0)),
        ("pressure_mmHg = 718.0", "pressure_mmHg = 1013.0", coded("stars.hectopascals")),
        ("dut1_s = -0.0076", "dut1_s = 70.0", coded("error.key", table="earth", key="dut1_s")),
        (
            "pole_x_arcsec = 0.0237",
            "pole_x_arcsec = 23.7",
            coded("error.key", table="earth", key="pole_x_arcsec"),
        ),
        (
            "elevation_deg = 52.0",
            "elevation_deg = 152.0",
            coded("error.key", table="exposures 1", key="elevation_deg"),
        ),
        ("width_px = 6000", "width_px = nan", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", "width_px = inf", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", "width_px = true", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", 'width_px = "6000"', coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", "width_px = 2024-03-05", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", "width_px = [6000]", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", "width_px = -6000", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", f"width_px = 1{'0' * 400}", coded("error.key", table="camera", key="width_px")),
        ("width_px = 6000", f"width_px = {'9' * 5000}", coded("toml.digits", key="width_px")),
        ("width_px = 6000", f"width_px = 0x{'f' * 5000}", coded("toml.digits", key="width_px")),
        ("width_px = 6000", f"width_px = {'[' * 3000}", coded("error.nested")),
        ("width_px = 6000", "", coded("toml.missing", table="camera", key="width_px")),
        ("field_of_view_deg = 36.9", "field_of_view_deg = 0", coded("stars.field-of-view", field=0.0)),
        (
            'utc = "2024-03-05T20:10:00.00"',
            "utc = 2024-03-05T20:10:00",
            coded("error.key", key="utc", message="toml.text"),
        ),
        ('utc = "2024-03-05T20:10:00.00"', 'utc = "20:10"', coded("stars.utc", value="20:10")),
        ('name = "1"', "name = 1.5", coded("error.key", table="exposures 1", key="name")),
        ('file = "images.csv"', "file = 7", coded("error.key", table="images", key="file")),
        ('file = "images.csv"', 'file = "a\\u0000b"', coded("error.key", key="file", message="toml.file")),
        (
            "faintest = 6.0",
            "faintest = 6.0\nweigh_stars = 1",
            coded("error.key", table="catalogue", key="weigh_stars"),
        ),
        ("[camera]", "[[camera]]\n[[camera]]", coded("error.repeated", kind="table", name="camera")),
        (
            "[matching]",
            "[matching]\ntolerance_px = 1e-300",
            coded("error.key", table="matching", key="tolerance_px"),
        ),
    ],
)
def test_values_of_a_night(folder, old, new, message):
    assert as_check(message)(refused(folder, old, new))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cx = 0.3", "cx = true", coded("error.key", table="camera", key="cx")),
        ("cx = 0.3", "cx = -0.3", coded("error.key", table="camera", key="cx")),
        ("cx = 0.3", f"cx = 1{'0' * 400}", coded("error.key", table="camera", key="cx")),
        ("curves = true", "curves = true\nmax_iterations = 1.5", coded("error.key", key="max_iterations")),
        (
            "curves = true",
            "curves = true\nmax_iterations = true",
            coded("error.key", key="max_iterations"),
        ),
        (
            "curves = true",
            "curves = true\nminimum_stars = 5",
            coded("error.key", table="options", key="minimum_stars"),
        ),
        ("tolerance = 1e-10", "tolerance = nan", coded("error.key", table="options", key="tolerance")),
        (
            "movement_time = 1.5",
            "movement_time = 1e308",
            coded("error.at", what="movement_time", message="error.range"),
        ),
        (
            "weight = [9.572663316634245, 9.572663316634245, 0.0]",
            "weight = [1, 2]",
            coded("error.key", table="stars", key="weight", message="error.count"),
        ),
        (
            "[options]",
            '[weights]\npairs = [["cx", "cy"]]\n[options]',
            coded("error.key", table="weights", key="pairs"),
        ),
        ("[options]", "[weights]\ncx = false\n[options]", coded("error.key", table="weights", key="cx")),
        ('title = "SIMULATED PLATE"', "title = 1979-05-27", coded("error.key", table="labels", key="title")),
    ],
)
def test_values_of_a_plate(tmp_path, old, new, message):
    copied(tmp_path, "stellar")
    assert as_check(message)(refused(tmp_path, old, new, read_plain, "plate.toml"))


@pytest.mark.parametrize(
    ("rows", "message", "record"),
    [
        ("1,10,20,0,0,0,5\n1,11,21,0,0,0,5\n", coded("error.repeated", kind="star", name="1"), 3),
        ("1,10,100,0,0,0,5\n", coded("error.column", column="dec_deg", message="error.range"), 2),
    ],
)
def test_records_of_a_catalogue(folder, rows, message, record):
    (folder / "own.csv").write_text(HEAD + rows)
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("faintest = 6.0", 'file = "own.csv"\nfaintest = 6.0'))
    with pytest.raises(InputError, check=message) as raised:
        read_night(file)
    assert (raised.value.file, raised.value.record) == (folder / "own.csv", record)


def test_an_image_far_outside_the_frame(folder):
    rows = (folder / "images.csv").read_text().splitlines()
    (folder / "images.csv").write_text("\n".join([*rows[:3], "1,1e300,5,4.0", *rows[3:]]))
    with pytest.raises(InputError, check=coded("stars.outside", width=6000.0, height=4000.0)) as raised:
        read_night(folder / "night.toml")
    assert raised.value.record == 4


def test_a_declination_of_a_plate_beyond_the_pole(tmp_path):
    copied(tmp_path, "stellar")
    stars = tmp_path / "stars.csv"
    rows = stars.read_text().splitlines()
    cells = rows[4].split(",")
    cells[rows[0].split(",").index("dec_rad")] = "1.7453"
    stars.write_text("\n".join([*rows[:4], ",".join(cells), *rows[5:]]))
    with pytest.raises(InputError, check=coded("stars.declination")) as raised:
        read_plain(tmp_path / "plate.toml")
    assert raised.value.record == 5


@pytest.mark.parametrize(("temperature", "pressure"), [(10.0, 760.0), (15.0, 760.0), (283.0, 1013.0)])
def test_air_in_other_units_is_refused(temperature, pressure):
    with pytest.raises(InputError):
        Air(temperature, pressure)
