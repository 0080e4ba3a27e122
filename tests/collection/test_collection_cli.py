"""`photogram collection`."""

from __future__ import annotations

import json

import pytest

from photogram.collection import read, simulate, to_bytes


def test_the_example_converges_and_everything_is_written(run, tmp_path):
    done = run(
        "collection",
        "--example",
        "--sd",
        "0.5",
        "--out",
        "out",
        "--json",
        "all.json",
    )
    assert done.exit_code == 0, done.output
    assert "converged" in done.output
    document = json.loads((tmp_path / "all.json").read_bytes())
    assert document["status"] == "converged"
    assert document["variance_of_unit_weight"] == pytest.approx(1, abs=0.2)
    assert len(document["photos"]) == 8
    adjusted = read(tmp_path / "out" / "adjusted.txt")
    assert 4 * adjusted.cost() == pytest.approx(document["cost"], rel=1e-9)
    report = (tmp_path / "out" / "report.txt").read_text()
    assert "\nRotations\n" in report
    assert f"{document['cost']:.7g}" in report


@pytest.mark.parametrize("packing", ["", ".bz2", ".gz"])
def test_what_was_packed_is_packed_again(run, tmp_path, packing):
    made = simulate(seed=3)
    (tmp_path / f"problem.txt{packing}").write_bytes(to_bytes(made.collection, packing))
    assert run("collection", f"problem.txt{packing}", "--out", "out").exit_code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "report.html",
        "report.txt",
        f"adjusted.txt{packing}",
    }
    assert len(read(tmp_path / "out" / f"adjusted.txt{packing}").image_xy) == len(made.collection.image_xy)


def test_a_robust_loss_by_option(run, tmp_path):
    made = simulate(outlier_share=0.05, seed=3)
    (tmp_path / "problem.txt").write_bytes(to_bytes(made.collection))
    done = run(
        "collection", "problem.txt", "--loss", "cauchy", "--scale", "2", "--sd", "0.5", "--json", "all.json"
    )
    assert done.exit_code == 0, done.output
    assert "modified weights" in done.output
    assert json.loads((tmp_path / "all.json").read_bytes())["loss"] == {"name": "cauchy", "scale": 2.0}


def test_too_few_iterations_are_told_by_the_exit_code(run):
    done = run("collection", "--example", "--max-iterations", "2", "--no-covariance")
    assert done.exit_code == 3
    assert "not converged: do not use these values" in done.output


def test_faults_of_the_input_are_named(run, tmp_path):
    (tmp_path / "problem.txt").write_text("2 1 2\n0 0 1 1\n2 0 1 1\n" + 21 * "0\n")
    done = run("collection", "problem.txt")
    assert done.exit_code == 1
    assert "problem.txt, record 3: the number of a photo must be 0 to 1, got 2" in done.output
    assert run("collection").exit_code == 2
    assert run("collection", "--example", "--sd", "-1").exit_code == 1
    for words, said in (((), "requires --loss"), (("--snoop",), "must not be combined with --scale")):
        done = run("collection", "--example", "--scale", "2", *words)
        assert done.exit_code == 2
        assert said in done.output
