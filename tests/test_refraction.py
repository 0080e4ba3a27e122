"""Refraction: figures of the guide, rays traced layer by layer, blocks that need it, files and options."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from example_scripts import load
from message_codes import raises
from photogram import Block, InputError, Refraction, Simulation, Spheroid, adjust, network, simulate
from photogram.giant import Common, Project, read_project, write_project
from photogram.giant.assembly import job_refraction

ROOT = Path(__file__).parents[1]
GOLDEN = json.loads((ROOT / "tests" / "data" / "giant" / "golden_cases.json").read_text())
GEOGRAPHIC: dict[str, Any] = {"spheroid": Spheroid.wgs84(), "origin": (0.135, 0.848, 140.0)}
RECTANGULAR: dict[str, Any] = {"origin": (1000.0, 2000.0, 140.0)}
SPACES = pytest.mark.parametrize("space", [RECTANGULAR, GEOGRAPHIC], ids=["rectangular", "geographic"])
LEVEL = 140.0
AIRS = ("giant", "standard")
WATERS = ("giant", "snell")


def lift(refraction: Refraction, camera: float, across: float, point: float, **options: Any) -> float:
    """Return the lift of a point in rectangular space."""
    shift = network.refraction_shift([[across, 0.0, point]], [[0.0, 0.0, camera]], refraction, **options)
    assert shift[0, :2].tolist() == [0.0, 0.0]
    return float(shift[0, 2])


def microradians(air: Any, camera: float, point: float) -> float:
    return 1e6 * lift(Refraction(air), camera, 0.0, point) / (camera - point)


# The models


@pytest.mark.giant("12", "air: K_a, 47.97 microradians at 4.5 km")
@pytest.mark.giant("12", "correction of the height by (K_a + K_w)(dX^2 + dY^2 + dZ0^2)/dZ0")
def test_section_12_air_refraction_gives_the_figures_of_the_example():
    air = GOLDEN["refraction_examples"]["air"]
    camera, point = 1e3 * air["H_km"], 1e3 * air["h_km"]
    assert microradians("giant", camera, point) == pytest.approx(air["K_urad"], abs=0.005)
    assert lift(Refraction("giant"), camera, 0.0, point) == pytest.approx(air["dZ_at_nadir_m"], abs=5e-7)
    across = camera - point
    assert lift(Refraction("giant"), camera, across, point) == pytest.approx(air["dZ_at_45deg_m"], abs=5e-6)


@pytest.mark.giant("12", "correction of the height by (K_a + K_w)(dX^2 + dY^2 + dZ0^2)/dZ0")
@pytest.mark.giant("12", "water: K_w for points below the water level")
def test_section_12_constants_of_air_and_water_add():
    both = lift(Refraction("giant", "giant", 2.0), 900.0, 700.0, -8.0)
    parts = (
        lift(Refraction("giant"), 900.0, 700.0, -8.0),
        lift(Refraction(None, "giant", 2.0), 900.0, 700.0, -8.0),
    )
    assert both == pytest.approx(sum(parts), rel=1e-14)
    assert lift(Refraction("giant", "giant", 2.0), 900.0, 700.0, 3.0) == lift(
        Refraction("giant"), 900.0, 700.0, 3.0
    )


@pytest.mark.giant("12", "water: K_w for points below the water level")
@pytest.mark.giant("12", "water: rigorous two-media ray")
@pytest.mark.parametrize(("camera", "across", "depth"), [(50.0, 40.0, 3.0), (1500.0, 1e3, 20.0)])
def test_section_12_water_refraction_against_the_exact_lift(camera, across, depth):
    exact = lift(Refraction(None, "snell", 7.0, 1.33), 7.0 + camera, across, 7.0 - depth)
    report = lift(Refraction(None, "giant", 7.0, 1.33), 7.0 + camera, across, 7.0 - depth)
    apparent = depth - exact
    assert report / exact == pytest.approx(1 + exact / (camera + apparent), rel=1e-12)
    # The apparent depth is that of the guide, d tan r / tan i with sin i = n sin r.
    i = math.atan(across / (camera + apparent))
    assert apparent == pytest.approx(depth * math.tan(math.asin(math.sin(i) / 1.33)) / math.tan(i), rel=1e-12)


def test_the_models_of_the_air_agree_up_to_9_km():
    heights = [(h, g) for h in np.arange(100, 9001, 100) for g in np.arange(-100, min(h - 50, 4000), 50)]
    camera, point = np.array(heights, dtype=float).T
    zero = np.zeros_like(camera)
    giant, standard = (
        1e6
        * network.refraction_shift(
            np.column_stack([zero, zero, point]), np.column_stack([zero, zero, camera]), Refraction(air)
        )[:, 2]
        / (camera - point)
        for air in AIRS
    )
    assert np.abs(giant - standard).max() < 0.7  # microradians: a tenth of a micrometre in a photograph
    assert microradians("standard", 11_000, 0) - microradians("giant", 11_000, 0) > 2


@pytest.mark.parametrize("camera", [4500.0, 9000.0, 10_900.0])
@pytest.mark.parametrize("angle", [0.3, 0.8])
def test_the_standard_model_is_the_ray_through_thin_layers(camera, angle):
    # Standard atmosphere below 11 km, in layers of 0.1 m: n sin(angle from the vertical) is constant.
    z = np.arange(0.05, camera, 0.1)
    n = 1 + 277e-6 * (1 - 0.0065 * z / 288.15) ** 4.255876
    at_camera = 1 + 277e-6 * (1 - 0.0065 * camera / 288.15) ** 4.255876
    across = float((0.1 * np.tan(np.arcsin(at_camera * math.sin(angle) / n))).sum())
    seen = math.atan(across / (camera - lift(Refraction("standard"), camera, across, 0.0)))
    straight = math.atan(across / camera)
    assert (angle - straight) == pytest.approx(seen - straight, rel=1e-3)


@pytest.mark.giant("12", "water: rigorous two-media ray")
def test_section_12_rays_through_water_obey_snell():
    camera, across, depth, index = 120.0, 150.0, 6.0, 1.34
    seen = depth - lift(Refraction(None, "snell", 0.0, index), camera, across, -depth)
    surface = across * camera / (camera + seen)
    sin_i, sin_r = (
        surface / math.hypot(surface, camera),
        (across - surface) / math.hypot(across - surface, depth),
    )
    assert sin_i == pytest.approx(index * sin_r, rel=1e-12)
    # Fermat: no neighbouring way is optically shorter.
    places = surface + np.linspace(-1, 1, 2001)
    ways = np.hypot(places, camera) + index * np.hypot(across - places, depth)
    assert abs(places[ways.argmin()] - surface) < 1.1e-3


@pytest.mark.giant("14", "18 heights of the refraction model in metres, also in feet jobs")
def test_section_14_feet_are_converted():
    for refraction in (Refraction("giant", "giant", 10.0), Refraction("standard", "snell", 10.0)):
        metres = lift(refraction, 3000.0, 2000.0, 4.0)
        in_feet = Refraction(refraction.air, refraction.water, 10.0 / 0.3048)
        feet = lift(in_feet, 3000 / 0.3048, 2000 / 0.3048, 4.0 / 0.3048, linear_unit="ft")
        assert 0.3048 * feet == pytest.approx(metres, rel=1e-12)
    with pytest.raises(InputError, match="'yd'"):
        lift(Refraction("giant"), 3000.0, 0.0, 0.0, linear_unit="yd")


@SPACES
def test_a_point_projects_where_its_lift_puts_it(space):
    refraction = Refraction("standard", "snell", LEVEL)
    truth = simulate(strips=1, photos_per_strip=3, refraction=refraction, **space).truth
    points, photos = truth.point_positions[truth.image_points], truth.photo_positions[truth.image_photos]
    spheroid = truth.spheroid
    shift = network.refraction_shift(points, photos, refraction, spheroid=spheroid)
    if spheroid is None:
        lifted = points + shift
    else:
        xyz = network.geographic_to_geocentric(points, spheroid) + shift
        lifted = network.geocentric_to_geographic(xyz, spheroid)
    straight = network.project(
        lifted,
        photos,
        truth.photo_attitudes[truth.image_photos],
        truth.principal_distances[truth.image_photos],
        spheroid=spheroid,
    )
    np.testing.assert_allclose(straight, truth.image_xy, rtol=0, atol=1e-9)
    wet = points[:, 2] < LEVEL - 1
    assert wet.any()
    assert (lifted[wet, 2] - points[wet, 2] > 0.25 * (LEVEL - points[wet, 2])).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"air": "thin"},
        {"water": "standard"},
        {"water_level": math.nan},
        {"refractive_index": 0.9},
        {"refractive_index": math.inf},
    ],
)
def test_wrong_refraction_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        Refraction(**wrong)


# Blocks


def simulated(refraction: Refraction | None, space: dict[str, Any], **options: Any) -> Simulation:
    arguments = {
        "strips": 3,
        "photos_per_strip": 6,
        "points_per_photo": 60,
        "flying_height": 1500.0,
        "relief": 30.0,
        "control_sd": 0.02,
        "seed": 5,
    }
    return simulate(refraction=refraction, **{**arguments, **options}, **space)


@pytest.mark.giant("12", "applied in every iteration, for every point")
@SPACES
@pytest.mark.parametrize(
    ("refraction", "delay"),
    [
        (Refraction("giant"), 1),
        (Refraction("giant", "giant", LEVEL + 40), 1),
        (Refraction("standard", "snell", LEVEL + 40), 1),
        (Refraction("standard", "snell", LEVEL), 5),
    ],
    ids=["air", "giant, all in water", "rigorous, all in water", "rigorous, with a shore"],
)
def test_section_12_a_block_is_recovered_as_fast_as_without_refraction(space, refraction, delay):
    plain = adjust(simulated(None, space).block)
    simulation = simulated(refraction, space)
    result = adjust(simulation.block)
    assert result.converged
    assert abs(len(result.iterations) - len(plain.iterations)) <= delay
    assert result.variance_of_unit_weight == pytest.approx(1, abs=0.05)
    error = (result.point_positions - simulation.truth.point_positions) / result.point_sd
    assert np.sqrt((error**2).mean()) == pytest.approx(1, abs=0.3)
    error = (result.photo_positions - simulation.truth.photo_positions) / result.photo_sd[:, :3]
    assert np.sqrt((error**2).mean()) == pytest.approx(1, abs=0.3)


@pytest.mark.giant("12", "applied in every iteration, for every point")
@SPACES
@pytest.mark.parametrize("air", AIRS)
@pytest.mark.parametrize("water", WATERS)
def test_section_12_without_refraction_heights_are_wrong_by_the_lift(space, air, water):
    refraction = Refraction(air, water, LEVEL)
    truth = simulated(refraction, space).truth
    fixed = truth.replace(
        point_sd=np.array(np.inf), point_positions=np.full_like(truth.point_positions, np.nan)
    )
    fixed = fixed.with_fixed_photos()
    right = adjust(fixed, unit_variance="unity").point_positions
    np.testing.assert_allclose(right[:, 2], truth.point_positions[:, 2], rtol=0, atol=1e-6)
    error = adjust(fixed.replace(refraction=None), unit_variance="unity").point_positions[:, 2] - right[:, 2]

    points, photos = truth.image_points, truth.image_photos
    shift = network.refraction_shift(
        truth.point_positions[points], truth.photo_positions[photos], refraction, spheroid=truth.spheroid
    )
    length = np.linalg.norm(shift, axis=1)
    lowest, highest = np.full((2, len(truth.point_ids)), [[np.inf], [-np.inf]])
    np.minimum.at(lowest, points, length)
    np.maximum.at(highest, points, length)
    # Rays that are lifted by different amounts meet nowhere: the height is between theirs or hardly beside.
    slack = 0.1 * (highest - lowest) + 1e-4
    assert (error > lowest - slack).all()
    assert (error < highest + slack).all()
    deepest = truth.point_positions[:, 2].argmin()
    assert error[deepest] > 0.25 * (LEVEL - truth.point_positions[deepest, 2]) > 3


@SPACES
def test_a_block_with_water_is_biased_without_refraction(space):
    simulation = simulated(Refraction("standard", "snell", LEVEL), space)
    result = adjust(simulation.block.replace(refraction=None))
    error = (result.point_positions - simulation.truth.point_positions) / result.point_sd
    assert np.sqrt((error[:, 2] ** 2).mean()) > 3


@SPACES
@pytest.mark.parametrize("water", WATERS)
def test_a_shore_converges(space, water):
    """Half of all points stand within decimetres of the water level, where refraction sets in."""
    simulation = simulated(Refraction("standard", water, LEVEL), space, relief=0.5)
    result = adjust(simulation.block)
    assert result.converged
    assert len(result.iterations) <= 20
    error = (result.point_positions - simulation.truth.point_positions) / result.point_sd
    assert np.sqrt((error**2).mean()) == pytest.approx(1, abs=0.3)


def test_results_do_not_depend_on_the_origin_of_rectangular_space():
    """Coordinates are counted from an origin amid the photos while they are adjusted; heights are not."""
    refraction = Refraction("standard", "snell", 140.0)
    near = adjust(simulated(refraction, {"origin": (0.0, 0.0, 140.0)}).block)
    far = adjust(simulated(refraction, {"origin": (5e5, 5e6, 140.0)}).block)
    heights = near.point_positions[:, 2], far.point_positions[:, 2]
    np.testing.assert_allclose(*heights, rtol=0, atol=1e-5)


@pytest.fixture(scope="module")
def dry() -> Block:
    space = GEOGRAPHIC | {"spheroid": Spheroid.clarke_1866()}
    return simulated(None, space, strips=1, photos_per_strip=3).block


def test_photos_must_be_above_the_water(dry):
    level = float(np.sort(dry.photo_positions[:, 2])[1])
    dry.photo_ids[int(np.flatnonzero(dry.photo_positions[:, 2] <= level)[0])]
    with raises(InputError, "adjust.below-water"):
        adjust(dry.replace(refraction=Refraction(water="snell", water_level=level)))
    adjust(dry.replace(refraction=Refraction("giant", water_level=level)))


def test_a_linear_unit_must_have_a_length(dry):
    with pytest.raises(InputError, match="'chain'"):
        dry.replace(refraction=Refraction("giant"), linear_unit="chain")
    dry.replace(linear_unit="chain")


@pytest.mark.giant("12", "air: warning above 9 km")
def test_section_12_cameras_above_9000_m_are_named():
    block = simulated(
        Refraction("giant"), GEOGRAPHIC, flying_height=9200.0, photos_per_strip=2, strips=1
    ).block
    (high,) = [each for each in adjust(block).messages if each.code == "adjust.refraction.giant"]
    assert high.phrase.fields == {"limit": 9000.0, "photos": ["0101", "0102"]}
    standard = adjust(block.replace(refraction=Refraction("standard")))
    assert not any(message.code == "adjust.refraction.giant" for message in standard.messages)


def test_rectangular_space_is_remarked_on():
    block = simulated(Refraction("giant"), RECTANGULAR, photos_per_strip=3, strips=1).block
    assert any("Z as the height" in message.text for message in adjust(block).messages)
    none = adjust(block.replace(refraction=Refraction()))
    assert not any("refraction" in message.text for message in none.messages)


def test_report_and_document_name_the_model(dry):
    result = adjust(dry.replace(refraction=Refraction("standard", "snell", 12.5, 1.333)))
    assert "standard atmosphere; water below 12.500 m: Snell's law, index 1.333" in result.report()
    assert json.loads(result.to_json())["refraction"] == {
        "air": "standard",
        "water": "snell",
        "water_level": 12.5,
        "refractive_index": 1.333,
    }
    plain = adjust(dry)
    assert "refraction                          none" in plain.report()
    assert json.loads(plain.to_json())["refraction"] is None


# GIANT files and the command line


@pytest.mark.giant("2.2", "column 16: air refraction")
@pytest.mark.giant("2.2", "column 17: water refraction")
@pytest.mark.giant("2.2", "columns 31-40: water level")
@pytest.mark.parametrize(
    ("switches", "expected"),
    [
        ((False, False), None),
        ((True, False), Refraction("giant")),
        ((False, True), Refraction(None, "giant", 5.5)),
        ((True, True), Refraction("giant", "giant", 5.5)),
    ],
)
def test_section_2_2_switches_of_common(switches, expected):
    common = Common(air_refraction=switches[0], water_refraction=switches[1], water_level=5.5)
    assert job_refraction(common) == expected


@pytest.mark.giant("14", "18 heights of the refraction model in metres, also in feet jobs")
@pytest.mark.giant("2.2", "columns 31-40: water level")
def test_section_14_the_water_level_of_jobs_in_feet_is_in_metres():
    feet = {"semi_major": 20925832.16, "semi_minor": 20854892.02, "geographic": True}
    refraction = job_refraction(Common(water_refraction=True, water_level=3.048, **feet))
    assert refraction is not None
    assert refraction.water_level == pytest.approx(10.0)
    assert refraction.refractive_index == 1.340


@pytest.mark.giant("2.2", "column 16: air refraction")
@pytest.mark.giant("2.2", "column 17: water refraction")
@pytest.mark.giant("2.2", "columns 31-40: water level")
@pytest.mark.parametrize("refraction", [None, Refraction("giant"), Refraction("giant", "giant", 12.345)])
def test_section_2_2_refraction_comes_back_from_files(dry, tmp_path, refraction):
    project = Project.from_block(
        dry.replace(refraction=refraction), Common(air_refraction=True, water_level=3.0)
    )
    assert project.messages == []
    write_project(project, tmp_path / "block")
    again = read_project(tmp_path / "block")
    assert again.to_block().refraction == refraction
    assert again.common.water_level == (12.345 if refraction and refraction.water else 3.0)


def test_what_files_cannot_say_is_remarked_on(dry):
    for refraction in (
        Refraction("standard"),
        Refraction(water="snell"),
        Refraction(water="giant", refractive_index=1.3),
    ):
        (message,) = Project.from_block(dry.replace(refraction=refraction)).messages
        assert message.code == "giant.refraction"
    block = simulated(Refraction("giant"), RECTANGULAR, strips=1, photos_per_strip=3).block
    (message,) = Project.from_block(block.replace(linear_unit="ft")).messages
    assert message.code == "giant.refraction-unit"


SMALL = ["--strips", "1", "--photos-per-strip", "4", "--points-per-photo", "30", "--spheroid", "wgs84"]


@pytest.mark.giant("14", "1 columns 16 and 17: 1 applies refraction")
@pytest.mark.giant("14", "17 refractive index of water: parameter")
def test_section_14_the_command_line_applies_what_common_and_options_say(run):
    made = run("simulate", "block", *SMALL, "--air-refraction", "giant", "--water-refraction", "giant")
    assert made.exit_code == 0, made.output
    common = read_project("block").common
    assert (common.air_refraction, common.water_refraction, common.water_level) == (True, True, 0.0)

    def refraction(*options: str) -> dict[str, Any]:
        result = run("giant", "block", "--json", "result.json", *options)
        assert result.exit_code == 0, result.output
        document = json.loads(Path("result.json").read_bytes())
        assert document["variance_of_unit_weight"] == pytest.approx(1, abs=0.3)
        return document["refraction"]

    asked = {"air": "giant", "water": "giant", "water_level": 0.0, "refractive_index": 1.34}
    assert refraction() == asked
    assert refraction("--water-refraction", "snell") == asked | {"water": "snell"}
    options = ("--air-refraction", "standard", "--water-index", "1.341")
    assert refraction(*options) == asked | {"air": "standard", "refractive_index": 1.341}
    # The guide's own record asks for both, and its listing says that neither is included.
    assert job_refraction(common, water=None) == Refraction("giant")
    none = ("--air-refraction", "none", "--water-refraction", "none")
    straight = run("giant", "block", "--json", "result.json", *none)  # rays that were bent do not meet
    assert "--air-refraction for another model" in " ".join(straight.output.split())
    assert "is applied" not in " ".join(straight.output.split())
    assert json.loads(Path("result.json").read_bytes())["refraction"] is None


def test_options_apply_refraction_that_common_does_not_ask_for(run):
    assert run("simulate", "block", *SMALL).exit_code == 0
    assert run("giant", "block", "--air-refraction", "standard", "--json", "r.json").exit_code == 0
    assert json.loads(Path("r.json").read_bytes())["refraction"]["air"] == "standard"
    refused = run("giant", "block", "--water-index", "1.33")
    assert refused.exit_code == 2
    assert "requires --water-refraction" in refused.output


# The documentation


@pytest.fixture(scope="module")
def tables() -> ModuleType:
    return load("refraction_tables")


def test_the_tables_of_the_documentation_are_those_of_the_script(tables):
    page = (ROOT / "docs" / "refraction.md").read_text(encoding="utf-8")
    for table in (tables.air_table(), tables.water_table()):
        assert "\n".join(table) in page
