"""`photogram new`, `adjust`, `info`, `convert`."""

import json
import re
import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import photogram
from photogram import adjust, formats
from photogram.stellar.plain import inputs


@pytest.mark.parametrize("kind", ["metrology", "survey", "rolling", "archive", "night"])
def test_new_begins_a_project_of_each_kind(run, tmp_path, kind):
    assert run("new", "own", "--kind", kind).exit_code == 0
    refused = run("new", "own")
    assert refused.exit_code == 1
    assert "--overwrite" in refused.stderr
    if kind == "metrology":
        done = run("adjust", "own", "--no-html")
        assert done.exit_code == 0, done.output
        assert re.search(r"images +976 \(of 61 points\)", done.output)
    elif kind == "survey":
        done = run("statement", "own")
        assert done.exit_code == 0, done.output
        assert "The accuracy asked for is met" in done.output
    elif kind == "rolling":
        done = run("adjust", "own", "--no-html")
        assert done.exit_code == 0, done.output
        assert re.search(r"photos with a rolling shutter +10", done.output)
        unknowns = pd.read_csv(tmp_path / "own-adjusted" / "unknowns.csv", comment="#")
        (readout,) = unknowns[unknowns["kind"] == "readout"].to_dict("records")
        assert abs(readout["value"] - 0.0276) < 2 * readout["sd"]
        assert readout["sd"] < 0.001
    elif kind == "archive":
        done = run("adjust", "own", "--no-html")
        assert done.exit_code == 0, done.output
        assert re.search(r"observations, fiducial +47", done.output)
        assert "Accepted" in done.output
    else:
        night = tmp_path / "own" / "night.toml"
        assert inputs(night) == [night, night.with_name("images.csv")]
        assert all(path.is_file() for path in inputs(night))


@pytest.mark.parametrize("name", ["make_board", "make_targets", "make_rolling", "make_archive"])
def test_an_example_is_what_its_script_makes(tmp_path, name):
    script = runpy.run_path(str(Path(__file__).parents[2] / "examples" / f"{name}.py"))
    script["main"]([str(tmp_path)])
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert made == {path.name: path.read_bytes() for path in script["EXAMPLE"].iterdir()}


def test_a_new_project_is_adjusted_in_one_command(run, tmp_path):
    assert run("new", "own").exit_code == 0
    assert run("new", "own").exit_code == 1
    assert run("new", "own", "--overwrite").exit_code == 0
    done = run("adjust", "own", "--json", "result.json")
    assert done.exit_code == 0, done.output
    assert "plain project" in done.output
    assert re.search(r"photos +6 \(6 with a position\)", done.output)
    place = tmp_path / "own-adjusted"
    result = adjust(formats.read(tmp_path / "own").block, unit_variance="free")
    points = pd.read_csv(place / "points.csv", comment="#")
    np.testing.assert_allclose(points[["X", "Y", "Z"]], result.point_positions, rtol=1e-12)
    np.testing.assert_allclose(points[["sd_X", "sd_Y", "sd_Z"]], result.point_sd, rtol=1e-9)
    covariances = pd.read_csv(place / "photo_covariances.csv", comment="#")
    lower = np.tril_indices(6)
    np.testing.assert_allclose(
        covariances.iloc[:, 1:].to_numpy(),
        result.photo_covariances[:, lower[0], lower[1]],
        rtol=1e-9,
        atol=1e-18,
    )
    assert json.loads((tmp_path / "result.json").read_text())["status"] == "converged"
    report = (place / "report.txt").read_text()
    assert "Units and axes" in report
    again = run("adjust", place / "adjusted", "--out", "again", "--quiet")
    assert again.exit_code == 0, again.output
    assert again.stdout == ""
    after = pd.read_csv(tmp_path / "again" / "points.csv", comment="#").set_index("point")
    np.testing.assert_allclose(
        after.loc[points["point"], ["X", "Y", "Z"]], points[["X", "Y", "Z"]], atol=1e-6
    )


