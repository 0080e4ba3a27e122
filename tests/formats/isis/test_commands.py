"""Commands on control networks, and the example."""

import numpy as np
import pytest
from typer.testing import CliRunner

from example_scripts import load
from photogram.cli import app


def run(*words):
    return CliRunner().invoke(app, [str(each) for each in words])


@pytest.fixture
def given(pair):
    return pair.folder / "pair.net", "--cubes", pair.folder / "images.lis"


def test_a_network_is_adjusted_by_a_command(given, pair, tmp_path):
    settings = ("--jigsaw", pair.folder / "settings.txt")
    done = run("adjust", *given, *settings, "--out", tmp_path / "out", "--sd", "images=0.0028")
    assert done.exit_code == 0, done.output
    assert "Accepted" in done.output
    assert "format plain project is not written" in done.output
    own = tmp_path / "out" / "adjusted-isis"
    names = {"bundleout.txt", "images.csv", "points.csv", "residuals.csv", "pair.net", "support"}
    assert {each.name for each in own.iterdir()} == names
    assert not (tmp_path / "out" / "adjusted").exists()


def test_gross_errors_are_taken_out_and_rejected(pair, tmp_path):
    # Along the flight: across it a wrong measure is a wrong height.
    line = np.array(pair.network.measures.line)
    line[30] += 20.0
    project = pair.project("settings.txt", pair.with_measures(line=line))
    where = (project.path, "--cubes", pair.folder / "images.lis", "--jigsaw", pair.folder / "settings.txt")
    done = run("adjust", *where, "--out", tmp_path / "out", "--sd", "images=0.0028", "--snoop")
    assert done.exit_code == 0, done.output
    rows = (tmp_path / "out" / "adjusted-isis" / "residuals.csv").read_text().splitlines()
    rejected = [row.split(",")[0] for row in rows if row.endswith("*")]
    assert rejected
    assert set(rejected) == {"point_15"}


def test_other_commands_know_networks(given, tmp_path):
    done = run("info", *given)
    assert done.exit_code == 0, done.output
    assert "control network (ISIS)" in done.output
    assert "1.4 px is assumed" in done.output
    done = run("check", *given, "--out", tmp_path / "checked")
    assert done.exit_code in (0, 3), done.output
    done = run("convert", *given, tmp_path / "there")
    assert done.exit_code == 1
    assert "ORBITER NAC" in done.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ("--jigsaw", "CAMSOLV=all"),
            "'CAMSOLV' is unknown; use an existing name, such as the nearest, 'CAMSOLVE'",
        ),
        (("--jigsaw", "nowhere.txt"), "nowhere.txt: the file must be readable"),
    ],
)
def test_wrong_settings_end_the_command(given, words, sentence):
    done = run("info", *given, *words)
    assert done.exit_code == 1
    assert sentence in " ".join(done.output.split())


def test_settings_need_a_list(given):
    done = run("info", given[0], "--jigsaw", "CAMSOLVE=all")
    assert done.exit_code == 2
    assert "--jigsaw" in done.output
    done = run("info", given[0])
    assert done.exit_code == 1
    assert "--cubes FILE" in " ".join(done.output.split())


def test_the_example_prints_what_was_found(tmp_path, capsys):
    result = load("planetary_pair").main(tmp_path / "pair")
    printed = capsys.readouterr().out
    assert printed.startswith("converged, sigma0 0.4")
    assert len(result.trajectories) == 2
    for name in result.trajectories:
        assert name in printed
