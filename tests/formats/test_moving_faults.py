"""Faults in tables of what moves: each is named with its file, record and text."""

import pytest
from damaged import check_damaged
from moving import edited
from test_plain_project import change

from message_codes import check_words, rejected
from photogram import InputError, formats

FAULTS = [
    ("drone", "cameras.csv", "inf,down", "inf,sideways", ["record 2", "readout_direction", "sideways"]),
    ("drone", "cameras.csv", "0.02,inf", ",inf", ["record 2", "error.column readout: error.empty"]),
    ("drone", "cameras.csv", "3000,2000", ",", ["record 2", "plain.picture-edges"]),
    ("drone", "cameras.csv", "0.02,inf", "0.02,-1", ["record 2", "column sd_readout"]),
    ("drone", "photos.csv", "DJI_0,drone", "DJI_0,phone", ["record 2", "column camera"]),
    ("drone", "velocities.csv", "DJI_0,", "DJI_9,", ["record 2", "error.unknown.close photo DJI_9"]),
    ("drone", "velocities.csv", "DJI_0,", "DJI_0,x", ["record 2", "column vx"]),
    ("lines", "trajectories.csv", "polynomial", "polynom", ["record 2", "column position", "polynom"]),
    ("lines", "trajectories.csv", "hermite", "cubic", ["record 2", "column interpolation", "cubic"]),
    ("lines", "trajectories.csv", "polynomial,1", "polynomial,9", ["record 2", "from 0 to 8"]),
    (
        "lines",
        "trajectories.csv",
        "polynomial,1",
        "polynomial,1.5",
        ["record 2", "error.column position_degree: error.whole 1.5"],
    ),
    (
        "lines",
        "trajectories.csv",
        "polynomial,1",
        "none,1",
        ["record 2", "position_degree", "error.not-applicable position_degree position none"],
    ),
    (
        "lines",
        "trajectories.csv",
        "polynomial,1",
        "none,",
        ["record 2", "error.not-applicable position_reference position none"],
    ),
    (
        "lines",
        "trajectories.csv",
        "strip 7",
        "strip 8",
        ["error.column trajectory: error.unknown.close trajectory strip 7"],
    ),
    (
        "lines",
        "trajectory_positions.csv",
        "strip 7,201.0",
        "strip 7,200.0",
        ["record 3", "error.column time: plain.increase"],
    ),
    (
        "lines",
        "trajectory_positions.csv",
        "strip 7,201.0",
        "strip 7,",
        ["record 3", "column time: must have a value"],
    ),
    ("lines", "trajectory_positions.csv", ",60.0,", ",,", ["record 2", "vx, vy, vz must all have values"]),
    ("lines", "trajectory_attitudes.csv", "strip 7,200.25", "strip 7,200.25x", ["record 3", "column time"]),
    ("lines", "trajectory_knots.csv", "rotation", "turns", ["record 2", "column of", "turns"]),
    ("lines", "trajectory_coefficients.csv", "position,1", "position,2", ["record 3", "from 0 to 1"]),
    (
        "lines",
        "trajectory_coefficients.csv",
        "position,1",
        "position,0",
        ["record 3", "error.repeated coefficient 0"],
    ),
    (
        "lines",
        "trajectory_coefficients.csv",
        "strip 7,position,1",
        "strip 8,position,1",
        ["record 3", "'strip 8'"],
    ),
    ("lines", "line_times.csv", "L1,1000.0", "L1,0.0", ["record 3", "error.column line: plain.increase"]),
    (
        "lines",
        "line_times.csv",
        "L2,",
        "L3,",
        ["record 4", "error.column photo: error.unknown.close photo L3"],
    ),
    ("lines", "line_times.csv", ",0.002\nL2", ",0\nL2", ["record 2", "seconds per line"]),
    (
        "lines",
        "cameras.csv",
        "3000.0,0.01,0.0",
        "3000.0,,",
        ["cameras.csv, record 2", "error.unknown.close parameter of the model brown s0 r0"],
    ),
    ("lines", "cameras.csv", ",3000.0,", ",,", ["cameras.csv, record 2", "column s0"]),
    (
        "lines",
        "cameras.csv",
        "brown",
        "rad_tan_thin_prism_fisheye",
        ["cameras.csv, record 2", "error.column s0: plain.line-parameter rad_tan_thin_prism_fisheye"],
    ),
    ("lines", "photos.csv", "L1,down", "L1,", ["record 2", "column camera"]),
    ("lines", "photos.csv", "strip 7", "strip 8", ["record 2", "column trajectory", "'strip 8'"]),
    ("lines", "photos.csv", "rig,ahead", "rig,behind", ["record 3", "plain.no-sensor-of-rig rig behind"]),
    (
        "lines",
        "photos.csv",
        "rig,ahead",
        "pair,ahead",
        ["record 3", "error.column rig: error.unknown rig pair rig"],
    ),
    (
        "lines",
        "photos.csv",
        "oscillator,1.0,0.00001",
        "oscillator,1.1,1e-5",
        ["record 3", "column scan", "same values"],
    ),
    ("lines", "gnss.csv", "strip 7,201.0", "strip 7,", ["record 2", "column time: must have a value"]),
    ("lines", "gnss.csv", "strip 7,201.0", ",201.0", ["record 2", "error.exclusive photo trajectory"]),
    (
        "lines",
        "rates.csv",
        "strip 7,201.0",
        "strip 9,201.0",
        ["record 2", "error.unknown.close trajectory strip 9"],
    ),
    ("lines", "gnss_groups.csv", "receiver,0.001", "receiver,0.002", ["same values", "column clock"]),
    ("lines", "attitude_groups.csv", "gyro,", "gyro,x", ["record 3", "column bias_x"]),
    (
        "lines",
        "covariances.csv",
        "strip 7 rotation 0",
        "strip 7 rotation 50",
        ["record 2", "error.unknown.close rotation coefficient strip 7 rotation 50"],
    ),
]


