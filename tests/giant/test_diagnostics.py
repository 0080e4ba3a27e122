"""Warnings and fatal messages of the 1987 program: specification, section 11; limits: section 3."""

import dataclasses

import numpy as np
import pytest
from small_project import COMMON, FRAMES, GROUND, IMAGES, frame_record, ground_record, replaced, write_files

from photogram import InputError, adjust
from photogram.giant import ErrorWarning, Limits, error_warnings, read_project
from photogram.words import phrase


def image(name, x=1.0, y=2.0):
    return f"{name:10}{x:>10.3f}{y:>10.3f}"


def with_images(*, a=(), b=()):
    """IMAGES with further points on the frames A and B."""
    return [*IMAGES[:4], *map(image, a), *IMAGES[4:9], *map(image, b), IMAGES[9]]


def warnings_of(directory, limits=None, **changes):
    project = read_project(write_files(directory, **changes))
    return error_warnings(project, project.to_block(), limits)


def test_a_clean_project_has_no_warning(tmp_path):
    assert warnings_of(tmp_path, Limits(photos_per_point=2)) == []


@pytest.mark.giant("11", "CONTROL POINTS APPEARING ON ONE PHOTOGRAPH")
def test_section_11_control_points_on_one_photograph(tmp_path):
    # Types with one missing component at the most keep their control.
    records = [ground_record(f"C{code}", "1.", "2.", "3.", code=str(code)) for code in range(8)]
    images = with_images(b=[f"C{code}" for code in reversed(range(8))])
    (warning,) = warnings_of(tmp_path, IMAGES=images, GROUND=[*GROUND, *records])
    assert warning == ErrorWarning(
        "CONTROL POINTS APPEARING ON ONE PHOTOGRAPH", ["C7", "C6", "C5", "C3"], general=False
    )


@pytest.mark.giant("11", "PASS POINTS APPEARING ON ONE PHOTOGRAPH")
def test_section_11_pass_points_on_one_photograph(tmp_path):
    (warning,) = warnings_of(tmp_path, IMAGES=with_images(a=["Q", "P"], b=["A", "P"]))
    assert warning == ErrorWarning("PASS POINTS APPEARING ON ONE PHOTOGRAPH", ["Q", "A"], general=False)


@pytest.mark.giant("11", "PASS POINTS APPEARING ON MORE THAN n PHOTOGRAPHS")
def test_section_11_points_on_too_many_photographs(tmp_path):
    images = with_images(a=["Q"])
    warnings = warnings_of(tmp_path, Limits(photos_per_point=1), IMAGES=images)
    assert warnings == [
        ErrorWarning("PASS POINTS APPEARING ON ONE PHOTOGRAPH", ["Q"]),
        ErrorWarning("PASS POINTS APPEARING ON MORE THAN 1 PHOTOGRAPHS", ["1", "2", "3"]),
    ]


@pytest.mark.giant("11", "PASS POINTS APPEARING ON MORE THAN n PHOTOGRAPHS")
def test_section_11_a_point_twice_on_one_photograph_counts_once(tmp_path):
    assert warnings_of(tmp_path, Limits(photos_per_point=2), IMAGES=with_images(a=["1"])) == []


@pytest.mark.giant("11", "POINTS NOT PHOTOGRAPHED")
def test_section_11_points_not_photographed(tmp_path):
    records = [ground_record(name, "1.", "2.", "3.") for name in ("9", "8")]
    (warning,) = warnings_of(tmp_path, GROUND=[records[0], *GROUND, records[1]])
    assert warning == ErrorWarning("POINTS NOT PHOTOGRAPHED", ["9", "8"], general=True)


@pytest.mark.giant("11", "DUPLICATE CONTROL POINTS")
def test_section_11_duplicate_control_points(tmp_path):
    records = [ground_record(name, "7.", "7.", "7.") for name in ("2", "1", "2")]
    project = read_project(write_files(tmp_path, GROUND=[*GROUND, *records]))
    (warning,) = error_warnings(project, project.to_block())
    assert warning == ErrorWarning("DUPLICATE CONTROL POINTS", ["1", "2"], general=True)
    assert project.ground[0].position == (110, 210, 10)


@pytest.mark.parametrize("value", [0, -3, 2.5, "4"])
def test_limits_are_positive_whole_numbers(value):
    with pytest.raises(InputError, match=r"stations (must be|is not) a (positive )?whole number"):
        Limits(stations=value)


# Limits


def with_limits(directory, limits, **changes):
    project = read_project(write_files(directory, **changes))
    return project, project.to_block(limits)


def refused(directory, limits, **changes):
    with pytest.raises(InputError) as caught:
        with_limits(directory, limits, **changes)
    return caught.value


