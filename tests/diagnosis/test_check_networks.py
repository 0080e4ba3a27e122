"""The check of networks of every kind: lenses, observations beside images, frames, photos without poses."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

from golden_network import free_network
from photogram import Camera, Distance, InputError, Position, diagnose, simulate
from photogram.collection import Collection, adjust
from photogram.collection import simulate as simulate_collection
from photogram.giant import Project
from photogram.network import with_distances, with_gnss, with_inertial, with_rig

SIZE = {"strips": 3, "photos_per_strip": 6, "points_per_photo": 40}
OPENCV = Camera("opencv", {"fx": 9000.0, "fy": 9000.0, "cx": 6000.0, "cy": 6000.0, "k1": -0.05})
PIXELS = {"frame_size": 12000.0, "image_sd": 0.3, "principal_distance": -9000.0}


def kinds(found):
    return {finding.kind for finding in found.grave}


def clean():
    gnss = with_gnss(simulate(seed=3, **SIZE), sd=0.1)
    frames = simulate(seed=5, strips=2, photos_per_strip=6, points_per_photo=40)
    poses = simulate(seed=7, strips=2, photos_per_strip=6, points_per_photo=40).block
    return {
        "lens in mm": simulate(seed=1, cameras=[Camera("brown", {"c": -152.0, "K1": -2e-8})], **SIZE).block,
        "lens in px": simulate(seed=2, cameras=[OPENCV], **PIXELS, **SIZE).block,
        "gnss": gnss.block,
        "inertial": with_inertial(gnss).block,
        "distances": with_distances(simulate(seed=4, **SIZE), count=15).block,
        "frames": with_rig(frames, [[0, 0, 0], [1.0, 0, 0]], [[0, 0, 0], [0, 0.3, 0]]).block,
        "no control": simulate(seed=6, control="none", **SIZE).block,
        "no poses": poses.replace(
            photo_positions=np.nan * poses.photo_positions, photo_attitudes=np.nan * poses.photo_attitudes
        ),
    }


@pytest.mark.parametrize("name", clean())
def test_clean_networks_have_no_grave_finding(name):
    found = diagnose(clean()[name])
    assert found.grave == []
    assert found.result.converged


@pytest.mark.parametrize("bars", [True, False])
def test_the_golden_free_network_has_no_grave_finding(bars):
    assert diagnose(free_network(bars=bars)).grave == []


def test_errors_of_images_in_pixels_are_told_in_pixels():
    block = simulate(seed=2, cameras=[OPENCV], **PIXELS, **SIZE).block
    rays = np.bincount(block.image_points)
    row = int(np.flatnonzero(rays[block.image_points] >= 4)[7])
    xy = block.image_xy.copy()
    xy[row, 1] += 40
    (finding,) = diagnose(block.replace(image_xy=xy)).grave
    assert block.photo_ids[block.image_photos[row]] in finding.photos
    assert finding.points == [block.point_ids[block.image_points[row]]]
    assert " px" in finding.text


def test_an_observed_distance_that_is_wrong_is_named():
    # Corners of the block: the images alone know it to a decimetre.
    block = with_distances(simulate(seed=4, **SIZE), count=15, sd=0.05).block
    places = dict(zip(block.point_ids, block.point_positions, strict=True))
    known = [name for name, place in places.items() if np.isfinite(place).all()]
    first, second = known[0], known[-1]
    length = float(np.linalg.norm(places[first] - places[second]))
    wrong = Distance(first, second, length + 30, sd=0.05)
    (finding,) = diagnose(block.replace(observations=[*block.observations, wrong])).grave
    assert finding.kind == "observation-misfit"
    assert finding.points == [first, second]
    assert finding.values["error_m"] == pytest.approx(30, abs=1)


def test_photos_that_cannot_be_started_are_named():
    block = simulate(seed=7, strips=2, photos_per_strip=6, points_per_photo=40).block
    keep = (block.image_photos != 11) | (np.cumsum(block.image_photos == 11) <= 2)
    block = block.replace(
        photo_positions=np.nan * block.photo_positions,
        photo_attitudes=np.nan * block.photo_attitudes,
        image_photos=block.image_photos[keep],
        image_points=block.image_points[keep],
        image_xy=block.image_xy[keep],
        image_sd=block.image_sd[keep],
    )
    found = diagnose(block)
    (missing,) = [each for each in found.grave if each.kind == "no-first-values"]
    assert missing.photos == [block.photo_ids[11]]


def test_half_a_pixel_is_told_where_the_network_knows_it():
    # Kappa turned on every other photo: the principal point shows.
    truth = simulate(
        seed=2,
        strips=4,
        photos_per_strip=8,
        points_per_photo=200,
        cameras=[OPENCV],
        crab=0.7,
        tilt=0.09,
        control_sd=0.01,
        control_spacing=1,
        flying_height=1000.0,
        **{**PIXELS, "image_sd": 0.05},
    ).block
    wrong = replace(OPENCV, parameters={**OPENCV.parameters, "cx": 5999.5, "cy": 5999.5})
    (told,) = [
        each for each in diagnose(truth.replace(cameras=[wrong])).findings if each.kind == "half-pixel"
    ]
    assert told.level == "look"
    assert told.values["cx_px"] == pytest.approx(0.5, abs=0.1)
    assert not [each for each in diagnose(truth).findings if each.kind == "half-pixel"]


def test_mistakes_of_observed_positions_are_put_right_for_what_follows():
    block = with_gnss(simulate(seed=3, **SIZE), sd=0.1).block
    wrong = [replaced(each, np.add(each.position, [0, 0, 46.2])) for each in block.observations]
    found = diagnose(block.replace(observations=wrong))
    assert kinds(found) == {"observed-positions"}
    # Its standard deviation is 0.27 m.
    sizes = [float(number) for number in re.findall(r"\d+\.\d+", found.grave[0].text)]
    assert any(size == pytest.approx(46.2, abs=0.5) for size in sizes)
    assert found.result.variance_of_unit_weight < 2
    wrong[4] = replaced(wrong[4], np.add(wrong[4].position, [0, 3.0, 0]))
    found = diagnose(block.replace(observations=wrong))
    assert kinds(found) == {"observed-positions", "observation-misfit"}
    assert found.grave[1].photos == [wrong[4].photo]


def replaced(position, coordinates):
    return Position(position.photo, coordinates, sd=0.1, lever_arm=position.lever_arm, time=position.time)


def test_weighted_stations_above_the_ellipsoid():
    block = simulate(seed=3, position_sd=0.1, **SIZE).block
    observed = np.add(block.photo_positions_observed, [0, 0, 40.0])
    assert kinds(diagnose(block.replace(photo_positions_observed=observed))) == {"observed-positions"}


def test_a_collection_is_checked():
    collection = simulate_collection(photos=8, points=120, seed=3).collection
    found = diagnose(collection)
    assert found.grave == []
    xy = collection.image_xy.copy()
    rays = np.bincount(collection.image_points)
    row = int(np.flatnonzero(rays[collection.image_points] >= 5)[20])
    xy[row, 0] += 50
    (finding,) = diagnose(collection.replace(image_xy=xy)).grave
    assert f"photo {collection.image_photos[row]}" in finding.photos
    assert finding.points == [f"point {collection.image_points[row]}"]


def test_the_block_of_a_collection_sees_what_it_sees():
    from photogram.collection.snooping import as_block

    collection = simulate_collection(photos=6, points=60, seed=4).collection
    adjusted = adjust(collection)
    result = diagnose(collection).result
    assert result.sums_of_squares.plates == pytest.approx(adjusted.weighted_sum_of_squares, rel=1e-6)
    assert len(as_block(collection).cameras) == len(collection.photo_parameters)
    assert isinstance(collection, Collection)


def test_a_project_is_checked_in_the_words_of_the_guide():
    block = simulate(seed=3, **SIZE).block
    found = diagnose(Project.from_block(block))
    assert found.sections[0].title == "Input"
    assert "FRAMES" in found.report()
    assert "FRAMES" not in diagnose(block).report()


def test_what_is_no_network_is_refused():
    with pytest.raises(InputError, match="a block, a project or a collection"):
        diagnose(3)


def test_one_adjustment_serves_for_several_questions(monkeypatch):
    from photogram.diagnosis import mistakes

    calls = []

    def counted(block, **options):
        calls.append(block)
        return adjust_block(block, **options)

    adjust_block = mistakes.adjust
    monkeypatch.setattr(mistakes, "adjust", counted)
    block = simulate(seed=3, **SIZE).block
    assert diagnose(block).grave == []
    # Another adjustment resects a few photos.
    assert [len(each.photo_ids) for each in calls].count(len(block.photo_ids)) == 1
    assert "photogram.diagnosis.mistakes" in sys.modules


def test_check_points_that_disagree_are_named():
    block = simulate(seed=3, **SIZE).block
    given = np.isfinite(block.point_positions).all(axis=1) & np.isinf(block.point_sd).all(axis=1)
    row = int(np.flatnonzero(given)[0])
    positions = block.point_positions.copy()
    positions[row, 2] += 50.0
    (found,) = diagnose(block.replace(point_positions=positions)).grave
    assert (found.kind, found.points) == ("check-points", [block.point_ids[row]])
    assert len(found.phrase.fields["points"]) == 1