def test_info_says_what_lies_there_and_writes_nothing_else(run, tmp_path):
    run("new", "own")
    before = set(tmp_path.rglob("*"))
    done = run("info", "own", "--json", "info.json")
    assert done.exit_code == 0
    for word in (
        "plain project",
        "drone   opencv  4000 x 3000",
        "rays of points",
        "position",
    ):
        assert word in done.output
    assert set(tmp_path.rglob("*")) - before == {tmp_path / "info.json"}
    document = json.loads((tmp_path / "info.json").read_text())
    assert (document["photos"], document["photos_with_position"], document["frame"]["kind"]) == (
        6,
        6,
        "cartesian",
    )
    assert sum(document["rays"].values()) == document["points"] == 35
    (camera,) = document["cameras"]
    assert (camera["model"], camera["pixels"]) == ("opencv", [4000, 3000])


def test_what_no_format_knows_is_refused_with_the_formats(run, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file.bin").write_bytes(b"\x00\x01")
    for path in ("folder", "file.bin"):
        done = run("adjust", path)
        assert done.exit_code == 1
        assert "the format must be one of" in done.stderr
        assert "plain project" in done.stderr
    done = run("adjust", "nothing")
    assert done.exit_code == 1
    assert "nothing" in done.stderr
    assert run("adjust").exit_code == 2


def test_a_folder_with_one_file_of_a_format_is_read(run, tmp_path):
    run("new", "own")
    assert run("convert", "own", "there", "--to", "blocks_exchange").exit_code == 0
    (tmp_path / "there" / "notes.txt").write_text("of no format")
    done = run("info", "there")
    assert done.exit_code == 0
    assert "block.xml: BlocksExchange" in done.output
    assert run("convert", "own", "there", "--to", "agisoft").exit_code == 0
    done = run("info", "there")
    assert done.exit_code == 1
    for word in ("block.xml: --format blocks_exchange", "cameras.xml: --format agisoft"):
        assert word in done.stderr.replace("\n", " ")
    done = run("info", "there", "--format", "agisoft")
    assert done.exit_code == 0
    assert "cameras.xml: Agisoft" in done.output


def test_a_file_of_a_folder_is_told_apart_from_the_folder(run):
    assert run("convert", "--example", "sparse").exit_code == 0
    done = run("info", "sparse/images.bin")
    assert done.exit_code == 1
    assert "the path must be the folder of a COLMAP model" in done.stderr.replace("\n", " ")


def test_without_control_the_datum_is_asked_for(run, tmp_path):
    run("new", "own")
    for name in ("control", "gnss", "distances"):
        (tmp_path / "own" / f"{name}.csv").unlink()
    done = run("adjust", "own", "--datum", "control")
    assert done.exit_code == 1
    assert "--datum inner" in done.stderr
    free = run("adjust", "own", "--datum", "inner")
    assert free.exit_code == 0, free.output
    assert "inner constraints" in (tmp_path / "own-adjusted" / "report.txt").read_text()
    assert run("adjust", "own").exit_code == 0


def test_a_datum_on_three_points_is_held_as_asked_for(run, tmp_path):
    """3-2-1: six coordinates, and the scale from the distances of the project; what was control checks it."""
    run("new", "own")
    (tmp_path / "own" / "gnss.csv").unlink()
    control = pd.read_csv(tmp_path / "own" / "control.csv", comment="#")
    a, b, c, d = control["point"].astype(str)[:4]
    done = run("adjust", "own", "--hold", f"{a}=XYZ,{b}=YZ,{c}=z", "--out", "held")
    assert done.exit_code == 0, done.output
    assert "given by control that is exactly minimal" in (tmp_path / "held" / "report.txt").read_text()
    points = (
        pd.read_csv(tmp_path / "held" / "points.csv", comment="#").astype({"point": str}).set_index("point")
    )
    own = control.astype({"point": str}).set_index("point")
    assert points.loc[a, ["X", "Y", "Z"]].tolist() == own.loc[a, ["x", "y", "z"]].tolist()
    assert (points.loc[b, "Y"], points.loc[c, "Z"]) == (own.loc[b, "y"], own.loc[c, "z"])
    assert (points.loc[[a, c], "sd_Z"] == 0).all()
    assert points.loc[b, "sd_X"] > 0
    assert points.loc[d, "kind"] == "check"
    for wanted, said in (("nobody=XYZ", "points of the block"), (f"{a}=XQ", "POINT=AXES")):
        refused = run("adjust", "own", "--hold", wanted)
        assert refused.exit_code == 1
        assert said in refused.stderr


@pytest.mark.parametrize("wanted", ["six", "three"])
def test_nominal_coordinates_orient_photos_without_poses(run, tmp_path, wanted):
    """3-2-1 over six points, one run: only the named coordinates are fixed, at their nominal values."""
    run("new", "own", "--kind", "metrology")
    assert run("adjust", "own", "--out", "free", "-q", "--no-html").exit_code == 0
    free = pd.read_csv(tmp_path / "free" / "points.csv", comment="#").set_index("point")
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    places = free[["X", "Y", "Z"]].to_numpy() @ turn.T + [5.0, -3.0, 2.0]
    rows = [list(free.index).index(name) for name in ("hole-1", "c03", "c13", "c23", "c33", "c43")]
    nominal = np.round(places[rows] + np.random.default_rng(1).normal(0, 5e-4, (6, 3)), 4)
    table = pd.DataFrame(nominal, columns=["x", "y", "z"], index=free.index[rows])
    table.assign(use="check", sd=0.001).to_csv(tmp_path / "nominal.csv")
    held = {
        "six": {"hole-1": "Z", "c03": "Z", "c13": "Z", "c23": "Y", "c33": "Y", "c43": "X"},
        "three": {"c03": "XYZ", "c23": "YZ", "c43": "Z"},
    }[wanted]
    hold = ",".join(f"{name}={axes}" for name, axes in held.items())
    for more, out in (((), "one"), (("--snoop",), "snooped")):
        words = ("adjust", "own", "--control", "nominal.csv", "--hold", hold, "--out", out, "-q", *more)
        done = run(*words)
        assert done.exit_code in (0, 4), done.output
        found = pd.read_csv(tmp_path / out / "points.csv", comment="#").set_index("point")
        for name, axes in held.items():
            for axis in "XYZ":
                assert (found.loc[name, f"sd_{axis}"] == 0) == (axis in axes)
                if axis in axes:
                    assert found.loc[name, axis] == table.loc[name, axis.lower()]
        assert np.abs(found[["X", "Y", "Z"]].to_numpy() - places).max() < 0.1
        bars = [found.loc[f"bar-1-{end}", ["X", "Y", "Z"]].to_numpy(dtype=float) for end in "ab"]
        assert np.linalg.norm(bars[0] - bars[1]) == pytest.approx(0.800245, abs=2e-5)
    refused = run("adjust", "own", "--control", "nominal.csv", "--hold", hold, "--datum", "inner")
    assert refused.exit_code == 2


def test_cards_for_intersection_only_are_told_of_photos_that_move(tmp_path):
    sample = Path(photogram.__file__).parent / "examples" / "galveston"
    for each in sample.iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    assert not any("column 10" in str(each) for each in formats.read(tmp_path).messages)
    lines = (tmp_path / "COMMON").read_text().splitlines(keepends=True)
    lines[1] = f"{lines[1][:9]}1{lines[1][10:]}"
    (tmp_path / "COMMON").write_text("".join(lines))
    assert any(each.code == "format.intersection" for each in formats.read(tmp_path).messages)


def test_a_user_adds_what_a_project_lacks(run, tmp_path):
    run("new", "own")
    whole = tmp_path / "own"
    result = run("adjust", "own", "--out", "one", "-q")
    assert result.exit_code == 0
    (whole / "control.csv").rename(tmp_path / "given.csv")
    settings = (whole / "project.toml").read_text()
    (whole / "project.toml").write_text(settings.replace("control = 0.01 ", "# "))
    (whole / "distances.csv").unlink()
    lines = (tmp_path / "one" / "adjusted" / "points.csv").read_text()
    assert lines
    missing = run("adjust", "own", "--control", "given.csv")
    assert missing.exit_code == 1
    assert "control in [sd]" in missing.stderr or "standard deviations" in missing.stderr
    done = run("adjust", "own", "--control", "given.csv", "--sd", "control=0.01", "--out", "two", "-q")
    assert done.exit_code == 0, done.output
    one, two = (
        pd.read_csv(tmp_path / name / "points.csv", comment="#").set_index("point") for name in ("one", "two")
    )
    np.testing.assert_allclose(two.loc[one.index, "Z"], one["Z"], atol=0.02)
    assert (two["kind"] == "control").sum() == 4
    free = run(
        "adjust",
        "own",
        "--control",
        "given.csv",
        "--sd",
        "control=0.01",
        "--self-calibrate",
        "f,k1",
        "--out",
        "three",
    )
    assert free.exit_code == 0, free.output
    cameras = pd.read_csv(tmp_path / "three" / "cameras.csv").set_index("parameter")
    assert (cameras.loc[["f", "k1"], "sd"] > 0).all()
    for words, say in (
        (["--self-calibrate", "k9"], "the parameter of a camera 'k9' is unknown"),
        (["--sd", "images=0"], "must be positive"),
        (["--sd", "size=1"], "--sd size=1"),
        (["--control", "own/gnss.csv"], "column point"),
    ):
        refused = run("adjust", "own", *words)
        assert refused.exit_code == 1, refused.output
        assert say in refused.stderr


def test_a_blunder_is_said_and_taken_out(run, tmp_path):
    run("new", "own")
    path = tmp_path / "own" / "images.csv"
    lines = path.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("DJI_0105,t24,"))
    photo, point, column, height = lines[row].split(",")
    lines[row] = f"{photo},{point},{float(column) + 30!r},{height}"
    path.write_text("\n".join(lines) + "\n")
    plain = run("adjust", "own")
    assert plain.exit_code == 4, plain.output
    done = run("adjust", "own", "--snoop", "--out", "out")
    assert done.exit_code in (0, 4), done.output
    removed = pd.read_csv(tmp_path / "out" / "removed.csv")
    assert any("t24" in name and "DJI_0105" in name for name in removed["name"])
    for datum in ("control", "minimum"):
        done = run("adjust", "own", "--snoop", "--datum", datum, "--out", "chosen", "-q")
        assert done.exit_code in (0, 4), done.output
        assert any("t24" in name for name in pd.read_csv(tmp_path / "chosen" / "removed.csv")["name"])
    checked = run("check", "own")
    assert "t24" in checked.output


