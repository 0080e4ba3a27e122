"""`photogram adjust` in parts."""

import re
from dataclasses import fields
from inspect import signature

import numpy as np
import pandas as pd
import pytest
from test_blocks import agrees, freed
from test_parts import tied_block
from test_streamed import project_of
from typer.testing import CliRunner

import photogram
from photogram import adjust, adjust_in_parts, read_result
from photogram.cli import app
from photogram.cli.adjust import TAKEN
from photogram.cli.options import option_name
from photogram.distributed import Division
from photogram.formats import ReadOptions, read


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    return project_of(tied_block(), tmp_path_factory.mktemp("project") / "tied")


def called(*arguments, code=0):
    found = CliRunner().invoke(app, ["adjust", *map(str, arguments)])
    assert found.exit_code == code, found.output
    return found.output


def test_the_example_in_parts_has_the_report_of_one_process(tmp_path):
    called("--example", "--parts", 2, "--out", tmp_path / "parts")
    called("--example", "--out", tmp_path / "whole")
    one, other = ((tmp_path / each / "report.txt").read_text() for each in ("parts", "whole"))
    assert "in parts, and the separators between them" in one
    pattern = r"sigma0 .*|degrees of freedom .*|rms of .*|mean redundancy .*"
    assert re.findall(pattern, one) == re.findall(pattern, other)
    assert len(re.findall(pattern, one)) > 4


def test_a_datum_is_that_of_one_process(tmp_path):
    block = freed(photogram.simulate(strips=2, photos_per_strip=8, points_per_photo=40, seed=3).block)
    project = project_of(block, tmp_path / "free")
    said = called(project, "--parts", 2, "--out", tmp_path / "batches", code=1)
    assert f"{project / 'project.toml'}: " in said
    assert "photogram.adjust_in_parts" in said
    # With its images in CSV it is read whole.
    pd.read_parquet(project / "images.parquet").to_csv(project / "images.csv", index=False)
    (project / "images.parquet").unlink()
    called(project, "--parts", 2, "--datum", "inner", "--plan", "--run", tmp_path / "run")
    called(project, "--parts", 2, "--datum", "inner", "--run", tmp_path / "run", "--out", tmp_path / "parts")
    called(project, "--datum", "inner", "--out", tmp_path / "whole")
    one, other = ((tmp_path / each / "report.txt").read_text() for each in ("parts", "whole"))
    pattern = r".*inner constraints over .*|sigma0 .*|rms of .*"
    assert re.findall(pattern, one) == re.findall(pattern, other)
    assert "inner constraints over" in one


def test_a_loss_is_that_of_one_process(tmp_path):
    """Where it weights something, the report says of how many images, the same in both ways."""
    for name, parts in (("parts", ["--parts", 2]), ("whole", [])):
        called("--example", *parts, "--loss", "cauchy", "--out", tmp_path / name)
    one, other = ((tmp_path / each / "report.txt").read_text() for each in ("parts", "whole"))
    pattern = r"Cauchy loss of scale .*|sigma0 .*|degrees of freedom .*"
    assert re.findall(pattern, one) == re.findall(pattern, other)
    assert "Cauchy loss" in one


def test_a_plan_adjusts_nothing(tmp_path, project):
    text = called(project, "--parts", 4, "--plan", "--out", tmp_path / "out")
    assert re.search(r"parts +4 \(3 separators\)", text)
    assert not (tmp_path / "out" / "report.txt").exists()
    refused = called(project, "--parts", 4, "--memory", "1MB", "--plan", "--out", tmp_path / "out", code=1)
    assert "the largest node requires" in refused


def test_a_project_on_disk_is_adjusted_without_being_read_whole(tmp_path, project):
    text = called(project, "--parts", 3, "--out", tmp_path / "out")
    assert re.search(r"status +converged \(\d+ iterations\)", text)
    given = read(project)
    whole = adjust(given.block, unit_variance=given.options.unit_variance)
    photos, points = {}, {}
    folders = sorted((tmp_path / "out" / "run" / "results").iterdir())
    assert len(folders) == 5
    for folder in folders:
        found = read_result(folder)
        photos |= dict(zip(found.block.photo_ids, found.photo_positions, strict=True))
        points |= dict(zip(found.block.point_ids, found.point_positions, strict=True))
        assert found.variance_of_unit_weight == pytest.approx(whole.variance_of_unit_weight, rel=1e-9)
    sd = np.sqrt(np.diagonal(whole.photo_cofactors, axis1=1, axis2=2))[:, :3]
    own = np.array([photos[name] for name in whole.block.photo_ids])
    assert np.abs((own - whole.photo_positions) / sd).max() < 1e-6
    own = np.array([points[name] for name in whole.block.point_ids])
    used = whole.point_rays > 0
    np.testing.assert_allclose(own[used], whole.point_positions[used], rtol=0, atol=1e-6)
    # The same command finds everything done, and says the same.
    again = called(project, "--parts", 3, "--out", tmp_path / "out")
    assert len(re.findall(r"status +converged", again)) == 1