@pytest.mark.giant("3", "limits are options, unlimited by default")
def test_section_3_limits_are_none_by_default_and_read_by_their_names(tmp_path):
    assert Limits.parse("N1=300, n4=8") == Limits(stations=300, photos_per_point=8)
    assert Limits.parse("N2=1,N3=2,N5=3,N6=4") == Limits(points=1, control=2, cameras=3, bandwidth=4)
    exact = Limits(stations=2, points=3, control=3, photos_per_point=2, cameras=1, bandwidth=5)
    project, block = with_limits(tmp_path, exact)
    assert project.messages == []
    assert block.image_points.tolist() == project.to_block().image_points.tolist()
    for text in ("N7=3", "N1", "N1=", "N1=-1", "300", "N1=²", ""):
        with pytest.raises(InputError, check=lambda error: error.code == "giant.limits"):
            Limits.parse(text)


@pytest.mark.giant("11", "**CAMERA STATIONS EXCEEDED n")
@pytest.mark.giant("3", "N1: stations")
def test_section_11_camera_stations_exceeded(tmp_path):
    error = refused(tmp_path, Limits(stations=1))
    assert error.message.startswith("**CAMERA STATIONS EXCEEDED 1: there are 2;")
    assert (error.file, error.record) == (tmp_path / "FRAMES", 3)


@pytest.mark.giant("11", "**IMAGE POINTS EXCEEDED n")
@pytest.mark.giant("3", "N2: ground points")
@pytest.mark.giant("14", "31 N2 counts unique points")
def test_section_11_image_points_exceeded_counts_different_points(tmp_path):
    error = refused(tmp_path, Limits(points=2))
    assert error.message.startswith("**IMAGE POINTS EXCEEDED 2: there are 3;")
    # Points of frames that FRAMES does not list do not count.
    images = with_images(b=["Q"])
    with_limits(tmp_path, Limits(points=3), IMAGES=images, FRAMES=FRAMES[:2])


@pytest.mark.giant("11", "**GROUND CONTROL EXCEEDED n")
@pytest.mark.giant("3", "N3: control points")
def test_section_11_ground_control_exceeded_counts_records(tmp_path):
    error = refused(tmp_path, Limits(control=2))
    assert error.message.startswith("**GROUND CONTROL EXCEEDED 2: there are 3;")
    assert (error.file, error.record) == (tmp_path / "GROUND", 3)
    error = refused(tmp_path, Limits(control=3), GROUND=[*GROUND, GROUND[0]])
    assert error.message.startswith("**GROUND CONTROL EXCEEDED 3: there are 4;")


@pytest.mark.giant("3", "N5: camera systems")
def test_section_3_camera_systems_exceeded(tmp_path):
    error = refused(tmp_path, Limits(cameras=1), CAMERAS=["F1982        -152740", "F1983        -152740"])
    assert error.message.startswith("**CAMERA SYSTEMS EXCEEDED 1: there are 2;")


@pytest.mark.giant("11", "PASS POINTS APPEARING ON MORE THAN n PHOTOGRAPHS")
@pytest.mark.giant("3", "N4: frames on which one point may appear")
@pytest.mark.giant("6", "points on more than N4 photographs keep the first N4 images")
@pytest.mark.giant("14", "23 first N4 images in the order of the frames")
def test_section_11_the_first_images_in_the_order_of_frames_are_kept(tmp_path):
    # FRAMES lists B before A, though IMAGES has A first.
    frames = [*FRAMES[2:], *FRAMES[:2]]
    limits = Limits(photos_per_point=1)
    project, block = with_limits(tmp_path, limits, FRAMES=frames, IMAGES=with_images(a=["Q"]))
    assert block.photo_ids == ["B", "A"]
    images = block.image_photos, block.image_points
    named = [(block.photo_ids[p], block.point_ids[q]) for p, q in zip(*images, strict=True)]
    assert named == [("B", "3"), ("B", "2"), ("B", "1"), ("A", "Q")]
    message, *others = project.messages
    assert all(other.code == "giant.ties" for other in others)
    assert message.phrase == phrase("giant.many-photographs", limit=1, names=["3", "2", "1"])
    headings = [warning.heading for warning in error_warnings(project, block, limits)]
    assert "PASS POINTS APPEARING ON MORE THAN 1 PHOTOGRAPHS" in headings


def band_files():
    """Six frames in a strip, the images of the guide's table A.1, as records."""
    frames, images = [], []
    for number in range(1, 7):
        name = f"F{number}"
        frames += [frame_record(name, f"{number}00.", "0.", "1500."), frame_record(name, "", "", "")]
        images += [
            f"{name:40}F1982",
            *(image(f"P{point}", 1.0) for point in range(number, number + 3)),
            "****",
        ]
    return {"FRAMES": frames, "IMAGES": images, "GROUND": []}


