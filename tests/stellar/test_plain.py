"""The plain form: every option, what is refused, and that no input is overwritten."""

import math
import subprocess
import sys
from dataclasses import fields
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import as_check, coded, rejected
from photogram import InputError
from photogram.cli import app
from photogram.stellar import ARCSEC, INDEX, Options, read_plain
from photogram.stellar.plain import inputs

ROOT = Path(__file__).parents[2]
EXAMPLE = Path(str(files("photogram") / "examples" / "stellar" / "plate.toml"))

EVERY = """
[station]
latitude_deg = 30.0

[reference]
latitude_deg = 12.0
longitude_west_deg = 41.0
name = "REFERENCE"

[pole]
x_arcsec = 0.3
y_arcsec = -0.2

[camera]
cx = 0.3
cy = 0.3
alpha = 10.0
omega_post = 5.0
fixed = ["K3"]

[weights]
cx = 4e-2
tau1 = 1e-13
pairs = [["cx", "cy", 1e-2]]
cy = 5e-2

[axis]
azimuth_deg = 20.0
zenith_distance_deg = 9.0
weight = [1.0, 2.0, 0.5]
orientation = "post"

[options]
common_scale = true
refraction = true
minimum_stars = [1, "2"]
pre_run = true
curves = true
plate_list = true
max_iterations_minimum = 7
max_iterations = 8
mean_error = 2e-6
histogram = true
tolerance = 1e-9
refraction_tolerance_arcsec = 0.01
distortion_tolerance = 1e-11
movement_factor = 2.5
movement_time = 1.25
crossover = 0.07
interval = 0.01
extent = 0.09
comparator_angle_deg = 30.0
distortion_first = 0.3
as_published = true

[stars]
file = "stars.csv"
weight = [9.0, 8.0, 1.0]

[images]
file = "images.csv"
weight = [1.0, 2.0, 0.25]
first_post = 300
first_event = 600
time_corrections_rad = [0.1, 0.2, 0.3]

[reject]
stars = [3]
points = [502]
"""
STARS = "star,ra_rad,dec_rad,unknown\n1,0.1,0.9,\n2,0.2,0.8,\n3,0.3,0.7,\n4,0.4,0.6,yes\n"
IMAGES = """star,point,x_m,y_m,sidereal_time_rad,orientation
1,101,0.01,0.02,1.0,
1,301,0.01,0.02,1.0,
2,502,0.03,0.01,1.1,
2,601,0.03,0.01,1.1,
3,102,0.05,0.01,1.1,
4,103,0.05,0.04,1.1,event
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "plate.toml").write_text(EVERY)
    (tmp_path / "stars.csv").write_text(STARS)
    (tmp_path / "images.csv").write_text(IMAGES)
    return tmp_path


def change(folder, file, old, new):
    path = folder / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))


def test_every_option_can_be_given(folder):
    problem = read_plain(folder / "plate.toml")
    options = problem.options
    default = Options()
    same = [f.name for f in fields(Options) if getattr(options, f.name) == getattr(default, f.name)]
    assert same == []
    assert options.minimum_stars == ("1", "2")
    assert options.pole == pytest.approx((0.3 * ARCSEC, -0.2 * ARCSEC))
    assert options.comparator_angle == pytest.approx(math.radians(30))
    assert options.reference.name == "REFERENCE"
    assert problem.axis.group == 1
    assert problem.axis.weight.tolist() == [[1.0, 0.5], [0.5, 2.0]]
    assert problem.star_ids == ("1", "2", "4")
    assert problem.known.tolist() == [True, True, False]
    assert problem.star_weights[0].tolist() == [[9.0, 1.0], [1.0, 8.0]]
    assert problem.image_weights[0].tolist() == [[1.0, 0.25], [0.25, 2.0]]
    assert problem.image_groups.tolist() == [0, 1, 2, 2]
    assert problem.image_times.tolist() == pytest.approx([1.1, 1.2, 1.4, 1.4])
    weights = problem.parameter_weights
    cx, cy = INDEX["cx"], INDEX["cy"]
    assert weights[np.ix_([cx, cy], [cx, cy])].tolist() == [[4e-2, 1e-2], [1e-2, 5e-2]]
    assert weights[INDEX["tau1"], INDEX["tau1"]] == 1e-13
    assert problem.fixed[INDEX["K3"]]
    assert problem.initial[[0, 3, 6]] == pytest.approx([math.pi / 20] * 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[axis]", "[axle]", coded("error.unknown.close", kind="table", name="axle")),
        ("curves = true", "curfes = true", coded("error.unknown.close", kind="key", name="curfes")),
        ("curves = true", 'curves = "no"', coded("error.key", table="options", key="curves")),
        (
            "max_iterations = 8",
            'max_iterations = "many"',
            coded("error.key", table="options", key="max_iterations"),
        ),
        ("max_iterations = 8", "max_iterations = -1", coded("error.key", key="max_iterations")),
        ("interval = 0.01", "interval = 0.0", coded("error.positive")),
        ("interval = 0.01", "interval = 1e-12", coded("stars.curve-steps")),
        ('minimum_stars = [1, "2"]', "minimum_stars = []", coded("error.requires")),
        ("first_post", "post", coded("error.unknown.close", kind="key", name="post")),
        ("latitude_deg = 30.0", "", coded("toml.missing", key="latitude_deg")),
        ("latitude_deg = 30.0", "latitude_deg = 95.0", coded("error.key", key="latitude_deg")),
        (
            'fixed = ["K3"]',
            'fixed = ["K9"]',
            coded("error.key", table="camera", key="K9", message="error.choice"),
        ),
        (
            "weight = [1.0, 2.0, 0.5]",
            "weight = [1.0, 2.0, 1.5]",
            coded("stars.indefinite"),
        ),
        ("weight = [1.0, 2.0, 0.25]", "weight = [1.0, 2.0, 3.0]", coded("stars.indefinite")),
        ("weight = [9.0, 8.0, 1.0]", "weight = [9.0, -8.0, 1.0]", coded("stars.indefinite")),
        (
            'orientation = "post"',
            'orientation = "past"',
            coded("error.key", key="orientation", message="error.choice"),
        ),
        ("stars = [3]", "stars = [33]", coded("error.unknown.close", name="33", close="3")),
        ('file = "stars.csv"', 'file = "none.csv"', "cannot be read"),
        ("cx = 0.3", 'prior = "none.json"\ncx = 0.3', "cannot be read"),
        ("[station]", "[station", "Expected"),
    ],
)
def test_what_cannot_be_used_is_named(folder, old, new, message):
    change(folder, "plate.toml", old, new)
    with pytest.raises(InputError, check=as_check(message)) as raised:
        read_plain(folder / "plate.toml")
    assert raised.value.file is not None


@pytest.mark.parametrize(
    ("file", "old", "new", "message", "record"),
    [
        ("stars.csv", "2,0.2,", "2,x,", coded("error.number", value="x"), 3),
        ("stars.csv", "2,0.2,", "2,,", coded("error.column", column="ra_rad", message="error.empty"), 3),
        ("stars.csv", "2,0.2,", "1,0.2,", coded("error.repeated", kind="star", name="1"), 3),
        ("stars.csv", "2,0.2,0.8,", "2,0.2,0.8,no,9", coded("error.cells"), 3),
        ("stars.csv", "ra_rad,dec_rad", "ra,dec", "the columns ra_rad, dec_rad are missing", 1),
        ("images.csv", "3,102", "9,102", coded("stars.unlisted", star="9"), 6),
        ("images.csv", "3,102", "3,A2", coded("stars.no-orientation", point="A2"), 6),
        (
            "images.csv",
            "1.1,event",
            "1.1,later",
            coded("error.column", column="orientation", message="error.choice"),
            7,
        ),
    ],
)
def test_bad_rows_are_named(folder, file, old, new, message, record):
    change(folder, file, old, new)
    with pytest.raises(InputError, check=as_check(message)) as raised:
        read_plain(folder / "plate.toml")
    assert (raised.value.file, raised.value.record) == (folder / file, record)


def test_blank_rows_do_not_count_but_their_records_do(folder):
    change(folder, "stars.csv", "2,0.2,", "\n\n2,x,")
    with rejected("error.column ra_rad: error.number x") as raised:
        read_plain(folder / "plate.toml")
    assert raised.value.record == 5


@pytest.mark.parametrize("target", ["plate.toml", "stars.csv", "images.csv", "link.csv"])
def test_no_result_is_written_over_an_input(tmp_path, monkeypatch, target):
    monkeypatch.chdir(tmp_path)
    for file in EXAMPLE.parent.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "link.csv").symlink_to("stars.csv")
    before = (tmp_path / target).read_bytes()
    run = CliRunner().invoke(app, ["stellar-camera", "plate.toml", "--json", target])
    assert run.exit_code == 1
    assert "must not be written over the input" in run.output
    assert (tmp_path / target).read_bytes() == before
    assert not (tmp_path / "plate-calibrated").exists()


def test_inputs_are_all_files(folder):
    assert inputs(folder / "plate.toml") == [
        folder / name for name in ("plate.toml", "stars.csv", "images.csv")
    ]


def test_the_numbers_of_the_page_are_those_of_the_command():
    command = [sys.executable, str(ROOT / "docs" / "regenerate.py"), "--check", "stellar-camera.md"]
    assert subprocess.run(command, check=False).returncode == 0


def test_the_figure_of_the_frames_is_drawn_as_they_are(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import stellar_figure

    # Left-handed triads of the report in the right-handed space of the picture; the camera's is right-handed.
    assert np.linalg.det(np.array(stellar_figure.local_axes())) == pytest.approx(-1)
    assert np.linalg.det(np.array(stellar_figure.globe_axes())) == pytest.approx(-1)
    assert np.linalg.det(np.array(stellar_figure.camera_axes())) == pytest.approx(1)
    drawn = stellar_figure.figure()
    for label in ("η east", "ξ north", "λ west", "90° W", "A"):
        assert f">{label}<" in drawn.replace("  ", " ") or label in drawn
    assert (ROOT / "docs" / "stellar-frames.svg").read_text(encoding="utf-8").count("<text") == drawn.count(
        "<text"
    )


@pytest.mark.parametrize(("delimiter", "decimal"), [(";", ","), ("\t", ","), (";", ".")])
def test_tables_of_stars_take_semicolons_as_other_tables_do(tmp_path, delimiter, decimal):
    for name in ("stars.csv", "images.csv"):
        text = (EXAMPLE.parent / name).read_text()
        (tmp_path / name).write_text(text.replace(",", delimiter).replace(".", decimal))
    (tmp_path / "plate.toml").write_text(EXAMPLE.read_text())
    given, plain = read_plain(tmp_path / "plate.toml"), read_plain(EXAMPLE)
    assert given.star_names == plain.star_names
    np.testing.assert_array_equal(given.image_xy, plain.image_xy)
    np.testing.assert_array_equal(given.image_times, plain.image_times)