def test_snooping_follows_the_datum_and_replaces_the_loss_of_a_project(run, tmp_path):
    run("new", "own")
    own = tmp_path / "own"
    for name in ("control", "gnss", "distances"):
        (own / f"{name}.csv").unlink()
    settings = (own / "project.toml").read_text()
    (own / "project.toml").write_text(
        settings.replace("[adjust]", '[adjust]\ndatum = "inner"\nloss = "huber"')
        .replace('\nloss = "none"', "")
        .replace('\ndatum = "control"', "")
    )
    lines = (own / "images.csv").read_text().splitlines(keepends=True)
    row = next(k for k, line in enumerate(lines) if line.startswith("DJI_0105,t24,"))
    (own / "images.csv").write_text("".join([*lines[:row], *lines[row + 1 :]]))
    assert run("adjust", "own", "--loss", "none", "--out", "without", "-q").exit_code in (0, 4)
    photo, point, column, height = lines[row].strip().split(",")
    lines[row] = f"{photo},{point},{float(column) + 30!r},{height}\n"
    (own / "images.csv").write_text("".join(lines))
    done = run("adjust", "own", "--snoop", "--out", "out")
    assert done.exit_code in (0, 4), done.output
    report = (tmp_path / "out" / "report.txt").read_text()
    record = 1 + (own / "project.toml").read_text().splitlines().index('loss = "huber"')
    assert f"project.toml, record {record}: loss in [adjust]" in report
    assert "inner constraints" in report
    assert pd.read_csv(tmp_path / "out" / "removed.csv")["name"].str.contains("t24").all()
    points, others = (
        pd.read_csv(tmp_path / name / "points.csv", comment="#").set_index("point")
        for name in ("out", "without")
    )
    np.testing.assert_allclose(points[["X", "Y", "Z"]], others.loc[points.index, ["X", "Y", "Z"]], atol=1e-6)