REFUSED = {
    "--datum": "control",
    "--hold": "A=XYZ",
    "--self-calibrate": "all",
    "--snoop": None,
    "--level": 0.01,
    "--max-bias-ratio": 4,
    "--fdr": 0.1,
    "--unit-weight": "unknown",
    "--statement": None,
    "--strict": None,
    "--ordering": "amd",
    "--json": "found.json",
    "--xlsx": "found.xlsx",
    "--html": "found.html",
    "--plots": None,
    "--plot-format": "svg",
    "--parquet": "found",
    "--crs": "EPSG:25832",
    "--map": "found.svg",
    "--ply": "found.ply",
    "--ply-origin": [1, 0, 0],
}


def test_every_option_is_taken_or_refused_of_a_project_on_disk():
    """What is read batch by batch left options out without a word; whoever adds one decides what it does."""
    of_files = {each.name for each in fields(ReadOptions)}
    command = next(each for each in app.registered_commands if each.callback.__name__ == "adjust")
    options = {
        option_name(each)
        for each in signature(command.callback).parameters.values()
        if each.name not in of_files | {"path", "example"}
    }
    of_statements = {
        "--project",
        "--client",
        "--firm",
        "--surveyor",
        "--title",
        "--date",
        "--class-h",
        "--class-v",
    }
    assert options == REFUSED.keys() | of_statements | TAKEN - {"PATH", "--set", "--sd"}
    assert not REFUSED.keys() & TAKEN


@pytest.mark.parametrize("option", REFUSED)
def test_what_is_not_done_of_a_project_on_disk_is_refused(tmp_path, project, option):
    given = REFUSED[option]
    value = given if isinstance(given, list) else [] if given is None else [given]
    value = [tmp_path / each if str(each).startswith("found") else each for each in value]
    said = called(project, "--parts", 3, option, *value, "--out", tmp_path / "out", code=2)
    words = " ".join(said.replace("│", " ").split())
    assert f"Invalid value for {option}: must not be combined with --parts" in words
    assert not (tmp_path / "out" / "report.txt").exists()


@pytest.mark.parametrize("option", [["--snoop"], ["--ordering", "amd"]])
@pytest.mark.parametrize("plan", [[], ["--plan"]])
def test_options_that_exclude_parts_are_refused_before_the_project_is_read(tmp_path, option, plan):
    (tmp_path / "project.toml").write_text("not a project")
    said = called(tmp_path, "--parts", 3, *option, *plan, "--out", tmp_path / "out", code=2)
    assert f"Invalid value for {option[0]}: must not be combined with --parts" in " ".join(said.split())


@pytest.mark.parametrize(
    "words", ["--loss huber", "--set adjust.loss=huber", "--sd control=0.5 --loss huber"]
)
@pytest.mark.parametrize("parts", [["--parts", 3], ["--parts", 3, "--plan"]])
def test_settings_of_the_user_do_not_read_a_project_on_disk_as_a_whole(tmp_path, project, words, parts):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("photogram.cli.adjust.read_project", None)
        called(project, *parts, *words.split(), "--keep-all", "--out", tmp_path / "out")
    if len(parts) == 2:
        nodes = [read_result(each) for each in (tmp_path / "out" / "run" / "results").iterdir()]
        assert any((each.image_weights < 1).any() for each in nodes)


@pytest.mark.parametrize(("said", "option"), [("huber", None), ("none", "huber"), ("huber", "none")])
def test_a_project_on_disk_is_adjusted_with_the_loss_that_is_chosen(tmp_path, said, option):
    given = project_of(tied_block(), tmp_path / "robust")
    settings = given / "project.toml"
    settings.write_text(settings.read_text().replace('loss = "none"', f'loss = "{said}"'))
    assert (read(given).options.loss or "none") == said
    chosen = ["--loss", option] if option else []
    called(given, "--parts", 3, "--keep-all", *chosen, "--out", tmp_path / "out")
    nodes = [read_result(each) for each in sorted((tmp_path / "out" / "run" / "results").iterdir())]
    loss = option or said
    whole = adjust(read(given).block, loss=None if loss == "none" else loss)
    weights = np.sort(np.concatenate([each.image_weights for each in nodes]))
    np.testing.assert_allclose(weights, np.sort(whole.image_weights), rtol=0, atol=1e-6)
    assert (weights < 1).any() == (loss == "huber")


@pytest.mark.parametrize("chosen", ["unity", "constrained", "redundancy"])
def test_the_unit_variance_of_a_project_on_disk_is_chosen(tmp_path, project, chosen):
    called(project, "--parts", 2, "--unit-variance", chosen, "--keep-all", "--out", tmp_path / "out")
    found = read_result(min((tmp_path / "out" / "run" / "results").iterdir()))
    assert found.unit_variance == chosen
    whole = adjust(read(project).block, unit_variance=chosen)
    assert found.variance_of_unit_weight == pytest.approx(whole.variance_of_unit_weight, rel=1e-9)


def test_two_workers_give_the_bits_of_parts_one_after_the_other():
    block = photogram.simulate(strips=4, photos_per_strip=12, points_per_photo=30, seed=5).block
    divisions = Division(parts=4), Division(parts=4, cluster="local", workers=2)
    one, other = (adjust_in_parts(block, division) for division in divisions)
    for name in ("photo_positions", "photo_cofactors", "point_cofactors", "redundancy", "standardized"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    agrees(other, adjust(block))