@pytest.mark.parametrize(("name", "file", "old", "new", "words"), FAULTS)
def test_a_fault_is_named_with_file_record_and_text(moving_projects, name, file, old, new, words):
    change(moving_projects / name / file, old, new)
    with pytest.raises(InputError) as refused:
        formats.read(moving_projects / name)
    for word in words:
        check_words(word, refused.value)
    assert refused.value.file is not None


@pytest.mark.parametrize(
    ("name", "file", "column", "value", "words"),
    [
        ("lines", "photos.csv", "vx", "1", ["photos.csv, record 2", "without a trajectory"]),
        ("lines", "photos.csv", "sd_x", "1", ["photos.csv, record 2", "plain.sd-on-trajectory"]),
        ("lines", "cameras.csv", "sd_x0", "1", ["cameras.csv, record 2", "sd_xp"]),
        (
            "lines",
            "trajectories.csv",
            "rotation_scale",
            "1",
            ["record 2", "rotation_scale", "error.not-applicable rotation_scale rotation spline"],
        ),
        (
            "lines",
            "trajectories.csv",
            "sd_position",
            "-1",
            ["record 2", "error.column sd_position: error.not-negative -1.0"],
        ),
        ("drone", "photos.csv", "sd_omega", "1", ["photos.csv, record 2", "plain.moving-attitude"]),
        ("drone", "photos.csv", "line_rate", "1.5", ["photos.csv, record 2", "plain.line-rate"]),
        (
            "drone",
            "photos.csv",
            "trajectory",
            "one",
            ["photos.csv, record 2", "error.column trajectory: error.absent trajectory one"],
        ),
        ("drone", "cameras.csv", "readout_begin", "1", ["cameras.csv, record 2"]),
        ("drone", "velocities.csv", "group", "one", None),
    ],
)
def test_a_column_that_does_not_belong_there(moving_projects, name, file, column, value, words):
    edited(moving_projects / name / file, lambda table: table.assign(**{column: value}))
    if words is None:
        formats.read(moving_projects / name)
        return
    with pytest.raises(InputError) as refused:
        formats.read(moving_projects / name)
    for word in words:
        check_words(word, refused.value)


def test_tables_of_trajectories_that_there_are_not(moving_projects):
    (moving_projects / "lines" / "trajectories.csv").unlink()
    with rejected("trajectory_positions.csv: error.missing trajectories.csv"):
        formats.read(moving_projects / "lines")


@pytest.mark.parametrize("name", ["drone", "lines"])
def test_damaged_tables_end_in_a_message(moving_projects, tmp_path, name):
    assert check_damaged(moving_projects / name, tmp_path / "damaged", "plain", 150, 7) > 40
