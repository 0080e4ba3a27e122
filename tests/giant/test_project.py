"""A project as a whole: finding and writing the files, and the rules between them."""

import dataclasses
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_project import (
    COMMON,
    FILES,
    FRAMES,
    GROUND,
    IMAGES,
    frame_record,
    ground_record,
    replaced,
    same,
    write_files,
)

from photogram import Block, InputError, Refraction
from photogram.giant import Project, read_project, write_project
from photogram.giant.export import adjusted_frames, adjusted_ground
from photogram.io.writing import write_whole
from photogram.words import phrase


def project_of(directory, **changes):
    return read_project(write_files(directory, **changes))


def caught_by(directory, **changes):
    """Return the error that the files raise, read and assembled."""
    with pytest.raises(InputError) as caught:
        project_of(directory, **changes).to_block()
    return caught.value


def texts(project):
    return [message.text for message in project.messages]


# Files


def test_files_are_found_in_any_case_with_any_extension(tmp_path):
    write_files(tmp_path)
    for old, new in (("COMMON", "common.dat"), ("IMAGES", "Images.txt"), ("GROUND", "ground")):
        (tmp_path / old).rename(tmp_path / new)
    (tmp_path / "GROUND.d").mkdir()
    assert [frame.name for frame in read_project(str(tmp_path)).frames] == ["A", "B"]


