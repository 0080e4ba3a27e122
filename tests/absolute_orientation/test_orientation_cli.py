"""`photogram absolute-orientation`: what is written, exit codes, the page in docs."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from orientation_golden import cards_of, cases, csv_of

EXAMPLE = files("photogram") / "examples" / "absolute_orientation"
MEMBERS = {
    "scale",
    "rotation",
    "angles_rad",
    "translation",
    "covariance",
    "rms",
    "sigma0",
    "degrees_of_freedom",
}


@pytest.fixture
def run(run):
    """Run the command in an empty directory."""
    return lambda *arguments: run("absolute-orientation", *arguments)


def test_the_example(run, tmp_path):
    result = run("--example", "--json", "result.json", "--out", "o", "--plots")
    assert result.exit_code == 0, result.output
    assert "converged" in result.output
    assert {path.name for path in tmp_path.iterdir()} == {"result.json", "o"}
    assert {path.name for path in Path("o").iterdir()} == {
        "points-transformed.csv",
        "report.html",
        "report.txt",
        "residuals.png",
    }
    document = json.loads(Path("result.json").read_bytes())
    assert set(document) >= {*MEMBERS, "control", "points"}
    assert np.shape(document["covariance"]) == (7, 7)
    assert [point["id"] for point in document["points"][:3]] == ["P301", "P302", "P401"]
    assert len(document["points"]) == 14
    height = next(station for station in document["control"] if station["id"] == "V201")
    assert height["residual"][:2] == [None, None]
    sums = sum(value or 0 for station in document["control"] for value in station["redundancy"])
    assert sums == pytest.approx(document["degrees_of_freedom"], abs=1e-8)
    squares = sum((value or 0) ** 2 for station in document["control"] for value in station["residual"])
    assert document["rms"] == pytest.approx((squares / document["known_coordinates"]) ** 0.5)
    assert Path("o/residuals.png").read_bytes().startswith(b"\x89PNG")


def test_the_default_directory_of_the_example(run, tmp_path):
    assert run("--example").exit_code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["example-oriented"]
    written = {path.name for path in (tmp_path / "example-oriented").iterdir()}
    assert written == {"points-transformed.csv", "report.html", "report.txt"}


@pytest.mark.parametrize("case", cases("partial_mixed", "partial_min"))
@pytest.mark.parametrize("write", [csv_of, cards_of])
def test_a_golden_model_from_a_file(run, case, write, tmp_path):
    Path("stations.dat").write_text(write(case["stations"]))
    lines = [f"Q{k},{','.join(map(repr, point))}" for k, point in enumerate(case["part2"]["model"])]
    Path("points.csv").write_text("id,x,y,z\n" + "\n".join(lines) + "\n")
    result = run("stations.dat", "--points", "points.csv", "--json", "result.json")
    assert result.exit_code == 0, result.output
    document = json.loads(Path("result.json").read_bytes())
    np.testing.assert_allclose(document["rotation"], case["expected"]["A"], rtol=0, atol=2e-9)
    positions = [point["position"] for point in document["points"]]
    np.testing.assert_allclose(positions, case["part2"]["ground"], rtol=1e-8)
    determined = case["counts"]["dof"] > 0
    assert (document["covariance"] is not None) == determined
    assert (document["sigma0"] is not None) == determined
    assert document["points"][0]["covariance"][0][0] is not None or not determined
    written = {path.name for path in Path("stations-oriented").iterdir()}
    assert written == {"points-transformed.csv", "report.html", "report.txt"}


@pytest.mark.parametrize("case", cases("blunder_full"))
def test_a_station_is_rejected_and_the_solution_restarted(run, case):
    Path("stations.csv").write_text(csv_of(case["stations"]))
    run("stations.csv", "--json", "first.json")
    outliers = json.loads(Path("first.json").read_bytes())["test"]["outliers"]
    assert {name for name, _ in outliers} == {"4"}
    arguments = ["stations.csv", "--reject", 4, "--restart", "first.json", "--method", "report"]
    assert run(*arguments, "--json", "second.json", "--out", "o").exit_code == 0
    second = json.loads(Path("second.json").read_bytes())
    assert second["start"] == "restart"
    assert second["iterations"] == 2
    assert [station["id"] for station in second["rejected"]] == ["4"]
    assert "Control that took no part" in Path("o/report.txt").read_text()
    assert second["rms"] < 0.1 * json.loads(Path("first.json").read_bytes())["rms"]


def test_part_two_by_itself(run, tmp_path):
    options = ["--json", "result.json", "--out", "o", "--part-two", "cards.txt", "-q"]
    assert run("--example", *options).exit_code == 0
    source = str(EXAMPLE / "points.csv")
    assert run("transform", "result.json", source, "a.csv", "--decimals", 5).exit_code == 0
    bare = run("transform", "cards.txt", source, "b.csv", "--decimals", 5)
    assert "12 points\nwritten: " in bare.output
    with_sd, without, inline = (
        Path(name).read_text().splitlines() for name in ("a.csv", "b.csv", "o/points-transformed.csv")
    )
    assert [line.split(",")[:4] for line in with_sd] == [line.split(",")[:4] for line in inline]
    assert [line.split(",")[:4] for line in without] == [line.split(",")[:4] for line in inline]
    assert all(line.endswith(",,,") for line in without[1:])
    # The points' own errors come on top.
    assert run("transform", "result.json", source, "c.csv", "--point-sd", 0.008).exit_code == 0
    sd, own = (float(Path(name).read_text().splitlines()[1].split(",")[4]) for name in ("a.csv", "c.csv"))
    assert own**2 == pytest.approx(sd**2 + (0.008 * 6) ** 2, rel=1e-3)


def test_weights(run):
    text = (EXAMPLE / "stations.csv").read_text().splitlines()
    rows = [
        text[0] + ",sd_X,sd_Y,sd_Z,sd_x,sd_y,sd_z",
        *(f"{line},.02,.02,.03,.01,.01,.01" for line in text[1:]),
    ]
    Path("stations.csv").write_text("\n".join(rows) + "\n")
    documents = []
    for variance in ("estimated", "unity"):
        result = run("stations.csv", "--unit-variance", variance, "--json", "result.json")
        assert result.exit_code == 0, result.output
        documents.append(json.loads(Path("result.json").read_bytes()))
    estimated, unity = documents
    assert unity["covariance_scale"] == 1
    assert estimated["covariance_scale"] == pytest.approx(estimated["sigma0"] ** 2)
    ratio = np.array(estimated["covariance"]) / np.array(unity["covariance"])
    np.testing.assert_allclose(np.diag(ratio), estimated["sigma0"] ** 2)


def test_exit_codes(run, tmp_path):
    for arguments in ([], ["a.csv", "--example"], ["--example", "--method", "best"], ["transform", "a"]):
        assert run(*arguments).exit_code == 2
    missing = run("none.csv")
    assert missing.exit_code == 1
    assert "cannot be read" in missing.output
    Path("few.csv").write_text("id,X,Y,Z,x,y,z\nA,1,2,3,4,5,6\n")
    few = run("few.csv", "--json", "result.json")
    assert few.exit_code == 3
    assert "control requires 7 coordinates" in few.output
    Path("points.csv").write_text("id,x,y,z\nA,1,2,bad\n")
    faulty = run("--example", "--points", "points.csv", "--json", "r.json", "--out", "o", "--plots")
    assert faulty.exit_code == 1
    assert "record 2" in faulty.output
    over = run("--example", "--points", "points.csv", "--points-out", "points.csv")
    assert "must not be written over" in over.output
    assert {path.name for path in tmp_path.iterdir()} == {"few.csv", "points.csv"}


def test_step_12_goes_to_files_with_its_identification(run, tmp_path):
    case = next(iter(cases("partial_mixed"))).values[0]
    Path("cards.dat").write_text(cards_of(case["stations"]))
    arguments = ["--part-two", "two.dat", "--restart-out", "next.dat", "--json", "result.json"]
    first = run("cards.dat", *arguments, "--ident", "STRIP7")
    assert first.exit_code == 0, first.output
    two = [line.split() for line in Path("two.dat").read_text().splitlines()]
    assert [len(words) for words in two] == [7, 8]
    document = json.loads(Path("result.json").read_bytes())
    np.testing.assert_array_equal(
        np.array([*two[0][:6], *two[1][:3]], float).reshape(3, 3), document["rotation"]
    )
    words = Path("next.dat").read_text().split()
    assert len(words) == 8
    assert {two[0][-1], two[1][-1], words[-1]} == {"STRIP7"}
    again = run("cards.dat", "--restart", "next.dat", "--json", "again.json", "--method", "report")
    assert again.exit_code == 0, again.output
    second = json.loads(Path("again.json").read_bytes())
    assert (second["start"], second["scale"]) == ("restart", pytest.approx(document["scale"], rel=1e-8))
    Path("points.dat").write_text("1.0 2.0 3.0 A\n")
    for source in ("two.dat", "result.json"):
        assert run("transform", source, "points.dat", f"{source}.csv").exit_code == 0
    lines = [
        Path(f"{source}.csv").read_text().splitlines()[1].split(",")[:4]
        for source in ("two.dat", "result.json")
    ]
    assert lines[0] == lines[1]
    # The identification of the cards is the default, and is one word.
    assert run("cards.dat", "--part-two", "two.dat").exit_code == 0
    refused = run("cards.dat", "--part-two", "no.dat", "--ident", "two words")
    assert refused.exit_code == 1
    assert "must be one word of a record" in refused.stderr
    assert not Path("no.dat").exists()
