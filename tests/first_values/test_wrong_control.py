"""Control with a wrong coordinate, photos without poses: the wrong point is named, the others stay."""

import json

import networks
import numpy as np
import pytest

from photogram import adjust_started, diagnose, first_values, snoop

PLACES = np.array(
    [(0.15, 0.15), (0.85, 0.15), (0.15, 0.85), (0.85, 0.85), (0.5, 0.5), (0.3, 0.6), (0.7, 0.35)]
)


def flight(seed):
    """Return photos of a drone from 100 m, in two strips: positions, angles, points."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(32.0 * np.arange(5), 56.0 * np.arange(2))
    positions = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 100.0)])
    positions += rng.normal(0, 1.0, positions.shape)
    angles = rng.normal(0, 0.03, (x.size, 3))
    points = rng.uniform([-60, -60, 0], [190, 112, 15], (300, 3))
    return positions, angles, points


SCENES = {"flight": (flight, 0.02), "ring": (lambda seed: networks.ring(seed, photos=12), 0.001)}


def spoiled(scene, seed, size, axis, gross=6):
    """Return a block without poses, and which control point and images of other points are wrong."""
    rng = np.random.default_rng(seed)
    make, sd = SCENES[scene]
    positions, angles, points = make(seed)
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    apart = np.linalg.norm(points[:, np.newaxis, :2] - (low + PLACES * (high - low)), axis=2)
    control = np.argmin(apart, axis=0)
    block, _, _ = networks.network(positions, angles, points, seed=seed, control=control)
    coordinates, point_sd = block.point_positions.copy(), block.point_sd.copy()
    coordinates[control] += rng.normal(0, sd, (len(control), 3))
    point_sd[control] = sd
    wrong = int(rng.choice(control))
    coordinates[wrong, axis] += size
    rays = np.bincount(block.image_points, minlength=len(points))[block.image_points]
    rows = rng.choice(np.flatnonzero((rays > 4) & ~np.isin(block.image_points, control)), gross, False)
    xy = block.image_xy.copy()
    xy[rows] += rng.choice([-1, 1], (gross, 2)) * rng.uniform(0.1, 1.0, (gross, 2))
    changed = block.replace(point_positions=coordinates, point_sd=point_sd, image_xy=xy)
    return changed, block.point_ids[wrong], np.sort(rows)


CASES = [
    ("flight", 0, 1.0, 0),
    ("flight", 1, 0.5, 1),
    ("flight", 2, 1.0, 2),
    ("flight", 3, 0.5, 0),
    ("ring", 4, 0.05, 0),
    ("ring", 5, 0.5, 1),
    ("ring", 6, 0.05, 2),
]


@pytest.mark.parametrize(("scene", "seed", "size", "axis"), CASES)
def test_wrong_control_costs_no_image_of_control(scene, seed, size, axis):
    block, wrong, rows = spoiled(scene, seed, size, axis)
    started = first_values(block)
    assert not started.missing
    assert started.contradicted_control == (wrong,)
    np.testing.assert_array_equal(np.flatnonzero(started.set_aside), rows)
    result = adjust_started(started)
    assert (result.verdict.code, result.verdict.exit) == ("gross-errors", 4)
    assert f"1) control point {wrong} " in result.verdict.headline
    assert len(result.set_aside) == len(rows)
    removed = snoop(result.block).removed
    assert [each.name.split()[-1] for each in removed] == [wrong]


@pytest.mark.parametrize(("scene", "seed", "size", "axis"), [CASES[0], CASES[4]])
def test_the_check_names_it_first(scene, seed, size, axis):
    block, wrong, rows = spoiled(scene, seed, size, axis)
    found = diagnose(block)
    assert {tuple(each.points) for each in found.grave} == {(wrong,)}
    (aside,) = [each for section in found.sections for each in section.findings if each.kind == "set-aside"]
    assert set(aside.points) == {block.point_ids[point] for point in block.image_points[rows]}


@pytest.mark.parametrize("scene", SCENES)
def test_correct_control_is_not_contradicted(scene):
    block, _, _ = spoiled(scene, 8, 0.0, 0, gross=0)
    started = first_values(block)
    assert started.contradicted_control == ()
    assert not started.set_aside.any()
    assert adjust_started(started).verdict.exit == 0
    assert not diagnose(block).grave


def test_heights_alone_are_checked():
    block, wrong, rows = spoiled("flight", 9, 1.0, 2)
    point_sd = block.point_sd.copy()
    point_sd[block.point_ids.index(wrong), :2] = np.inf
    started = first_values(block.replace(point_sd=point_sd))
    assert started.contradicted_control == (wrong,)
    np.testing.assert_array_equal(np.flatnonzero(started.set_aside), rows)


def test_one_image_of_control_is_left_to_the_adjustment():
    block, wrong, _ = spoiled("flight", 0, 1.0, 0, gross=0)
    own = np.flatnonzero(block.image_points == block.point_ids.index(wrong))
    kept = np.setdiff1d(np.arange(len(block.image_xy)), own[1:])
    images = ("image_photos", "image_points", "image_xy", "image_sd")
    started = first_values(block.replace(**{name: getattr(block, name)[kept] for name in images}))
    assert not started.set_aside.any()
    verdict = adjust_started(started).verdict
    assert verdict.exit == 4
    assert wrong in verdict.headline


def test_control_without_an_image_that_fits_is_named():
    block, _, _ = spoiled("flight", 10, 0.0, 0, gross=0)
    control = int(np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[0])
    xy = block.image_xy.copy()
    own = np.flatnonzero(block.image_points == control)
    xy[own] += (
        np.random.default_rng(1).uniform(2, 8, (len(own), 2)) * ((-1.0) ** np.arange(len(own)))[:, None]
    )
    started = first_values(block.replace(image_xy=xy))
    assert started.set_aside[own].all() or block.point_ids[control] in started.contradicted_control
    assert block.point_ids[control] in " ".join(each.text for each in started.messages)


PIXEL = 0.005
SIDE = 16000


def tables(block, folder):
    """Write a block as a plain project in pixels, without poses."""
    photos, points = np.array(block.photo_ids), np.array(block.point_ids)
    pixels = SIDE / 2 + block.image_xy / PIXEL * [1, -1]
    rows = zip(photos[block.image_photos], points[block.image_points], pixels.tolist(), strict=True)
    control = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    files = {
        "cameras": [
            "camera,model,width,height,f,cx,cy,k",
            f"lens,simple_radial,{SIDE},{SIDE},{-networks.C / PIXEL},{SIDE / 2},{SIDE / 2},0",
        ],
        "photos": ["photo,camera", *(f"{photo},lens" for photo in photos)],
        "images": ["photo,point,column,row", *(f"{photo},{point},{x},{y}" for photo, point, (x, y) in rows)],
        "control": [
            "point,x,y,z",
            *(",".join([points[row], *map(str, block.point_positions[row])]) for row in control),
        ],
    }
    folder.mkdir()
    for name, lines in files.items():
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (folder / "project.toml").write_text(
        f"[project]\nformat = 1\n[sd]\nimages = {networks.SD / PIXEL}\ncontrol = [0.02, 0.02, 0.02]\n"
        '[adjust]\nunit_variance = "unity"\n'
    )
    return folder


@pytest.mark.parametrize("options", [[], ["--snoop"], ["--keep-all", "--snoop"]])
def test_the_command_names_it(run, tmp_path, options):
    block, wrong, rows = spoiled("flight", 1, 1.0, 1, gross=3)
    project = tables(block, tmp_path / "project")
    document = tmp_path / "result.json"
    done = run("adjust", project, "--json", document, "--no-html", "--out", tmp_path / "out", *options)
    verdict = json.loads(document.read_text())["verdict"]
    if not options:
        assert done.exit_code == 4
        assert f"1) control point {wrong} " in verdict["headline"]
        return
    assert done.exit_code == 0
    said = " ".join([verdict["headline"], *verdict["lines"]])
    photos, points = block.image_photos[rows].tolist(), block.image_points[rows].tolist()
    images = {
        f"image of point {block.point_ids[point]} on photo {block.photo_ids[photo]}"
        for photo, point in zip(photos, points, strict=True)
    }
    out = {each["name"] for each in verdict["removed"]} | {each for each in images if each in said}
    assert out == images | {f"X, Y of control point {wrong}"}
