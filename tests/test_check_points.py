"""Check points: tested one by one and together, with their own standard deviations, heard by the verdict."""

import json
import re
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram import Camera, InnerConstraints, Result, Spheroid, adjust, read_result, simulate
from photogram.cli import app
from photogram.formats import ReadOptions, read, to_files
from photogram.formats.supplements import with_control
from photogram.giant import Project, write_project
from photogram.results.datum import check_points
from photogram.statistics.agreement import agreement


@cache
def block(**options):
    return simulate(strips=2, photos_per_strip=4, check_points=8, seed=3, **options).block


def checks_of(one):
    return [row for row, name in enumerate(one.point_ids) if name.startswith("K")]


def spoiled(one, error=3.64, axis=2):
    positions = one.point_positions.copy()
    positions[checks_of(one)[2], axis] += error
    return one.replace(point_positions=positions)


def with_sd(one, sd):
    own = np.full(one.point_positions.shape, np.nan)
    own[checks_of(one)] = sd
    return one.replace(point_check_sd=own)


def test_statistics_are_those_of_the_joint_covariance():
    random = np.random.default_rng(8)
    n = 5
    cofactors = np.cov(random.normal(size=(3 * n, 60)))
    survey = np.array([np.diag(random.uniform(0.1, 1, 3)) for _ in range(n)])
    d = random.normal(size=(n, 3))
    d[1, 2] = np.nan
    found = agreement(d, cofactors, survey, scale=1.7, name=lambda place: f"P{place[0]}")
    c = 1.7 * cofactors
    for k in range(n):
        c[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += survey[k]
    there = np.isfinite(d.ravel())
    own = d.ravel()[there]
    expected = own @ np.linalg.solve(c[np.ix_(there, there)], own)
    assert found.together.weighted_sum_of_squares == pytest.approx(expected, rel=1e-12)
    assert found.together.degrees_of_freedom == 3 * n - 1
    plan = d[1, :2] @ np.linalg.solve(c[3:5, 3:5], d[1, :2])
    assert found.points.values[1] == pytest.approx(plan, rel=1e-12)
    assert (np.asarray(found.points.dimension) == [3, 2, 3, 3, 3]).all()
    # With an estimated unit weight T / m is F.
    by_f = agreement(d, cofactors, survey, scale=1.7, second=50.0)
    assert by_f.points.values[1] == pytest.approx(plan / 2, rel=1e-12)
    # What is known without error, and held by nothing but itself, has no variance: the others are tested.
    flat = np.zeros((6, 6))
    flat[:3, :3] = np.eye(3)
    singular = agreement(np.ones((2, 3)), flat, np.zeros((2, 3, 3)))
    assert singular.together.degrees_of_freedom == 3
    assert np.isnan(singular.points.values[1])


def test_good_blocks_agree():
    """T over its degrees of freedom is 1 on average, and depends on the cross covariances."""
    joint, alone = [], []
    for seed in range(25):
        one = simulate(strips=2, photos_per_strip=3, check_points=12, seed=seed, points_per_photo=20).block
        found = adjust(one, unit_variance="unity").check_points.agreement
        joint.append(found.together.variance)
        alone.append(np.nanmean(found.points.values / found.points.dimension))
        assert found.together.degrees_of_freedom == 36
    assert 0.85 < np.mean(joint) < 1.15
    # The single ones are right as well, but vary more than 12 independent points would.
    assert 0.7 < np.mean(alone) < 1.3
    assert np.std(alone) > np.sqrt(2 / 36) > 0.8 * np.std(joint)


def test_a_wrong_check_point_heads_the_verdict():
    one = spoiled(block())
    result = adjust(one)
    name = one.point_ids[checks_of(one)[2]]
    assert result.verdict.exit == 4
    assert result.verdict.code == "check-points"
    assert re.match(rf"Check points disagree with the adjustment: 1\) {name}, -\d\.\d+ m in Z \(sd 0\.\d+\)$",
                    result.verdict.headline)  # fmt: skip
    page = result.document()
    assert page.judgements[0].tone == "bad"
    assert page.advice[0].code == "advice.wrong-checks"
    assert not any("Nothing needs" in str(each) for each in page.advice)
    good = adjust(block())
    assert good.verdict.exit == 0
    assert {"check points together"} < {test.name for test in good.verdict.tests}


def test_what_is_barely_rejected_is_a_warning():
    one = block()
    sd = adjust(one).check_points.sd[2, 2]
    result = adjust(spoiled(one, 4.4 * sd))
    assert (result.verdict.code, result.verdict.exit) == ("look-at-check-points", 0)
    assert result.verdict.exit_code(strict=True) == 4


def test_single_tests_and_the_joint_test_share_the_level():
    (single,) = (
        each for each in adjust(block()).verdict.tests if getattr(each.kind, "code", "") == "test.checks"
    )
    assert (single.tests, single.level) == (8, pytest.approx(0.01 / 2 / 8))


def test_their_own_standard_deviations_count():
    one = spoiled(block())
    assert adjust(with_sd(one, 0.01)).verdict.exit == 4
    assert adjust(with_sd(one, 2.0)).verdict.exit == 0
    # Nothing is given: those of control are assumed, and that is said.
    unknown = adjust(one.replace(point_check_sd=None))
    held = one.point_sd[np.isfinite(one.point_sd)]
    assert unknown.check_points.assumed.all()
    assert np.allclose(unknown.check_points.given_sd, np.median(held))
    assert unknown.verdict.exit == 4
    (line,) = (line for line in unknown.verdict.lines if line.code == "line.checks-assumed")
    assert (line.fields["assumed"], line.fields["n"]) == (8, 8)
    assert "line.checks-assumed" not in {line.code for line in adjust(one).verdict.lines}


def test_all_outputs_have_them():
    result = adjust(with_sd(block(), [0.01, 0.02, 0.03]))
    table, document = result.check_table(), json.loads(result.to_json())["check_points"]
    assert (table["given_sd_Z"] == 0.03).all()
    assert not table["assumed"].any()
    np.testing.assert_allclose([each["sd"] for each in document], result.check_points.sd)
    np.testing.assert_allclose([each["given_sd"] for each in document], result.check_points.given_sd)
    np.testing.assert_allclose([each["p"] for each in document], table["probability"])
    (sd,) = (each for each in result.document().table("check_points").columns if each.head == "sd given")
    assert set(sd.values.ravel()) == {0.01, 0.02, 0.03}


def test_kept_with_the_result(tmp_path):
    result = adjust(with_sd(spoiled(block()), 0.02))
    result.to_parquet(tmp_path / "kept")
    again = read_result(tmp_path / "kept")
    assert again.verdict.headline == result.verdict.headline
    np.testing.assert_array_equal(again.block.point_check_sd, result.block.point_check_sd)


def test_geographic_blocks():
    one = block(spheroid=Spheroid.wgs84(), origin=(0.1, 0.8, 100.0))
    assert adjust(one).verdict.exit == 0
    wrong = adjust(spoiled(one, 1e-6, axis=0))
    assert wrong.verdict.exit == 4
    assert "arcsec in longitude" in wrong.verdict.headline


def test_a_datum_of_its_own_has_no_check():
    one = spoiled(block())
    free = one.replace(point_sd=np.inf)
    result = adjust(free, datum=InnerConstraints())
    assert result.check_points.agreement is None
    (line,) = (line for line in result.verdict.lines if line.code == "line.checks-untested")
    assert line.fields["reason"].code == "untested.checks-datum"


def test_without_joint_covariances_each_is_tested(monkeypatch):
    """As of a block in parts, whose normal equations are not kept together."""
    result = adjust(spoiled(block()))
    monkeypatch.setattr(Result, "WHOLE", False)
    found = check_points(result)
    assert found.agreement.together is None
    assert np.nanargmax(found.agreement.points.values) == 2


@pytest.fixture
def project(tmp_path):
    """Return a project of a simulated block whose check points have standard deviations."""
    made = CliRunner().invoke(
        app, ["simulate", str(tmp_path / "giant"), "--strips", "2", "--photos-per-strip", "4", "--seed", "3"]
    )
    assert made.exit_code == 0
    found = read(tmp_path / "giant")
    own = np.full(found.block.point_positions.shape, np.nan)
    own[found.checks] = [0.01, 0.02, 0.03]
    return found.replace(block=found.block.replace(point_check_sd=own))


def written(project, name, folder):
    folder.mkdir()
    for file, content in to_files(project, name).items():
        (folder / file).parent.mkdir(exist_ok=True, parents=True)
        (folder / file).write_bytes(content)
    return folder


def test_plain_projects_say_how_good_they_are(project, tmp_path):
    folder = written(project, "plain", tmp_path / "plain")
    again = read(folder)
    np.testing.assert_array_equal(again.block.point_check_sd[again.checks[0]], [0.01, 0.02, 0.03])
    # [sd] check, or --sd check=, fills what the table lacks; without it that of control.
    table = folder / "control.csv"
    text = table.read_text()
    table.write_text(text.replace("0.01,0.02,0.03", ",,"))
    for name in ("check", "control"):
        wished = read(folder, ReadOptions(sd={name: (0.5,)}))
        assert (wished.block.point_check_sd[wished.checks] == 0.5).all()
    row = next(line for line in text.splitlines() if line.endswith(",check"))
    cells = row.split(",")
    cells[3] = repr(float(cells[3]) + 5.0)
    table.write_text(text.replace(row, ",".join(cells)))
    done = CliRunner().invoke(app, ["adjust", str(folder), "--out", str(tmp_path / "out")])
    assert done.exit_code == 4, done.output
    assert f"Check points disagree with the adjustment: 1) {cells[0]}, -" in done.output


def test_control_added_to_a_project(project, tmp_path):
    table = tmp_path / "control.csv"
    block = project.block
    rows = [
        f"{name},{','.join(map(repr, block.point_positions[row].tolist()))},{use}"
        for use, own in (
            ("check", project.checks),
            ("control", np.flatnonzero(np.isfinite(block.point_sd[:, 0]))),
        )
        for row in own
        for name in [block.point_ids[row]]
    ]
    table.write_text("\n".join(["point,x,y,z,use", *rows]) + "\n")
    bare = project.replace(
        block=block.replace(
            point_positions=np.full_like(block.point_positions, np.nan), point_sd=np.inf, point_check_sd=None
        )
    )
    found = with_control(bare, table, {"control": (0.02,), "check": (0.07,)}, None)
    assert (found.block.point_check_sd[found.checks] == 0.07).all()
    assert np.isnan(found.block.point_check_sd[np.isfinite(found.block.point_sd)]).all()


@pytest.mark.parametrize("name", ["agisoft", "blocks_exchange"])
def test_formats_keep_them(project, tmp_path, name):
    camera = Camera("simple_pinhole", {"f": 7600.0, "cx": 5750.0, "cy": 5750.0})
    changes = {"principal_distances": None, "cameras": [camera], "image_sd": 0.4}
    block = project.block.replace(**changes, image_xy=project.block.image_xy * 50 * [1, -1] + 5750.0)
    project = project.replace(block=block, sizes=((11500, 11500),), pixel_mm=(0.02,))
    again = read(written(project, name, tmp_path / name))
    found = again.block.point_check_sd[again.checks]
    plan = np.hypot(0.01, 0.02) / np.sqrt(2)
    expected = [0.01, 0.02, 0.03] if name == "agisoft" else [plan, plan, 0.03]
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape))


