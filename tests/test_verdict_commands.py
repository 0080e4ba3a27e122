"""The verdict as commands end by it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import nested_codes
from photogram import Camera, adjust, diagnose, formats, simulate
from photogram.cli import app
from photogram.giant import Project, read_project, write_project
from photogram.network.equivalent_cameras import with_parameters
from photogram.words import Phrase


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, [str(each) for each in arguments])


@pytest.fixture
def project(run, tmp_path):
    """Return a block whose images have standard deviations of half the size."""
    assert run("simulate", "block", "--strips", 2, "--photos-per-strip", 4, "--seed", 5).exit_code == 0
    block = read_project(tmp_path / "block").to_block()
    write_project(Project.from_block(block.replace(image_sd=block.image_sd / 2)), tmp_path / "half")
    return tmp_path / "half"


def test_warnings_count_where_they_are_asked_to(run, project):
    done = run("giant", project, "--json", "result.json")
    assert done.exit_code == 0, done.output
    assert "\nVerdict\n  Weights too optimistic" in done.output
    document = json.loads(Path("result.json").read_bytes())["verdict"]
    assert (document["code"], document["exit"], document["warning"]) == ("weights", 0, True)
    assert run("giant", project, "--strict", "--quiet").exit_code == 4
    assert "Verdict\n-------\nWeights too optimistic" in Path("half-adjusted", "report.txt").read_text()


def test_gross_errors_and_weights_together(run, project, tmp_path):
    """Ten gross errors, and standard deviations of half the size: weights change, and only the errors go."""
    block = read_project(project).to_block()
    xy = block.image_xy.copy()
    bad = np.flatnonzero(adjust(block).redundancy.min(axis=1) > 0.3)[::60][:10]
    xy[bad] += 0.3
    write_project(Project.from_block(block.replace(image_xy=xy)), tmp_path / "wrong")
    done = run(
        "giant", tmp_path / "wrong", "--snoop", "--components", "kind", "--json", "result.json", "--out", "o"
    )
    assert done.exit_code == 0, done.output
    document = json.loads(Path("result.json").read_bytes())
    names = {
        f"image of point {block.point_ids[block.image_points[row]]} on photo"
        f" {block.photo_ids[block.image_photos[row]]}"
        for row in bad.tolist()
    }
    assert {entry["name"] for entry in document["verdict"]["removed"]} == names
    assert 0.8 < document["variance_of_unit_weight"] < 1.25
    text = " ".join(Path("o", "components.txt").read_text().split())
    factor = float(re.search(r"[Ss]tandard deviations of [^:]+: multiplied by (\d+\.\d+)", text)[1])
    assert factor == pytest.approx(2.0, rel=0.1)
    assert f"multiplied by {factor:.3f}" in done.output


def test_a_hint_heads_the_verdict():
    block = simulate(strips=2, photos_per_strip=4, seed=5).block
    mirrored = block.replace(image_xy=block.image_xy * [1.0, -1.0])
    plain = adjust(mirrored)
    assert plain.hints == ()
    assert plain.verdict.exit
    checks = [step.fields["check"] for step in plain.verdict.next if "check" in step.fields]
    assert Phrase("how.check.network") in checks
    found = diagnose(mirrored, plain)
    down = found.result
    assert found.verdict.headline == down.verdict.headline
    assert [each.text for each in found.grave] == list(down.hints) != []
    assert down.verdict.hints == down.hints
    assert down.verdict.exit in (3, 4)
    assert any("y of the images has the wrong sign" in hint for hint in down.verdict.hints)
    assert "line.hints" in {line.code for line in down.verdict.lines}
    good = adjust(block)
    assert good.hints == good.verdict.hints == ()


def test_a_check_ends_with_a_verdict():
    block = simulate(strips=2, photos_per_strip=4, seed=5).block
    good = diagnose(block)
    assert (good.verdict.exit, bool(good.grave)) == (0, False)
    assert good.verdict.tests == good.result.verdict.tests
    down = diagnose(block.replace(image_xy=block.image_xy * [1.0, -1.0]))
    assert (down.verdict.code, down.verdict.exit) == ("hint", 3)
    assert json.loads(down.to_json())["verdict"]["headline"] == down.verdict.headline
    xy = block.image_xy.copy()
    xy[int(np.argmax(adjust(block).redundancy[:, 0])), 0] += 1.0
    assert diagnose(block.replace(image_xy=xy)).verdict.code == "gross-errors"


@pytest.mark.parametrize(
    ("arguments", "sets"),
    [
        (("collection", "--example"), None),
        (("absolute-orientation", "--example"), None),
        (("perspective-center", "--example"), "sets"),
    ],
)
def test_examples_can_be_used(run, arguments, sets):
    done = run(*arguments, "--json", "result.json", "--out", "o")
    assert done.exit_code == 0, done.output
    document = json.loads(Path("result.json").read_bytes())
    for one in document[sets] if sets else [document]:
        assert one["verdict"]["exit"] == 0
        assert one["verdict"]["tests"]
        assert one["verdict"]["headline"].partition("\n")[0] in done.output


def test_a_comparator_has_a_verdict(run):
    done = run("comparator", "--example", "--out", "o", "--json", "result.json", "--no-plots", "--date", "x")
    assert done.exit_code == 0, done.output
    text = Path("result.json").read_text()
    assert '"verdict"' in text
    assert "\nVerdict\n" in done.output


def test_stars_have_a_verdict(run):
    pytest.importorskip("erfa")
    done = run("stellar-camera", "--example", "--out", "o", "--json", "result.json")
    assert done.exit_code == 0, done.output
    document = json.loads(Path("result.json").read_bytes())["verdict"]
    names = [test["name"].partition(":")[0] for test in document["tests"]]
    assert {str(Phrase("stars.plate-coordinates")), str(Phrase("stars.places"))} <= set(names)


def test_a_wrong_term_of_a_lens_is_named_and_not_removed(run, tmp_path):
    """Sixty observations look gross where one lens is wrong; snooping ends as the command that says so."""
    lens = Camera("brown", {"c": -152.74, "K1": 1e-7})
    nominal = Camera("brown", {"c": -152.74})
    block = simulate(
        strips=3, photos_per_strip=5, cameras=[lens], start_cameras=[nominal], position_sd=0.1, seed=5
    ).block
    found = adjust(block)
    assert (found.verdict.code, found.verdict.exit) == ("common-error", 4)
    error, *others = found.verdict.message.fields["errors"]
    assert (error.code, error.fields["named"].fields["parameters"], others) == ("common.error", ["K1"], [])
    page = found.document()
    assert [each.code for each in page.advice] == ["advice.correct-common"]
    words = " ".join(map(str, [found.verdict.headline, *found.verdict.lines, *page.advice]))
    assert "photogram.snoop" not in words
    assert "gross" not in words.lower()
    looked = diagnose(block)
    assert [each.kind for each in looked.grave] == ["common-error"]
    assert "K1 of camera 1" in looked.grave[0].text
    # A wrong observation is still one, and no lens.
    good = block.replace(cameras=[lens])
    xy = good.image_xy.copy()
    xy[int(np.argmax(adjust(good).redundancy[:, 0])), 0] += 2.0
    assert adjust(good.replace(image_xy=xy)).verdict.code == "gross-errors"
    positions = good.point_positions.copy()
    held = np.flatnonzero(np.isfinite(good.point_sd).all(axis=1))
    positions[held[1]] += [30.0, 0.0, 10.0]
    assert adjust(good.replace(point_positions=positions)).verdict.code == "gross-errors"


@pytest.mark.parametrize(
    ("model", "principal", "advice"),
    [
        ("pinhole", ("fx", "fy"), "f,cx,cy,k1,k2,p1,p2"),
        ("simple_pinhole", ("f",), "f,cx,cy,k1,k2"),
    ],
)
@pytest.mark.parametrize("free", [False, True])
def test_a_pinhole_with_distorted_images_gets_lens_terms(run, tmp_path, model, principal, advice, free):
    """Its own parameters explain nothing: the advice names terms of a model that contains it."""
    interior = dict.fromkeys(principal, 3000.0) | {"cx": 2000.0, "cy": 2000.0}
    lens = Camera("opencv", dict.fromkeys(("fx", "fy"), 3000.0) | {"cx": 2000, "cy": 2000, "k1": -0.02})
    nominal = Camera(model, interior, dict.fromkeys(interior, np.inf if free else 0.0), name="camera")
    sizes = {"frame_size": 4000.0, "principal_distance": 3000.0, "image_sd": 0.5, "position_sd": 0.1}
    block = simulate(
        strips=3, photos_per_strip=5, cameras=[lens], start_cameras=[nominal], seed=5, **sizes
    ).block
    found = adjust(block)
    assert found.verdict.code == "model"
    assert found.verdict.message.fields["remedy"].fields["how"].fields == {"names": advice}
    assert Phrase("advice.calibrate", {"names": advice}) in found.verdict.next
    looked = diagnose(block)
    assert [each.kind for each in looked.grave] == ["common-error"]
    assert "hypothesis.camera-radial" in nested_codes(looked.grave[0])
    project = formats.Project(
        block=block,
        path=tmp_path,
        title="",
        sizes=(None,),
        pixel_mm=(None,),
        starts=np.full(block.point_positions.shape, np.nan),
    )
    for name, content in formats.to_files(project, "plain").items():
        (tmp_path / "block" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "block" / name).write_bytes(content)
    done = run("adjust", "block", "--self-calibrate", advice, "--json", "result.json", "-q")
    assert done.exit_code in (0, 4), done.output
    document = json.loads(Path("result.json").read_bytes())
    assert document["verdict"]["code"] != "model"
    [camera] = document["cameras"]
    [k1] = [each for each in camera["parameters"] if each["name"] == "k1"]
    assert abs(k1["value"] + 0.02) < 5 * k1["sd"]


def test_a_camera_without_distortion_keeps_its_images_in_a_wider_model():
    directions = np.array([[0.1, 0.2, -1.0], [-0.3, 0.1, -2.0], [0.0, 0.0, -1.0]])
    interior = {"f": 900.0, "cx": 500.0, "cy": 400.0}
    for model, parameters, words in (
        ("perspective", {"c": -150.0}, ["k1"]),
        ("simple_pinhole", interior, ["k1"]),
        ("simple_pinhole", interior, ["p1"]),
        ("simple_radial", interior | {"k": 0.02}, ["k2"]),
        ("simple_fisheye", interior, ["k1"]),
        ("opencv", {"fx": 900.0, "fy": 905.0, "cx": 500.0, "cy": 400.0, "k1": 0.01, "p1": 1e-4}, ["k3"]),
    ):
        camera = Camera(model, parameters, dict.fromkeys(parameters, 0.5))
        wider = with_parameters(camera, words)
        assert wider.model != model
        assert words[0] in [name.lower() for name in wider.names]
        np.testing.assert_allclose(wider.project(directions), camera.project(directions), rtol=1e-12)
        assert (wider.deviations > 0).sum() >= len(parameters)
    kept = Camera("simple_pinhole", interior, covariance=(["f"], [[0.25]]))
    assert with_parameters(kept, ["k1"]) is kept


def test_snooping_ends_by_the_verdict_that_it_prints(run, project):
    block = read_project(project).to_block()
    xy = block.image_xy.copy()
    xy[::9] += np.random.default_rng(2).normal(scale=0.4, size=xy[::9].shape)
    write_project(Project.from_block(block.replace(image_xy=xy, image_sd=2 * block.image_sd)), Path("spoilt"))
    done = run("adjust", "spoilt", "--snoop", "--json", "result.json", "--out", "o")
    document = json.loads(Path("result.json").read_bytes())["verdict"]
    assert document["code"] == "too-much-removed"
    assert done.exit_code == document["exit"] == 4, done.output
    assert done.output.count("\nVerdict\n") == 1
    text = Path("o", "report.txt").read_text()
    assert text.count("\nVerdict\n") == 1
    page = Path("o", "report.html").read_text()
    assert "Not to be used as it is" in page
    assert "they can be used" not in page
