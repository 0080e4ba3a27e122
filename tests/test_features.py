"""Features through adjusted points: in Python, in projects, in results and on the command line."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from message_codes import rejected
from photogram import InnerConstraints, Spheroid, adjust, features, formats, read_result, simulate
from photogram.results.features import named_points, with_features


@pytest.fixture(scope="module")
def free():
    """Return a free network whose scale nothing gives."""
    block = simulate(strips=2, photos_per_strip=3, control="none", check_points=0, seed=8).block
    return adjust(block.replace(photo_position_sd=np.inf, photo_attitude_sd=np.inf), datum=InnerConstraints())


@pytest.fixture(scope="module")
def result():
    """Return a block with control."""
    return adjust(simulate(strips=2, photos_per_strip=3, control="corners", check_points=5, seed=3).block)


@pytest.fixture(scope="module")
def names(result):
    """Return the points of the block with most rays."""
    order = np.argsort(-result.point_rays, kind="stable")
    return [result.block.point_ids[row] for row in order[:8]]


def plane(points):
    """Return the foot of the mean, the normal and the flatness, the way one writes it down."""
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre)[2][2]
    normal = normal * np.sign(normal[np.abs(normal).argmax()])
    return np.array([*centre, *normal, np.ptp((points - centre) @ normal)])


def test_a_plane_is_what_propagation_of_its_function_gives(result, names):
    found = features(result, {"ground": ("plane", names)})["ground"]
    own = result.propagate(plane, ("point", names))
    assert found.points == tuple(names)
    assert [each.name for each in found.quantities][-1] == "flatness"
    np.testing.assert_allclose([each.value for each in found.quantities], own.value, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        [each.sd for each in found.quantities], own.standard_deviation, rtol=1e-4, atol=1e-12
    )
    scale = np.outer(own.standard_deviation, own.standard_deviation)
    np.testing.assert_allclose(found.covariance / scale, own.covariance / scale, atol=1e-4)
    assert found["flatness"].expanded == 2.0 * found["flatness"].sd
    assert np.ptp(found.deviations) == pytest.approx(found["flatness"].value, rel=1e-12)


def test_a_distance_is_what_propagation_gives(result, names):
    found = features(result, {"d": ("distance", names[:2])})["d"]["distance"]
    own = result.propagate(lambda p: np.sqrt(((p[1] - p[0]) ** 2).sum()), ("point", names[:2]))
    assert (found.value, found.sd) == pytest.approx((own.value, own.standard_deviation), rel=1e-9)
    assert found.unit == "m"


def test_k_is_given_or_follows_from_a_probability(result, names):
    wanted = {"d": ("distance", names[:2])}
    assert features(result, wanted, k=3.0)["d"]["distance"].expanded == pytest.approx(
        3.0 * features(result, wanted)["d"]["distance"].sd
    )
    # t of a known number of degrees of freedom, and of infinitely many where the unit weight is known.
    few = replace(result, degrees_of_freedom=10)
    assert features(few, wanted, coverage=0.95).k == pytest.approx(2.228139, abs=1e-6)
    known = replace(result, unit_variance="unity")
    assert features(known, wanted, coverage=0.95).k == pytest.approx(1.959964, abs=1e-6)
    for wrong in (0.0, 1.0, np.nan):
        with rejected("coverage"):
            features(result, wanted, coverage=wrong)
    with rejected("error.positive"):
        features(result, wanted, k=-2.0)


def test_ground_is_no_plane_and_the_test_says_so(result, names):
    rough = features(result, {"ground": ("plane", names)})["ground"]
    assert rough.freedom == len(names) - 3
    assert rough.probability < 1e-6
    assert "more than standard deviations of points explain" in rough.form


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        (("circle", ["nowhere", "a", "b"]), "error.unknown point nowhere"),
        (("cone", ["*"]), "error.unknown.close"),
        ("plane", "fit.definition plane"),
        (("distance", 3), "fit.two-points 3"),
        (("cylinder", 5), "a cylinder takes 6 points, not 5"),
    ],
)
def test_what_cannot_be_is_named(result, names, wanted, message):
    if isinstance(wanted[1], int):
        wanted = wanted[0], names[: wanted[1]]
    with rejected(message):
        features(result, {"f": wanted})


def test_points_that_took_no_part_are_named(result, names):
    rays = np.array(result.point_rays)
    rays[result.block.point_ids.index(names[1])] = 0
    with rejected(f"adjusted.unused-point {names[1]}"):
        features(replace(result, point_rays=rays), {"f": ("plane", names)})


def test_geographic_blocks_are_refused(result, names):
    block = simulate(strips=2, photos_per_strip=2, spheroid=Spheroid.wgs84(), control="corners", seed=3).block
    with rejected("fit.geographic"):
        features(adjust(block), {"d": ("distance", block.point_ids[:2])})


def test_a_scale_that_nothing_gives_is_said(free):
    wanted = {"d": ("distance", free.block.point_ids[:2])}
    assert "do not determine the scale" in features(free, wanted).remarks[0]
    told = with_features(free, wanted)
    assert any("do not determine the scale" in str(each) for each in told.messages)
    assert "do not determine the scale" in told.report()
    minimum = adjust(free.block)
    assert features(minimum, wanted).remarks


def test_a_scale_that_is_observed_needs_no_remark(result, names):
    assert features(result, {"d": ("distance", names[:2])}).remarks == ()


def test_a_feature_that_fails_is_told_and_the_others_stand(result, names):
    told = with_features(result, {"bad": ("plane", names[:2]), "good": ("plane", names)})
    assert [each.name for each in told.features] == ["good"]
    assert any("feature bad: a plane takes 3 points, not 2" in str(each) for each in told.messages)
    assert "feature bad" in told.report()


def test_reports_tables_and_saved_results_have_them(result, names, tmp_path):
    told = with_features(result, {"ground": ("plane", names), "d": ("distance", names[:2])})
    flatness = told.features["ground"]["flatness"]
    assert "plane through 8 points" in told.report()
    assert "Quantities of features" in told.to_html().decode()
    member = json.loads(told.to_json())["features"]["features"][0]
    assert member["quantities"][-1]["value"] == flatness.value
    assert [each["point"] for each in member["deviations"]] == names
    assert len(told.features.table()) == 8
    assert len(told.features.deviation_table()) == 8
    told.to_parquet(tmp_path / "kept")
    again = read_result(tmp_path / "kept")
    assert again.features["ground"]["flatness"] == flatness
    np.testing.assert_array_equal(again.features["ground"].deviations, told.features["ground"].deviations)
    table = pd.read_parquet(tmp_path / "kept" / "features.parquet")
    assert table.loc[table["quantity"] == "flatness", "expanded"].tolist() == [flatness.expanded]
    # In another datum they would be others.
    assert told.relative_to(points=names[:3]).features is None


def test_deviations_are_drawn(result, names):
    told = with_features(result, {"ground": ("plane", names), "d": ("distance", names[:2])})
    axes = Figure().subplots()
    told.plot.features().on(axes)
    assert axes.get_title(loc="left") == "ground: plane through 8 points"
    (marks,) = [each for each in axes.collections if isinstance(each, PathCollection)]
    drawn = marks.get_offsets()[:, 1]
    np.testing.assert_allclose(drawn, told.features["ground"].deviations[:, 0])
    with rejected("plot.features"):
        result.plot.features()


def test_patterns_name_points_in_the_order_in_which_they_are_asked_for():
    points = ["b-1", "b-2", "a", "c*"]
    assert named_points(["a", "b-*", "b-1"], points) == ["a", "b-1", "b-2"]
    assert named_points(["c*"], points) == ["c*"]
    with rejected("error.absent"):
        named_points(["d*"], points)


def test_a_project_declares_them(run, tmp_path):
    assert run("new", "part", "--kind", "metrology").exit_code == 0
    settings = tmp_path / "part" / "project.toml"
    text = settings.read_text()
    done = run("adjust", "part", "--no-html", "--parquet", "kept")
    assert done.exit_code == 0, done.output
    table = pd.read_csv(tmp_path / "part-adjusted" / "features.csv", comment="#")
    diameter = table[(table["feature"] == "bore") & (table["quantity"] == "diameter")].iloc[0]
    # examples/make_targets.py has the truth.
    assert abs(diameter["value"] - 0.40006) < diameter["expanded"] == 2.0 * diameter["sd"] < 2e-5
    adjusted = formats.read(tmp_path / "part-adjusted" / "adjusted")
    assert adjusted.features == formats.read(tmp_path / "part").features == {"bore": ("circle", ("hole-*",))}
    assert any("1 feature" in each for each in formats.cannot_hold(adjusted, "bal"))

    shown = run("features", "kept", "--json", "all.json", "--out", "tables")
    assert shown.exit_code == 0, shown.output
    member = json.loads((tmp_path / "all.json").read_text())["features"][0]
    assert member["quantities"][0]["value"] == diameter["value"]
    deviations = pd.read_csv(tmp_path / "tables" / "feature_deviations.csv")
    assert deviations["direction"].value_counts().to_dict() == {"outward": 8, "axial": 8}
    others = run(
        "features", "kept", "--plane", "top=hole-1,hole-3,hole-5,hole-7", "--line", "l=c01,c02", "-k", "3"
    )
    assert "plane through 4 points" in others.stdout
    assert "bore" not in others.stdout
    assert "k = 3" in others.stdout
    again = run("features", "part-adjusted/adjusted", "--circle", "again=hole-*")
    assert f"{diameter['value']:.7f}" in again.stdout

    for line, message in (
        ('bore = { circle = ["nobody-*"] }', "[features] bore: the point 'nobody-*' is unknown"),
        (
            'bore = { circel = ["hole-1"] }',
            "the kind of features 'circel' is unknown; use an existing name, such as the nearest, 'circle'",
        ),
        ('bore = "hole-1"', "[features] bore: must have the form"),
        ("bore = { circle = 3 }", "[features.bore] circle: must be a list"),
    ):
        settings.write_text(text.replace('bore = { circle = ["hole-*"] }', line))
        refused = run("info", "part")
        assert refused.exit_code == 1
        assert message in refused.stderr
        assert "project.toml" in refused.stderr


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ((), 2, "must contain features"),
        (("--circle", "bore"), 2, "must be NAME=POINT"),
        (("--circle", "a=1,2,3", "--plane", "a=1,2,3"), 2, "two have the name 'a'"),
        (("--circle", "a=x,y,z"), 1, "feature a: the point 'x' is unknown"),
    ],
)
def test_the_command_refuses(run, options, code, message):
    assert run("new", "own").exit_code == 0
    refused = run("features", "own", *options)
    assert refused.exit_code == code
    assert message in refused.stderr


def test_new_names_of_points_are_names_in_features(run, tmp_path):
    assert run("new", "part", "--kind", "metrology").exit_code == 0
    project = formats.read(tmp_path / "part").replace(features={"d": ("distance", ["c01", "c02"])})
    (tmp_path / "names.csv").write_text("point,name\nc01,corner\n")
    from photogram.formats.names import with_names

    assert with_names(project, tmp_path / "names.csv").features == {"d": ("distance", ["corner", "c02"])}
