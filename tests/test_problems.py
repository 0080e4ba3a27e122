"""Reports: what is wrong comes first and has a name; two runs write the same bytes."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from photogram import Block, Result, adjust, simulate
from photogram.collection import adjust as adjust_collection
from photogram.collection import simulate as simulate_collection
from photogram.giant import Project, read_project, write_project

NETWORK: dict[str, Any] = {"strips": 2, "photos_per_strip": 5, "points_per_photo": 40, "control_spacing": 2}


def problems(result: Result) -> list[str]:
    return json.loads(result.to_json())["problems"]


def remarks(result: Any) -> list[str]:
    """Return the remarks of the document, which the report and the page have first."""
    return next(list(part.sentences) for part in result.document().sections[0].parts)


def test_a_failed_global_test_comes_first():
    block = simulate(**NETWORK, seed=1).block
    assert not remarks(adjust(block))
    result = adjust(block.replace(image_sd=block.image_sd / 20))
    assert result.variance_of_unit_weight == pytest.approx(400, rel=0.2)
    for lines in (remarks(result), problems(result)):
        assert lines[0].startswith("the global test fails: residuals are")
    test = json.loads(result.to_json())["global_test"]
    assert test["rejected"] == "high"
    assert test["variance"] == pytest.approx(result.variance_of_unit_weight, rel=1e-12)


@pytest.mark.parametrize("unit_variance", ["free", "constrained", "unity"])
def test_the_global_test_takes_what_the_unit_variance_counts(unit_variance):
    block = simulate(**NETWORK, position_sd=0.1, seed=1).block
    result = adjust(block.replace(image_sd=block.image_sd / 20), unit_variance=unit_variance)
    sums = result.sums_of_squares
    camera = sums.camera if unit_variance == "constrained" else 0.0
    assert result.global_test is not None
    assert result.global_test.weighted_sum_of_squares == pytest.approx(sums.ground + sums.plates + camera)
    # Where weighted poses do not count, what is left has the redundancy of images and control alone.
    counted = np.nansum(result.redundancy) + np.nansum(result.point_redundancy)
    freedom = result.degrees_of_freedom if unit_variance == "constrained" else counted
    assert result.global_test.degrees_of_freedom == pytest.approx(freedom, rel=1e-9)
    assert problems(result)[0].startswith("the global test fails")


def test_no_convergence_comes_before_the_global_test():
    result = adjust(simulate(**NETWORK, seed=1).block, max_iterations=1)
    assert remarks(result)[0].startswith("the adjustment has not converged")
    assert remarks(result)[1].startswith("the global test fails")


def test_outliers_of_every_kind_are_named():
    block = simulate(**NETWORK, position_sd=0.05, attitude_sd=1e-4, seed=3).block
    assert not any("beyond" in line for line in problems(adjust(block)))
    # Of two images only, either could be wrong.
    image = int(np.bincount(block.image_points)[block.image_points].argmax())
    xy = block.image_xy.copy()
    xy[image, 1] += 0.2
    [*_, control] = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    positions = block.point_positions.copy()
    positions[control, 2] += 3.0
    observed = block.photo_positions_observed.copy()
    observed[7, 0] += 2.0
    result = adjust(block.replace(image_xy=xy, point_positions=positions, photo_positions_observed=observed))
    point, photo = block.point_ids[block.image_points[image]], block.photo_ids[block.image_photos[image]]
    outliers = result.verdict.outliers
    assert remarks(result)[1 : 1 + len(outliers)] == [*map(str, outliers)]
    assert [line.fields["kind"].code for line in outliers] == [
        "test.images", "test.control", "test.positions"
    ]  # fmt: skip
    assert [line.fields["name"].fields for line in outliers] == [
        {"point": point, "photo": photo},
        {"point": block.point_ids[control]},
        {"photo": block.photo_ids[7]},
    ]
    # The tests are those of the verdict, whose limits consider the common factor of the standard deviations.
    tests = {test.kind: test for test in result.verdict.tests}
    for line in result.verdict.outliers:
        fields, test = line.fields, tests[line.fields["kind"]]
        assert (fields["statistic"], fields["value"], fields["name"]) == (
            test.statistic,
            test.value,
            test.subject,
        )
        assert fields["limit"] == pytest.approx(test.limits[1] * fields.get("factor", 1.0) ** 2)
        assert not test.accepted


def test_the_worst_observations_of_every_kind_have_their_numbers():
    block = simulate(**NETWORK, position_sd=0.05, seed=3).block
    observed = block.photo_positions_observed.copy()
    observed[7, 0] += 2.0
    result = adjust(block.replace(photo_positions_observed=observed))
    table = result.document().table("worst")
    columns = {column.head: column.values for column in table.columns}
    row = columns["Observation"].index(f"X of photo {block.photo_ids[7]}")
    assert columns["Residual"][row] == pytest.approx(result.photo_residuals[7, 0])
    assert columns["sd given"][row] == pytest.approx(0.05)
    assert columns["Unit"][row] == block.linear_unit
    assert columns["Test value w"][row] == pytest.approx(result.photo_standardized[7, 0])
    assert "Beyond" not in table.note


def test_good_blocks_seldom_have_outliers():
    named = 0
    for seed in range(40):
        result = adjust(simulate(strips=1, photos_per_strip=4, points_per_photo=20, seed=seed).block)
        named += any("beyond" in line for line in problems(result))
    assert named <= 7  # 5 percent of 40 are 2; more than 7 have a probability of 0.1 percent


def test_collections_name_their_outliers():
    collection = simulate_collection(photos=8, points=80, seed=2).collection
    good = adjust_collection(collection)
    assert not any("beyond" in line for line in remarks(good))
    xy = collection.image_xy.copy()
    xy[50] += 30 * collection.image_sd[50]
    result = adjust_collection(collection.replace(image_xy=xy))
    point, photo = collection.image_points[50], collection.image_photos[50]
    [line] = result.verdict.outliers
    assert line.fields["name"].fields == {"point": str(point), "photo": str(photo)}
    assert str(line) in remarks(result)
    wrong = adjust_collection(collection.replace(image_sd=collection.image_sd / 20))
    assert remarks(wrong)[0].startswith("the global test fails")


# On the command line


@pytest.fixture
def project(run, tmp_path):
    assert run("simulate", "block", "--strips", 2, "--photos-per-strip", 4, "--seed", 5).exit_code == 0
    return tmp_path / "block"


def test_giant_says_that_the_global_test_fails(run, project):
    done = run("giant", project)
    assert done.exit_code == 0, done.output
    assert "\nVerdict\n  Accepted" in done.output
    assert "Remarks\n" not in done.output
    block = read_project(project).to_block()
    control = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[0]
    positions = block.point_positions.copy()
    positions[control, 2] += 500.0
    wrong = project.with_name("wrong")
    write_project(Project.from_block(block.replace(point_positions=positions)), wrong)
    done = run("giant", wrong)
    assert done.exit_code == 4
    assert "\nVerdict\n  Gross errors likely: 1) " in done.output
    lines = done.output[done.output.index("Remarks\n") :].splitlines()
    assert lines[1].strip().startswith("the global test fails")
    for kind in ("images", "control points"):
        assert f" {kind} have T beyond" in " ".join(" ".join(lines[2:12]).split()), kind
    report = (project.with_name("wrong-adjusted") / "report.txt").read_text()
    assert "the global test fails" in report[: report.index("Size and fit")]


def test_reports_do_not_differ_from_run_to_run(run, project, tmp_path):
    reports = []
    for number, threads in enumerate((1, 2, 1, 4)):
        assert run("giant", project, "--out", tmp_path / str(number), "--threads", threads).exit_code == 0
        reports.append({each.name: _lasting(each) for each in (tmp_path / str(number)).iterdir()})
    assert all(each == reports[0] for each in reports)
    assert set(reports[0]) == {"FRAMES", "GROUND", "RESTART", "report.html", "report.txt"}


def _lasting(path):
    """Return a file without what is of its run: the last section of a report for the browser."""
    content = path.read_bytes()
    return content.partition(b'<section id="reproducibility">')[0] if path.suffix == ".html" else content


def test_reports_of_collections_do_not_differ_from_run_to_run(run, tmp_path):
    texts, pages = [], set()
    for number, threads in enumerate((1, 2, 1)):
        out = tmp_path / str(number)
        assert run("collection", "--example", "--out", out, "--threads", threads).exit_code == 0
        texts.append((out / "report.txt").read_bytes())
        pages.add(_lasting(out / "report.html"))
    assert len(pages) == 1
    assert texts[0] == texts[1] == texts[2]
    assert b"seconds" not in texts[0]


def test_seconds_stand_in_the_document():
    block: Block = simulate(**NETWORK, seed=1).block
    result = adjust(block)
    assert "second" not in result.report()
    assert set(json.loads(result.to_json())["seconds"]) == {"form", "factor", "solve", "invert", "cofactors"}