def test_options_that_cannot_be_combined_are_those_that_were_typed(run):
    run("new", "own")
    for words, typed in (
        (("adjust", "own", "--snoop", "--parts", 2), "--parts"),
        (("adjust", "own", "--ordering", "rcm", "--memory", "1GB"), "--memory"),
        (("adjust", "own", "--photos-crs", "EPSG:4326"), "--photos-dir"),
        (("collection", "--example", "--snoop", "--loss", "huber"), "--loss"),
        (("calibrate", "--example", "--snoop", "--loss", "huber"), "--loss"),
    ):
        refused = run(*words)
        assert refused.exit_code == 2, refused.output
        named = set(re.findall(r"--[a-z-]+", " ".join(refused.stderr.split("Error")[-1].split())))
        assert typed in named
        assert named <= {typed, *map(str, words)}


def test_the_number_of_iterations_is_an_option_and_a_key(run, tmp_path):
    run("new", "own")
    few = run("adjust", "own", "--iterations", 1, "--out", "few", "--json", "few.json", "-q")
    assert few.exit_code == 3, few.output
    document = json.loads((tmp_path / "few.json").read_text())
    assert document["status"] == "not converged"
    assert len(document["iterations"]) == 1
    assert "iterations = 1\n" in (tmp_path / "few" / "adjusted" / "project.toml").read_text()
    path = tmp_path / "own" / "project.toml"
    settings = path.read_text()
    assert "[adjust]" in settings
    path.write_text(settings.replace("[adjust]", "[adjust]\niterations = 1"))
    assert formats.read(tmp_path / "own").options.max_iterations == 1
    assert run("adjust", "own", "-q").exit_code == 3
    assert run("adjust", "own", "--iterations", 20, "-q").exit_code == 0
    for wrong in ("0", "1.5", "true", '"ten"'):
        path.write_text(settings.replace("[adjust]", f"[adjust]\niterations = {wrong}"))
        refused = run("info", "own")
        assert refused.exit_code == 1
        assert "project.toml, record" in refused.stderr.replace("\n", " ")