@pytest.mark.giant("2", "unit 1: CAMERAS")
@pytest.mark.giant("2", "unit 2: IMAGES")
@pytest.mark.giant("2", "unit 3: FRAMES")
@pytest.mark.giant("2", "unit 4: GROUND")
@pytest.mark.giant("2", "unit 7: COMMON")
@pytest.mark.parametrize("name", FILES)
def test_section_2_a_missing_file_is_named(tmp_path, name):
    write_files(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(InputError, check=lambda error: error.code == "giant.missing") as caught:
        read_project(tmp_path)
    assert caught.value.file == tmp_path


def test_two_candidates_for_one_file(tmp_path):
    write_files(tmp_path)
    (tmp_path / "frames.old").touch()
    with pytest.raises(
        InputError, match=r"FRAMES, frames\.old", check=lambda error: error.code == "giant.several"
    ):
        read_project(tmp_path)


def test_a_directory_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_project(tmp_path / "nowhere")


def test_writing_refuses_to_overwrite(tmp_path):
    project = project_of(tmp_path)
    (tmp_path / "FRAMES").rename(tmp_path / "frames.dat")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, check=lambda error: error.code == "giant.overwrite"):
        write_project(project, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    write_project(project, tmp_path, overwrite=True)
    assert {path.name for path in tmp_path.iterdir()} == set(before)
    assert read_project(tmp_path).frames == project.frames


def test_nothing_is_written_when_a_value_does_not_fit(tmp_path):
    project = project_of(tmp_path)
    project.ground[2].name = "much too long"
    with pytest.raises(InputError, match="GROUND cannot be written: the name 'much too long'"):
        write_project(project, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_files_are_written_whole_or_not_at_all(tmp_path):
    (tmp_path / "B").mkdir()
    (tmp_path / "B" / "x").touch()
    with pytest.raises(NotADirectoryError):
        write_whole({tmp_path / "B" / "x" / "y": b"", tmp_path / "A": b"new"})
    assert [path.name for path in tmp_path.iterdir()] == ["B"]


# From files to a block


@pytest.mark.giant("2.4", "header, columns 21-30: standard deviation of x, default 0.010 mm")
@pytest.mark.giant("2.4", "header, columns 31-40: standard deviation of y, default 0.010 mm")
@pytest.mark.giant("2.6", "values in ignored fields may be 0.000")
def test_section_2_4_the_block_of_the_small_project(tmp_path):
    project = project_of(tmp_path)
    block = project.to_block()
    assert project.messages == []
    assert project.title == block.title == "A SMALL BLOCK"
    assert block.photo_ids == ["A", "B"]
    assert block.point_ids == ["1", "2", "3"]
    assert block.principal_distances.tolist() == [-152.74, -152.74]
    assert block.image_points.tolist() == [0, 1, 2, 2, 1, 0]
    assert block.image_photos.tolist() == [0, 0, 0, 1, 1, 1]
    assert block.image_xy[3].tolist() == [-1, 2]
    assert block.image_sd[[2, 3]].tolist() == [[0.010, 0.010], [0.006, 0.008]]
    assert block.photo_position_sd.tolist() == [[60000] * 3, [5, 6, 60000]]
    assert np.degrees(block.photo_attitude_sd) == pytest.approx(np.array([[90, 90, 90], [90, 90, 0.5]]))
    assert np.degrees(block.photo_attitudes[0]) == pytest.approx([0, -3 / 3600, 90])
    assert block.point_sd.tolist() == [[0.02, 1, 1], [math.inf, math.inf, 0.04], [math.inf] * 3]
    # Zero or blank in an ignored field is no value; a value there is kept for comparison.
    np.testing.assert_equal(block.point_positions, [[110, 210, 10], [np.nan, np.nan, 20], [50, 60, np.nan]])
    assert not block.photo_to_ground


def test_record_3_of_common_is_the_default_of_ground(tmp_path):
    block = project_of(tmp_path, COMMON=[*COMMON, f"{'0.5':>10}{'':10}{'0.7':>10}"]).to_block()
    assert block.point_sd.tolist() == [[0.02, 1, 0.7], [math.inf, math.inf, 0.04], [math.inf] * 3]


@pytest.mark.giant("2.4", "frames in any order")
def test_section_2_4_photos_follow_frames_and_points_follow_photos(tmp_path):
    project = project_of(tmp_path, FRAMES=[*FRAMES[2:], *FRAMES[:2]])
    block = project.to_block()
    assert block.photo_ids == ["B", "A"]
    assert block.point_ids == ["3", "2", "1"]


@pytest.mark.giant("2.4", "frames missing from FRAMES are ignored silently")
def test_section_2_4_frames_missing_in_frames_are_ignored_silently(tmp_path):
    project = project_of(tmp_path, FRAMES=FRAMES[:2])
    block = project.to_block()
    assert block.photo_ids == ["A"]
    assert len(block.image_xy) == 3
    assert [message.phrase for message in project.messages] == [phrase("giant.ties", frame="A", n=2)]


@pytest.mark.giant("14", "26 a frame without images: fatal in triangulation, a warning in intersection")
def test_section_14_a_frame_without_images_is_fatal_in_triangulation(tmp_path):
    new = [frame_record("C", "1.", "2.", "3."), frame_record("C", "", "", "")]
    error = caught_by(tmp_path, FRAMES=[*FRAMES, *new])
    assert (error.file, error.record, error.text) == (tmp_path / "FRAMES", 5, new[0])
    assert (error.code, error.phrase.fields["frame"]) == ("giant.no-images", "C")
    intersection = replaced(COMMON, 2, COMMON[1][:9] + "1" + COMMON[1][10:])
    project = project_of(tmp_path, FRAMES=[*FRAMES, *new], COMMON=intersection)
    assert project.to_block().photo_ids == ["A", "B"]
    assert [message.record for message in project.messages] == [5]


def test_a_frame_with_a_header_and_no_points_has_no_images(tmp_path):
    error = caught_by(tmp_path, IMAGES=[IMAGES[0], *IMAGES[4:]])
    assert (error.code, error.phrase.fields["frame"]) == ("giant.no-images", "A")


def test_a_header_that_was_read_as_a_point_is_pointed_at(tmp_path):
    header = f"{'B':10}{'-152740':>10}{'0.006':>10}"
    error = caught_by(tmp_path, IMAGES=[*IMAGES[:4], header, *IMAGES[6:]])
    assert (error.file, error.record) == (tmp_path / "FRAMES", 3)
    assert error.phrase.fields["hint"] == phrase("giant.lost-header", frame="A", record=5)


@pytest.mark.giant("14", "16 camera not in CAMERAS and no principal distance: fatal")
@pytest.mark.giant("2.4", "header, columns 11-20: principal distance, blank: from CAMERAS")
def test_section_14_an_unknown_camera_is_fatal_without_a_principal_distance(tmp_path):
    error = caught_by(tmp_path, IMAGES=replaced(IMAGES, 6, IMAGES[5].replace("F1982", "F1983")))
    assert (error.file, error.record, error.text) == (
        tmp_path / "IMAGES",
        6,
        "B                       0.0060    0.0080F1983",
    )
    assert error.code == "giant.unknown-camera"
    assert error.phrase.fields == {"frame": "B", "camera": "F1983", "names": ["'F1982'"]}
    own = replaced(IMAGES, 6, f"{'B':10}{'88500':>10}{'':20}F1983")
    assert project_of(tmp_path, IMAGES=own).to_block().principal_distances.tolist() == [-152.74, 88.5]


def test_a_frame_with_images_twice_is_fatal_where_it_is_used(tmp_path):
    twice = [*IMAGES, *IMAGES[:5]]
    error = caught_by(tmp_path, IMAGES=twice)
    assert (error.record, error.text) == (11, IMAGES[0])
    assert error.code == "giant.images-repeated"
    assert project_of(tmp_path, IMAGES=twice, FRAMES=FRAMES[2:]).to_block().photo_ids == ["B"]


@pytest.mark.giant("14", "25 the same point twice in one frame: the first is kept, with a warning")
def test_section_14_of_a_duplicate_image_the_first_is_kept(tmp_path):
    second = f"{'1':10}{'77000':>10}{'77000':>10}"
    project = project_of(tmp_path, IMAGES=[*IMAGES[:4], second, *IMAGES[4:]])
    block = project.to_block()
    assert block.image_xy[:, 0].tolist() == [10, -10, 1.5, -1, -2, 4]
    (message,) = project.messages
    assert (message.file, message.record, message.record_text) == (tmp_path / "IMAGES", 5, second)
    assert message.phrase == phrase("giant.image-repeated", point="1", frame="A")
    project.to_block()
    assert project.messages == [message]


@pytest.mark.giant("6", "control without images is ignored")
@pytest.mark.giant("14", "29 control that is not photographed")
def test_section_6_control_that_is_not_photographed_is_ignored(tmp_path):
    record = ground_record("9", "1.", "2.", "3.")
    project = project_of(tmp_path, GROUND=[*GROUND, record])
    assert project.to_block().point_ids == ["1", "2", "3"]
    (message,) = project.messages
    assert (message.record, message.record_text) == (4, record)
    assert message.phrase == phrase("giant.ignored-control", point="9", hint="")


@pytest.mark.parametrize("ground", [[], [GROUND[2]]])
def test_no_control_at_all_is_remarked_on(tmp_path, ground):
    project = project_of(tmp_path, GROUND=ground)
    assert not np.isfinite(project.to_block().point_sd).any()
    assert project.messages[0].file == (tmp_path / "GROUND" if ground else tmp_path)
    assert [message.code for message in project.messages] == ["giant.no-control"]


def test_refraction_is_that_of_the_guide(tmp_path):
    project = project_of(tmp_path, COMMON=replaced(COMMON, 2, "01000000001009 11 1"))
    assert project.to_block().refraction == Refraction("giant", "giant", 0.0)
    codes = [message.code for message in project.messages]
    assert codes == ["giant.air-refraction", "giant.water-refraction"]


def test_no_frames(tmp_path):
    assert caught_by(tmp_path, FRAMES=[]).code == "giant.no-frames"


def test_the_remarks_of_all_files_are_collected(tmp_path):
    project = project_of(
        tmp_path,
        FRAMES=replaced(FRAMES, 2, frame_record("A", "60.", "- 3.", "900000.")),
        GROUND=[*GROUND, GROUND[0]],
    )
    assert [message.file.name for message in project.messages] == ["FRAMES", "FRAMES", "GROUND"]


# Round trips


def test_read_write_read_gives_the_same_numbers(tmp_path):
    project = project_of(tmp_path)
    write_project(project, tmp_path / "again")
    same(project, read_project(tmp_path / "again"))


def test_strasbourg(strasbourg, tmp_path):
    project = read_project(strasbourg / "giant")
    block = project.to_block()
    assert project.messages == []
    assert block.photo_ids == ["8811", "8936", "8937", "8938", "9111"]
    assert (len(block.point_ids), len(block.image_xy)) == (381, 1196)
    assert (np.isfinite(block.point_sd).sum(), block.image_sd.min(), block.image_sd.max()) == (
        42,
        0.006,
        0.006,
    )
    assert block.principal_distances.tolist() == [-123.9392] * 5
    assert np.degrees(block.photo_attitudes[1]) == pytest.approx([-1, -0.5, 93])
    write_project(project, tmp_path)
    same(project, read_project(tmp_path))


def small_block(rng, geographic, photos=3, points=6):
    """Make a block of random numbers: nothing in it fits together but the names."""
    spheroid = None
    scale, offset = np.array([5000.0, 5000, 300]), np.array([600000.0, 5e6, 0])
    if geographic:
        # Needs the extension module, which rectangular blocks do not.
        from photogram import Spheroid

        spheroid = Spheroid(6378206.4, 6356583.8)
        scale, offset = (
            np.array([0.01, 0.01, 300]),
            np.radians([rng.uniform(-179, 179), rng.uniform(-80, 80), 0]),
        )
    image_photos, image_points = (axis.ravel() for axis in np.indices((photos, points)))
    point_sd = rng.choice([np.inf, 0.25], size=(points, 3)) * scale / 1000
    unknown = (rng.random((points, 3)) < 0.5) & np.isinf(point_sd)
    return Block(
        photo_ids=[f"F{i}" for i in range(photos)],
        photo_positions=offset + scale * rng.normal(size=(photos, 3)),
        photo_attitudes=rng.uniform(-np.pi, np.pi, (photos, 3)),
        principal_distances=rng.choice([-152.74, 88.5], photos),
        point_ids=[f"P{i}!" for i in range(points)],
        point_positions=np.where(unknown, np.nan, offset + scale * rng.normal(size=(points, 3))),
        image_photos=image_photos,
        image_points=image_points,
        image_xy=rng.uniform(-115, 115, (photos * points, 2)),
        image_sd=np.array([[0.01, 0.02]]) * (1 + image_photos[:, None]),
        photo_position_sd=rng.choice([np.inf, 0.5], (photos, 3)) * scale / 100,
        photo_attitude_sd=rng.choice([np.inf, 0.5], (photos, 3)),
        point_sd=point_sd,
        spheroid=spheroid,
        photo_to_ground=bool(rng.random() < 0.5),
        title="RANDOM",
    )


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), geographic=st.booleans())
def test_a_block_survives_the_files(tmp_path_factory, seed, geographic):
    block = small_block(np.random.default_rng(seed), geographic)
    directory = tmp_path_factory.mktemp("block")
    project = Project.from_block(block)
    write_project(project, directory)
    again = read_project(directory).to_block()

    assert again.photo_ids == block.photo_ids
    assert again.point_ids == block.point_ids
    assert again.photo_to_ground == block.photo_to_ground
    assert again.spheroid == block.spheroid
    angle, length = math.radians(0.000051 / 3600), 0.0000501
    tolerance = np.array([angle, angle, length]) if geographic else np.array([length, length, length])
    assert (np.abs(again.photo_positions - block.photo_positions) <= tolerance).all()
    turn = np.remainder(again.photo_attitudes - block.photo_attitudes + np.pi, 2 * np.pi) - np.pi
    assert np.abs(turn).max() <= angle
    difference = np.abs(again.point_positions - block.point_positions)
    assert (np.isnan(difference) == np.isnan(block.point_positions)).all()
    assert (np.nan_to_num(difference) <= tolerance).all()
    assert np.abs(again.image_xy - block.image_xy).max() <= 0.0000051
    np.testing.assert_allclose(again.image_sd, block.image_sd, rtol=1e-12)
    np.testing.assert_allclose(again.point_sd, block.point_sd, rtol=1e-5)
    known = np.isfinite(block.photo_position_sd)
    np.testing.assert_allclose(again.photo_position_sd[known], block.photo_position_sd[known], rtol=1e-5)
    assert np.isfinite(again.photo_position_sd).all()
    np.testing.assert_equal(again.principal_distances, block.principal_distances)


