"""Views of a board that are planned before there is a picture: what they promise is what they give."""

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import refusal
from photogram.cli import app
from photogram.targets import Board, nominal_camera, plan_views, simulate_corners, uncertainty_map

SIZE = (800, 600)
BOARD = Board(columns=6, rows=5, spacing=0.03, shape="held")


@pytest.fixture(scope="module")
def plan():
    return plan_views(nominal_camera(SIZE, field=60), BOARD, SIZE, [math.inf, 0.7], sd0=0.2, views=6)


def test_each_view_has_a_name_and_makes_the_map_better(plan):
    assert len(plan.views) == 6
    assert [math.isnan(each.largest) for each in plan.views] == [True] * 3 + [False] * 3
    largest = [each.largest for each in plan.views[3:]]
    assert largest == sorted(largest, reverse=True)
    assert largest[-1] < 0.1 * largest[0]
    assert plan.sentences[0].startswith("middle of the picture, ")
    assert plan.sentences[0].endswith(" m, tilted 30 degrees about x")
    assert " -> " in plan.sentences[-1]
    table = plan.document().table("views").frame()
    assert table["largest_px"].iloc[-1] == plan.largest
    assert list(table["corners"]) == [30] * 6
    assert plan.largest == pytest.approx(
        np.nanmax(uncertainty_map(plan.calibrated, grid=(12, 8)).sd), rel=1e-12
    )


def test_what_is_promised_is_what_corners_with_errors_give(plan):
    """Quadratic forms of the errors of nine parameters, by the cofactors of the plan, over 12 draws."""
    forms = []
    free = plan.calibrated.cameras[0].estimated
    _, q = plan.calibrated.cofactors(("cameras",))
    assert len(free) == 9
    inverse = np.linalg.inv(q[np.ix_(free, free)])
    truth = plan.calibrated.calibration.cameras[0].values
    for seed in range(12):
        found = simulate_corners(plan.calibrated.calibration, seed).adjust()
        error = (found.cameras[0].values - truth)[free]
        forms.append(error @ inverse @ error)
    # A mean of chi2 of 108 degrees of freedom over 12.
    assert np.mean(forms) / 9 == pytest.approx(1, abs=3.5 * math.sqrt(2 / 108))
    scale = math.sqrt(found.covariance_scale)
    same = uncertainty_map(found, 0, 0.7).largest / scale
    assert plan.maps[1].largest == pytest.approx(same, rel=0.05)


def test_what_a_data_sheet_says_does_not_matter(plan):
    """Without the weak priors of the nominal camera the map is the same."""
    own = plan.calibrated.calibration
    free = [
        own.cameras[0].replace(
            sd=dict.fromkeys(("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"), math.inf)
        )
    ]
    drawn = simulate_corners(own.replace(cameras=free), 1).adjust()
    sd = drawn.cameras[0].sd / math.sqrt(drawn.covariance_scale)
    assert sd[:9] == pytest.approx(plan.calibrated.cameras[0].sd[:9], rel=0.03)


def test_boards_that_are_found_as_a_whole_are_shown_so():
    camera = nominal_camera(SIZE, field=60)
    whole = plan_views(camera, BOARD, SIZE, views=6)
    assert [each.corners for each in whole.views] == [30] * 6
    tags = Board(kind="charuco", columns=6, rows=5, spacing=0.03, shape="held")
    assert min(each.corners for each in plan_views(camera, tags, SIZE, views=6).views) < 30


def test_no_more_views_than_are_needed(plan):
    need = 1.01 * plan.views[4].largest
    few = plan_views(nominal_camera(SIZE, field=60), BOARD, SIZE, sd0=0.2, views=6, need=need)
    assert (len(few.views), few.enough) == (5, True)
    assert "as good as" in few.headline
    more = plan_views(nominal_camera(SIZE, field=60), BOARD, SIZE, sd0=0.2, views=4, need=need)
    assert not more.enough
    assert "Plan more views" in more.next[0]


@pytest.mark.parametrize(
    ("lens", "own"),
    [
        ({"field": 60, "model": "opencv8"}, "opencv_pinhole"),
        ({"field": 150}, "opencv_fisheye"),
        ({"focal": 900.0, "model": "simple_radial"}, "simple_radial"),
        ({"field": 100, "model": "splined_stereographic", "knots": (8, 6)}, "splined_stereographic"),
    ],
)
def test_any_lens_can_be_planned_for(lens, own):
    camera = nominal_camera(SIZE, **lens)
    assert camera.model == own
    found = plan_views(camera, BOARD, SIZE, views=5)
    assert found.views[4].largest < found.views[3].largest
    assert found.maps[0].largest < 50


def test_nominal_cameras():
    camera = nominal_camera((1600, 1200), field=90)
    assert camera.parameters["fx"] == pytest.approx(1600 / (math.pi / 2), rel=1e-3)  # equidistant
    camera = nominal_camera((1600, 1200), focal=2000.0)
    assert (camera.parameters["fx"], camera.parameters["cx"]) == pytest.approx((2000, 799.5))
    for wrong, said in (
        ({}, "targets.nominal"),
        ({"field": 60, "focal": 1.0}, "targets.nominal"),
        ({"field": 400}, "error.at what=field message=error.range low=0 high=360 value=400.0"),
        ({"focal": -1.0}, "error.at what=focal message=error.positive value=-1.0"),
    ):
        with refusal(said):
            nominal_camera(SIZE, **wrong)


def test_what_cannot_be_planned():
    camera = nominal_camera(SIZE, field=60)
    for wrong, said in (
        ({"views": 3}, "error.at what=views message=error.least low=4 value=3"),
        ({"away": [0.05]}, "targets.not-shown name=middle of the picture, 0.05 m, tilted 30 degrees"),
        ({"away": [-1.0]}, "error.at what=distance message=error.positive value=-1.0"),
    ):
        with refusal(said):
            plan_views(camera, BOARD, SIZE, **wrong)


def test_it_is_an_option_of_the_command(tmp_path):
    def run(*words):
        return CliRunner().invoke(app, ["calibrate", *map(str, words)])

    board = ("--board", "6x5", "--spacing", "0.03", "--size", "800x600")
    out = ("--out", tmp_path / "plan", "--json", tmp_path / "plan.json")
    done = run("--plan", 5, *board, "--field", 60, "--away", "0.3,0.5", "--need", 1e-3, *out)
    assert done.exit_code == 4, done.output
    assert "above the 0.001 px that are needed" in done.output
    found = json.loads((tmp_path / "plan.json").read_text())
    assert [each["view"] for each in found["views"]] == [1, 2, 3, 4, 5]
    assert found["sd_of_corners"] == 0.3
    assert not found["enough"]
    assert np.shape(found["maps"][0]["sd"]) == (40, 60)
    names = {each.name for each in (tmp_path / "plan").iterdir()}
    assert {"report.html", "report.txt", "views.csv", "map-camera-infinity.npz"} <= names
    for words, said in (
        (["corners", "--plan", 5], "specify one of PATH, --example, --plan"),
        (["--plan", 5, *board], "requires --size, and --field or --focal"),
        (["--plan", 5, "--size", "800x600", "--field", 60], "requires --board"),
        (["--plan", 5, *board, "--field", 60, "--snoop"], "must not be combined with --plan"),
        (["--example", "--field", 60], "requires --plan"),
    ):
        assert said in " ".join(run(*words).output.replace("│", " ").split()), words