@pytest.mark.giant("11", "**ERROR IN SUBROUTINE MODID")
@pytest.mark.giant("3", "N6: bandwidth")
def test_section_11_the_bandwidth_is_exceeded(tmp_path):
    with_limits(tmp_path, Limits(bandwidth=7), **band_files())
    error = refused(tmp_path, Limits(bandwidth=6), **band_files())
    assert error.message.splitlines()[:3] == [
        "**ERROR IN SUBROUTINE MODID",
        "ADDING VARIABLE 3",
        "VARIABLES    1    2",
    ]
    assert "point P3 with frame F3 exceeds it" in error.message
    assert (error.file, error.record) == (tmp_path / "FRAMES", 5)


@pytest.mark.giant("11", "**ERROR IN SUBROUTINE MODID")
def test_section_11_five_stations_stand_on_a_line(tmp_path):
    files = band_files()
    everywhere = [line for old in files["IMAGES"] for line in ([image("X"), old] if old == "****" else [old])]
    error = refused(tmp_path, Limits(bandwidth=12), **{**files, "IMAGES": everywhere})
    assert error.message.splitlines()[1:3] == ["ADDING VARIABLE 6", "VARIABLES    1    2    3    4    5"]


@pytest.mark.giant("11", "**ERROR IN SUBROUTINE MODID")
@pytest.mark.giant(
    "6", "intersection only: no bandwidth error, the point that would break the limit is named"
)
def test_section_11_intersection_names_the_point_that_would_break_the_limit(tmp_path):
    intersection = replaced(COMMON, 2, COMMON[1][:9] + "1" + COMMON[1][10:])
    project, block = with_limits(tmp_path, Limits(bandwidth=6), **band_files(), COMMON=intersection)
    assert len(block.image_xy) == 18
    (message,) = [message for message in project.messages if "bandwidth" in message.text]
    assert "at most 6, but point P3 with frame F3 exceeds it" in message.text
    assert message.record == 5


@pytest.mark.giant("11", "**ILLEGAL DMS FIELD DETECTED IN INPUT STREAM")
@pytest.mark.parametrize("angle", ["3610000.000", "6100.000", "61.000"])
def test_section_11_illegal_dms_field(tmp_path, angle):
    frames = replaced(FRAMES, 2, frame_record("A", "0.000", "-3.000", angle))
    error = refused(tmp_path, None, FRAMES=frames)
    assert "**ILLEGAL DMS FIELD DETECTED IN INPUT STREAM" in error.message
    assert (error.file, error.record, error.text) == (tmp_path / "FRAMES", 2, frames[1])


@pytest.mark.giant("11", "read error: record number and text")
def test_section_11_a_read_error_shows_the_record(tmp_path):
    error = refused(tmp_path, None, CAMERAS=["F1982        -15x740"])
    assert (error.file, error.record, error.text) == (tmp_path / "CAMERAS", 1, "F1982        -15x740")


@pytest.mark.giant("2.1", "2A4: names are compared exactly")
def test_section_2_1_names_that_differ_by_case_or_blanks_are_remarked_on(tmp_path):
    from photogram import simulate
    from photogram.giant import Project, read_project, write_project

    project = Project.from_block(simulate(strips=1, photos_per_strip=3, points_per_photo=10, seed=1).block)
    first = project.images[0].points[:2]
    for frame in project.images:
        frame.points = [{first[0]: "pt 1", first[1]: "PT1"}.get(name, name) for name in frame.points]
    control = next(point for point in project.ground if point.name not in first)
    # As the point is measured, and as somebody typed it.
    for frame in project.images:
        frame.points = ["Cp 7" if name == control.name else name for name in frame.points]
    control.name = "CP7"
    write_project(project, tmp_path / "p")
    project = read_project(tmp_path / "p")
    block = project.to_block()
    phrases = [message.phrase for message in project.messages]
    assert any(
        found.code == "giant.similar-points" and "'pt 1' and 'PT1'" in found.fields["names"]
        for found in phrases
    )
    assert (
        phrase("giant.ignored-control", point="CP7", hint=phrase("giant.similar-name", name="Cp 7"))
        in phrases
    )
    assert {"pt 1", "PT1", "Cp 7"} <= {*block.point_ids}


def test_of_control_that_stands_there_twice_by_hand_the_first_counts(tmp_path):
    project = read_project(write_files(tmp_path))
    project.ground.append(dataclasses.replace(project.ground[0], position=(1.0, 2.0, 3.0)))
    block = project.to_block()
    assert block.point_positions[0].tolist() == [110, 210, 10]
    assert project.messages[0].code == "giant.duplicate"
    assert error_warnings(project, block) == [ErrorWarning("DUPLICATE CONTROL POINTS", ["1"], general=True)]