@pytest.mark.giant("2.5", "angles from 0 to 360 or -180 to 180 degrees")
def test_section_2_5_longitudes_may_be_written_from_0_to_360(tmp_path):
    frames = [
        frame_record(name, lon, "293917.764", "4556.590")
        for name, lon in (("A", "2650055."), ("B", "-950005."))
    ]
    records = [frames[0], "A", frames[1], "B"]
    block = project_of(tmp_path, COMMON=["T", "10"], FRAMES=records, GROUND=[]).to_block()
    assert np.degrees(block.photo_positions[:, 0]) == pytest.approx([-(95 - 55 / 3600), -(95 + 5 / 3600)])


@pytest.mark.giant("14", "14 zero standard deviation is the default")
@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"point_sd": 0.0, "point_positions": 1.0}, "point P0! must not be fixed"),
        ({"photo_position_sd": 0.0}, "the position of photo F0 must not be fixed"),
        ({"image_sd": np.arange(1.0, 37).reshape(18, 2)}, "image observations of photo F0 must have equal"),
    ],
)
def test_section_14_what_giant_files_cannot_say(changes, why):
    block = small_block(np.random.default_rng(1), geographic=False).replace(**changes)
    with pytest.raises(InputError, match=why):
        Project.from_block(block)


# The adjusted files


