"""Values that cannot be: refused with the file, the table and the key, or the record."""

from importlib.resources import files
from pathlib import Path

import pytest

from photogram import InputError
from photogram.stellar import Air, read_night, read_plain
from rejections import check_message, rejected

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
        ("temperature_K = 278.15", "temperature_K = 10.0", "[station] the air has 10 K"),
        ("pressure_mmHg = 718.0", "pressure_mmHg = 1013.0", "1013 hPa are 759.8"),
        ("dut1_s = -0.0076", "dut1_s = 70.0", "error.key earth dut1_s: error.range 70.0 -1.0 1.0"),
        (
            "pole_x_arcsec = 0.0237",
            "pole_x_arcsec = 23.7",
            "error.key earth pole_x_arcsec: error.range 23.7 -2 2",
        ),
        (
            "elevation_deg = 52.0",
            "elevation_deg = 152.0",
            "error.key exposures 1 elevation_deg: error.range 152.0 -90 90",
        ),
        ("width_px = 6000", "width_px = nan", "error.key camera width_px: error.number nan"),
        ("width_px = 6000", "width_px = inf", "error.key camera width_px: error.number inf"),
        ("width_px = 6000", "width_px = true", "error.key camera width_px: error.number: error.value True"),
        ("width_px = 6000", 'width_px = "6000"', "error.key camera width_px: error.number 6000"),
        (
            "width_px = 6000",
            "width_px = 2024-03-05",
            "error.key camera width_px: error.number: error.value datetime.date(2024,",
        ),
        (
            "width_px = 6000",
            "width_px = [6000]",
            "error.key camera width_px: error.number: error.value [6000]",
        ),
        ("width_px = 6000", "width_px = -6000", "error.key camera width_px: error.range -6000.0 1 1000000.0"),
        (
            "width_px = 6000",
            f"width_px = 1{'0' * 400}",
            "error.key camera width_px: error.number: error.long-integer 1329",
        ),
        ("width_px = 6000", f"width_px = {'9' * 5000}", "toml.digits width_px 1000"),
        ("width_px = 6000", f"width_px = {'[' * 3000}", "error.nested"),
        ("width_px = 6000", "", "toml.missing camera width_px"),
        ("field_of_view_deg = 36.9", "field_of_view_deg = 0", "the field of view is 0 degrees"),
        (
            'utc = "2024-03-05T20:10:00.00"',
            "utc = 2024-03-05T20:10:00",
            "error.key exposures 1 utc: toml.text: error.value datetime.datetime(2024,",
        ),
        (
            'utc = "2024-03-05T20:10:00.00"',
            'utc = "20:10"',
            "error.key exposures 1 utc : '20:10' is not a UTC time such as",
        ),
        ('name = "1"', "name = 1.5", "error.key exposures 1 name: error.name 1.5"),
        ('file = "images.csv"', "file = 7", "error.key images file: toml.text 7"),
        ('file = "images.csv"', 'file = "a\\u0000b"', "error.key images file: toml.file a\u0000b"),
        (
            "faintest = 6.0",
            "faintest = 6.0\nweigh_stars = 1",
            "error.key catalogue weigh_stars: error.flag 1",
        ),
        ("[camera]", "[[camera]]\n[[camera]]", "error.repeated table camera"),
        (
            "[matching]",
            "[matching]\ntolerance_px = 1e-300",
            "error.key matching tolerance_px: error.range 1e-300 0.01 6000.0",
        ),
    ],
)
def test_values_of_a_night(folder, old, new, message):
    check_message(message, refused(folder, old, new))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cx = 0.3", "cx = true", "error.key camera cx: error.number: error.value True"),
        ("cx = 0.3", "cx = -0.3", "error.key camera cx: error.positive -0.3"),
        ("cx = 0.3", f"cx = 1{'0' * 400}", "error.key camera cx: error.number: error.long-integer 1329"),
        (
            "curves = true",
            "curves = true\nmax_iterations = 1.5",
            "error.key options max_iterations: error.whole-range 1.5 0 2147483647",
        ),
        (
            "curves = true",
            "curves = true\nmax_iterations = true",
            "error.key options max_iterations: error.whole-range 0 2147483647:",
        ),
        (
            "curves = true",
            "curves = true\nminimum_stars = 5",
            "error.key options minimum_stars: error.list 5",
        ),
        ("tolerance = 1e-10", "tolerance = nan", "error.key options tolerance: error.number nan"),
        ("movement_time = 1.5", "movement_time = 1e308", "movement_time is 1e+308 rad; it must"),
        (
            "weight = [9.572663316634245, 9.572663316634245, 0.0]",
            "weight = [1, 2]",
            "error.key stars weight: error.count 2: toml.or 3",
        ),
        (
            "[options]",
            '[weights]\npairs = [["cx", "cy"]]\n[options]',
            "error.key weights pairs: toml.row 3: error.value ['cx', 'cy']",
        ),
        (
            "[options]",
            "[weights]\ncx = false\n[options]",
            "error.key weights cx: error.number: error.value False",
        ),
        (
            'title = "SIMULATED PLATE"',
            "title = 1979-05-27",
            "error.key labels title: error.name: error.value datetime.date(1979, 5, 27)",
        ),
    ],
)
def test_values_of_a_plate(tmp_path, old, new, message):
    copied(tmp_path, "stellar")
    check_message(message, refused(tmp_path, old, new, read_plain, "plate.toml"))


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
    with rejected(message) as raised:
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
    with rejected("dec_rad is beyond the pole") as raised:
        read_plain(tmp_path / "plate.toml")
    assert raised.value.record == 5


@pytest.mark.parametrize(("temperature", "pressure"), [(10.0, 760.0), (15.0, 760.0), (283.0, 1013.0)])
def test_air_in_other_units_is_refused(temperature, pressure):
    with pytest.raises(InputError):
        Air(temperature, pressure)