def test_what_a_format_cannot_hold_is_listed(run, tmp_path):
    run("new", "own")
    done = run("convert", "own", "other")
    assert done.exit_code == 0
    assert "Lost, as the format has no place for it\n  nothing" in done.output
    assert run("convert", "own", "other", "--to", "nothing").exit_code == 1
    assert {path.name for path in (tmp_path / "other").iterdir()} >= {
        "project.toml",
        "images.csv",
        "gnss.csv",
    }


@pytest.mark.parametrize("command", ["adjust", "info"])
def test_nothing_goes_over_what_is_read(run, tmp_path, command):
    run("new", "own")
    before = (tmp_path / "own" / "images.csv").read_bytes()
    done = run(command, "own", "--json", "own/images.csv")
    assert done.exit_code == 1
    assert "over the input" in done.stderr
    assert (tmp_path / "own" / "images.csv").read_bytes() == before


def test_the_unit_variance_of_redundancy_numbers(run, tmp_path):
    """With weak stations `free` counts unknowns that their observations determine."""
    assert run("new", "own").exit_code == 0
    done = run("adjust", "own", "--unit-variance", "redundancy", "--json", "result.json", "--quiet")
    assert done.exit_code == 0, done.output
    result = adjust(formats.read(tmp_path / "own").block, unit_variance="redundancy")
    document = json.loads((tmp_path / "result.json").read_text())
    assert document["unit_variance"] == "redundancy"
    assert document["variance_of_unit_weight"] == pytest.approx(result.variance_of_unit_weight)
    assert (
        'unit_variance = "redundancy"'
        in (tmp_path / "own-adjusted" / "adjusted" / "project.toml").read_text()
    )
    again = run("adjust", "own-adjusted/adjusted", "--out", "again", "--json", "again.json", "--quiet")
    assert again.exit_code == 0, again.output
    assert json.loads((tmp_path / "again.json").read_text())["unit_variance"] == "redundancy"
