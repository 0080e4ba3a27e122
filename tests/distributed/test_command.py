"""`photogram adjust` in parts."""

import re

import numpy as np
import pytest
from test_blocks import agrees
from test_parts import tied_block
from test_streamed import project_of
from typer.testing import CliRunner

import photogram
from photogram import adjust, adjust_in_parts, read_result
from photogram.cli.commands import app
from photogram.distributed import Division
from photogram.formats import read


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
    assert "photos eliminated in parts, and the separators between them" in one
    pattern = r"sigma0 .*|degrees of freedom .*|rms of .*|mean redundancy .*"
    assert re.findall(pattern, one) == re.findall(pattern, other)
    assert len(re.findall(pattern, one)) > 4


@pytest.mark.parametrize("chosen", [("--loss", "huber"), ("--datum", "inner")])
def test_neither_loss_nor_datum_are_chosen_in_parts(tmp_path, chosen):
    said = called("--example", "--parts", 2, *chosen, "--out", tmp_path / "out", code=1)
    assert "in parts there is no loss and no datum to choose" in said


def test_a_plan_adjusts_nothing(tmp_path, project):
    text = called(project, "--parts", 4, "--plan", "--out", tmp_path / "out")
    assert "4 parts and 3 separators for 1 workers" in text
    assert not (tmp_path / "out" / "report.txt").exists()
    refused = called(project, "--parts", 4, "--memory", "1MB", "--plan", "--out", tmp_path / "out", code=1)
    assert "a separator alone takes" in refused or "parts would fit" in refused


def test_a_project_on_disk_is_adjusted_without_being_read_whole(tmp_path, project):
    text = called(project, "--parts", 3, "--out", tmp_path / "out")
    assert "converged after" in text
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
    assert called(project, "--parts", 3, "--out", tmp_path / "out").count("converged after") == 1


def test_two_workers_give_the_bits_of_parts_one_after_the_other():
    block = photogram.simulate(strips=4, photos_per_strip=12, points_per_photo=30, seed=5).block
    divisions = Division(parts=4), Division(parts=4, cluster="local", workers=2)
    one, other = (adjust_in_parts(block, division) for division in divisions)
    for name in ("photo_positions", "photo_cofactors", "point_cofactors", "redundancy", "standardized"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    agrees(other, adjust(block))