@pytest.mark.giant("2", "standard deviations of the original input are kept, never tightened")
@pytest.mark.giant(
    "2", "unit 9: adjusted GROUND of points on two or more photographs, only when the solution converges"
)
@pytest.mark.giant(
    "14", "24 units 8, 9, 20: layout, standard deviations, type codes, 4 decimals of the second"
)
@pytest.mark.giant("14", "27 kappa 0 to 360, omega and phi -180 to 180 degrees")
def test_section_2_adjusted_stations_and_points_keep_weights_and_codes(tmp_path):
    images = [*IMAGES[:4], f"{'4':10}{'1.':>10}{'1.':>10}", f"{'5':10}{'1.':>10}{'1.':>10}", *IMAGES[4:9]]
    images += [f"{'4':10}{'1.':>10}{'1.':>10}", IMAGES[9]]
    project = project_of(tmp_path, IMAGES=images)
    block = project.to_block()
    assert block.point_ids == ["1", "2", "3", "4", "5"]
    positions, attitudes = block.photo_positions + 1, block.photo_attitudes - np.radians([1, 2, 100])
    frames = adjusted_frames(project, block, positions, attitudes)
    assert [frame.position for frame in frames] == [tuple(row) for row in positions.tolist()]
    assert np.degrees(frames[0].attitude) == pytest.approx([-1, -2 - 3 / 3600, 350])
    assert [frame.position_sd for frame in frames] == [frame.position_sd for frame in project.frames]
    assert [frame.attitude_sd for frame in frames] == [frame.attitude_sd for frame in project.frames]

    adjusted = np.arange(15.0).reshape(5, 3)
    adjusted[2] = np.nan
    ground = adjusted_ground(project, block, adjusted)
    assert [(point.name, point.type_code) for point in ground] == [("1", 0), ("2", 3), ("4", 7)]
    assert [point.position for point in ground] == [(0, 1, 2), (3, 4, 5), (9, 10, 11)]
    assert [point.sd for point in ground[:2]] == [point.sd for point in project.ground[:2]]

    # Read as input again they change nothing but the values.
    again = dataclasses.replace(project, frames=frames, ground=ground, messages=[])
    write_project(again, tmp_path / "again")
    restart = read_project(tmp_path / "again").to_block()
    np.testing.assert_allclose(restart.photo_positions, positions, atol=1e-9)
    np.testing.assert_array_equal(restart.photo_position_sd, block.photo_position_sd)
    np.testing.assert_array_equal(restart.point_sd, block.point_sd)


@pytest.mark.speed
def test_a_hundred_thousand_images_are_read_in_a_second(tmp_path):
    rng = np.random.default_rng(5)
    block = small_block(rng, geographic=False, photos=100, points=1000)
    write_project(Project.from_block(block), tmp_path)
    start = time.process_time()
    project = read_project(tmp_path)
    seconds = time.process_time() - start
    assert sum(len(frame.points) for frame in project.images) == 100_000
    assert seconds < 1.0
