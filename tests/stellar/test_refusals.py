"""Values that cannot be: refused with the file, the table and the key, or the record."""

from importlib.resources import files
from pathlib import Path

import pytest

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
    return str(raised.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("temperature_K = 278.15", "temperature_K = 10.0", "[station] the air has 10 K"),
        ("pressure_mmHg = 718.0", "pressure_mmHg = 1013.0", "1013 hPa are 759.8"),
        ("dut1_s = -0.0076", "dut1_s = 70.0", "[earth] dut1_s is 70; it must be between -1 and 1"),
        ("pole_x_arcsec = 0.0237", "pole_x_arcsec = 23.7", "[earth] pole_x_arcsec is 23.7"),
        ("elevation_deg = 52.0", "elevation_deg = 152.0", "[exposures 1] elevation_deg is 152"),
        ("width_px = 6000", "width_px = nan", "[camera] width_px is nan, not a number"),
        ("width_px = 6000", "width_px = inf", "[camera] width_px is inf, not a number"),
        ("width_px = 6000", "width_px = true", "[camera] width_px is true, not a number"),
        ("width_px = 6000", 'width_px = "6000"', "[camera] width_px is '6000', not a number"),
        ("width_px = 6000", "width_px = 2024-03-05", "[camera] width_px is 2024-03-05, not a number"),
        ("width_px = 6000", "width_px = [6000]", "[camera] width_px is [6000], not a number"),
        ("width_px = 6000", "width_px = -6000", "[camera] width_px is -6000; it must be between"),
        ("width_px = 6000", f"width_px = 1{'0' * 400}", "[camera] width_px is a whole number of very many"),
        ("width_px = 6000", f"width_px = {'9' * 5000}", "width_px has a number of more than 1000 digits"),
        ("width_px = 6000", f"width_px = {'[' * 3000}", "brackets are nested too deeply"),
        ("width_px = 6000", "", "[camera] width_px is missing"),
        ("field_of_view_deg = 36.9", "field_of_view_deg = 0", "the field of view is 0 degrees"),
        ('utc = "2024-03-05T20:10:00.00"', "utc = 2024-03-05T20:10:00", "put it in quotation marks"),
        ('utc = "2024-03-05T20:10:00.00"', 'utc = "20:10"', "[exposures 1] utc : '20:10' is not a UTC time"),
        ('name = "1"', "name = 1.5", "[exposures 1] name has 1.5, which is neither text nor a whole number"),
        ('file = "images.csv"', "file = 7", "[images] file is 7, not text"),
        ('file = "images.csv"', 'file = "a\\u0000b"', "not the name of a file"),
        ("faintest = 6.0", "faintest = 6.0\nweigh_stars = 1", "[catalogue] weigh_stars is 1, neither true"),
        ("[camera]", "[[camera]]\n[[camera]]", "[camera] is there 2 times"),
        ("[matching]", "[matching]\ntolerance_px = 1e-300", "[matching] tolerance_px is 1e-300"),
    ],
)
def test_values_of_a_night(folder, old, new, message):
    assert message in refused(folder, old, new)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cx = 0.3", "cx = true", "[camera] cx is true, not a number"),
        ("cx = 0.3", "cx = -0.3", "[camera] cx is -0.3; it must be positive"),
        ("cx = 0.3", f"cx = 1{'0' * 400}", "[camera] cx is a whole number of very many digits"),
        ("curves = true", "curves = true\nmax_iterations = 1.5", "max_iterations is 1.5, not a whole number"),
        (
            "curves = true",
            "curves = true\nmax_iterations = true",
            "max_iterations is true, not a whole number",
        ),
        ("curves = true", "curves = true\nminimum_stars = 5", "[options] minimum_stars is 5, not a list"),
        ("tolerance = 1e-10", "tolerance = nan", "[options] tolerance is nan, not a number"),
        ("movement_time = 1.5", "movement_time = 1e308", "movement_time is 1e+308 rad; it must"),
        ("weight = [9.572663316634245, 9.572663316634245, 0.0]", "weight = [1, 2]", "has 2 values, not 3"),
        (
            "[options]",
            '[weights]\npairs = [["cx", "cy"]]\n[options]',
            "[weights] pairs has ['cx', 'cy'], not",
        ),
        ("[options]", "[weights]\ncx = false\n[options]", "[weights] cx is false, not a number"),
        ('title = "SIMULATED PLATE"', "title = 1979-05-27", "[labels] title has 1979-05-27"),
    ],
)
def test_values_of_a_plate(tmp_path, old, new, message):
    copied(tmp_path, "stellar")
    assert message in refused(tmp_path, old, new, read_plain, "plate.toml")


@pytest.mark.parametrize(
    ("rows", "message", "record"),
    [
        ("1,10,20,0,0,0,5\n1,11,21,0,0,0,5\n", "star 1 is listed twice", 3),
        ("1,10,100,0,0,0,5\n", "dec_deg is not between -90 and 90", 2),
    ],
)
def test_records_of_a_catalogue(folder, rows, message, record):
    (folder / "own.csv").write_text(HEAD + rows)
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("faintest = 6.0", 'file = "own.csv"\nfaintest = 6.0'))
    with pytest.raises(InputError, match=message) as raised:
        read_night(file)
    assert (raised.value.file, raised.value.record) == (folder / "own.csv", record)


def test_an_image_far_outside_the_frame(folder):
    rows = (folder / "images.csv").read_text().splitlines()
    (folder / "images.csv").write_text("\n".join([*rows[:3], "1,1e300,5,4.0", *rows[3:]]))
    with pytest.raises(
        InputError, match="the image is far outside the frame of 6000 x 4000 pixels"
    ) as raised:
        read_night(folder / "night.toml")
    assert raised.value.record == 4


def test_a_declination_of_a_plate_beyond_the_pole(tmp_path):
    copied(tmp_path, "stellar")
    stars = tmp_path / "stars.csv"
    rows = stars.read_text().splitlines()
    cells = rows[4].split(",")
    cells[rows[0].split(",").index("dec_rad")] = "1.7453"
    stars.write_text("\n".join([*rows[:4], ",".join(cells), *rows[5:]]))
    with pytest.raises(InputError, match="dec_rad is beyond the pole") as raised:
        read_plain(tmp_path / "plate.toml")
    assert raised.value.record == 5


@pytest.mark.parametrize(("temperature", "pressure"), [(10.0, 760.0), (15.0, 760.0), (283.0, 1013.0)])
def test_air_in_other_units_is_refused(temperature, pressure):
    with pytest.raises(InputError):
        Air(temperature, pressure)