def test_giant_has_them_in_ground(tmp_path):
    project = Project.from_block(block())
    for point in project.ground:
        if point.type_code == 7:
            point.sd = (0.1, 0.2, 0.3)
    found = project.to_block()
    np.testing.assert_allclose(found.point_check_sd[checks_of(found)], [[0.1, 0.2, 0.3]] * 8)
    assert adjust(found).verdict.exit == 0


@pytest.mark.parametrize(
    "command",
    [["giant"], ["adjust"], ["adjust", "--parts", "2", "--unit-variance", "constrained"]],
    ids=" ".join,
)
def test_every_command_ends_by_them_and_says_what_to_do(tmp_path, command):
    one = spoiled(block(), 30.0)
    write_project(Project.from_block(one), tmp_path / "wrong")
    out = tmp_path / "out"
    first, *others = command
    arguments = [
        first,
        str(tmp_path / "wrong"),
        *others,
        "--out",
        str(out),
        "--json",
        str(tmp_path / "a.json"),
    ]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 4, done.output
    said = f"Check points disagree with the adjustment: 1) {one.point_ids[checks_of(one)[2]]}, -"
    verdict = json.loads((tmp_path / "a.json").read_bytes())["verdict"]
    assert (verdict["exit"], verdict["code"]) == (4, "check-points")
    assert verdict["headline"].startswith(said)
    assert f"Verdict\n-------\n{said}" in (out / "report.txt").read_text()
    page = (out / "report.html").read_text()
    assert said in page
    assert "Look at the named check points" in page
    assert "Nothing needs to be done" not in page