# Not in the guide, but needed


@pytest.mark.parametrize(
    ("changes", "place", "why"),
    [
        pytest.param(
            {"FRAMES": [*FRAMES, frame_record("C", "1.", "2.", "3."), "C"]},
            ("FRAMES", 5),
            "the frame 'C' requires image observations",
            id="frame without images",
            marks=pytest.mark.giant("11", "frame without images"),
        ),
        pytest.param(
            {"IMAGES": replaced(IMAGES, 6, f"{'B':40}F1983")},
            ("IMAGES", 6),
            "a camera of CAMERAS, got 'F1983'",
            id="unknown camera",
            marks=pytest.mark.giant("11", "unknown camera"),
        ),
        pytest.param(
            {"IMAGES": IMAGES[:-1]},
            ("IMAGES", 9),
            "requires a terminator",
            id="missing terminator",
            marks=pytest.mark.giant("11", "missing terminator"),
        ),
        pytest.param(
            {"FRAMES": [*FRAMES, *FRAMES[:2]]},
            ("FRAMES", 5),
            "the frame 'A' is already listed in record 1",
            id="frame listed twice",
            marks=pytest.mark.giant("11", "frame listed twice"),
        ),
        pytest.param(
            {"COMMON": ["T", f"{'':17}-1"]},
            ("COMMON", 2),
            "convergence criterion must not be negative",
            id="E",
            marks=pytest.mark.giant("11", "E or iterations out of range"),
        ),
        pytest.param(
            {"COMMON": ["T", f"{'':13}-"]},
            ("COMMON", 2),
            "column",
            id="iterations",
            marks=pytest.mark.giant("11", "E or iterations out of range"),
        ),
    ],
)
def test_section_11_needed_beside_the_guide(tmp_path, changes, place, why):
    error = refused(tmp_path, None, **changes)
    assert (error.file, error.record) == (tmp_path / place[0], place[1])
    assert error.text == changes[place[0]][place[1] - 1]
    assert why in error.message


@pytest.mark.giant("11", "duplicate image in a frame")
def test_section_11_a_duplicate_image_is_left_out(tmp_path):
    project, block = with_limits(tmp_path, None, IMAGES=with_images(a=["1"]))
    assert [message.record for message in project.messages] == [5]
    assert project.messages[0].code == "giant.image-repeated"
    assert len(block.image_xy) == 6


@pytest.mark.giant("11", "station without enough rays")
def test_section_11_a_station_without_enough_rays(tmp_path):
    few = [*IMAGES[:3], *IMAGES[4:]]
    project, _ = with_limits(tmp_path, None, IMAGES=few, GROUND=[])
    about = [message for message in project.messages if message.code == "giant.ties"]
    assert [message.record for message in about] == [1, 3]
    assert about[0].phrase == phrase("giant.ties", frame="A", n=2)
    # Weights of its own are enough.
    own = ["5."] * 3
    frames = [
        frame_record(name, x, "200.", "1500.", *own) if x else frame_record(name, "0.", "0.", "0.", *own)
        for name in "AB"
        for x in ("100.", "")
    ]
    project, _ = with_limits(tmp_path, None, IMAGES=few, GROUND=[], FRAMES=frames)
    assert not any(message.code == "giant.ties" for message in project.messages)


@pytest.mark.giant("11", "singular point")
def test_section_11_a_singular_point_is_named(small_block):
    # Two photos from one station see the point; rays from one centre do not say how far it is.
    block = small_block
    images = block.image_photos == 0
    twin = len(block.photo_ids)
    changes = {
        name: np.concatenate([getattr(block, name), getattr(block, name)[:1]])
        for name in ("photo_positions", "photo_attitudes", "principal_distances")
    }
    row = np.flatnonzero(images)[:1]
    new = len(block.point_ids)
    both = np.array([0, twin])
    singular = block.replace(
        **changes,
        photo_ids=[*block.photo_ids, "TWIN"],
        photo_position_sd=np.full((twin + 1, 3), 1e-6),
        photo_attitude_sd=np.full((twin + 1, 3), 1e-9),
        point_ids=[*block.point_ids, "FAR"],
        point_positions=np.vstack([block.point_positions, np.full((1, 3), np.nan)]),
        point_sd=np.vstack([block.point_sd, np.full((1, 3), np.inf)]),
        image_photos=np.concatenate([block.image_photos, both]),
        image_points=np.concatenate([block.image_points, [new, new]]),
        image_xy=np.concatenate([block.image_xy, block.image_xy[row], block.image_xy[row]]),
        image_sd=np.array(0.01),
    )
    result = adjust(singular)
    assert result.dropped["FAR"] == "not-determined"
    assert "left out, its rays do not determine it: FAR" in [str(each) for each in result.messages]
