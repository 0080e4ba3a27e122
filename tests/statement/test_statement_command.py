"""The command that states: files, exit codes, what a project asks for."""

import json
import shutil
from pathlib import Path

import pytest
from golden_statement import BLOCK

import photogram
from photogram.formats import read
from photogram.formats.models import in_topocentric
from photogram.words import Phrase

FILES = (
    *("budget.csv", "check_points.csv", "leave_one_out.csv"),
    *("statement.html", "statement.json", "statement.pdf"),
)


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Copy the golden block to where commands run."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(BLOCK, "site")
    for path in Path("site").iterdir():
        path.chmod(0o644)
    return Path("site")


def test_a_project_is_stated_with_all_files(run, site):
    done = run(
        "statement", site, "--class-h", "5cm", "--class-v", "5cm", "--client", "Town", "--date", "2026-11-25"
    )
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in Path("site-statement").iterdir()) == sorted(FILES)
    document = json.loads(Path("site-statement/statement.json").read_text())
    assert (document["exit"], document["client"], document["date"]) == (0, "Town", "2026-11-25")
    assert {each["name"] for each in document["files"]} >= {"control.csv", "images.csv", "project.toml"}
    assert document["command"].startswith("photogram statement")
    assert document["headline"] in Path("site-statement/statement.html").read_text()
    assert document["headline"] in done.output
    assert len(document["budgets"]) == 3


def test_a_result_as_data_is_stated_alike(run, site):
    run("adjust", site, "--out", "out", "--parquet", "data", "--no-html")
    run("statement", site, "--out", "one")
    done = run("statement", "data", "--out", "two")
    assert done.exit_code == 0, done.output
    one, two = (json.loads(Path(each, "statement.json").read_text()) for each in ("one", "two"))
    assert one["figures"]["rmse_h"] == pytest.approx(two["figures"]["rmse_h"], rel=1e-9)
    assert [each["key"] for each in one["sentences"]] == [each["key"] for each in two["sentences"]]


def test_a_missed_class_ends_with_4_and_writes_all(run, site):
    done = run("statement", site, "--class-v", "40mm", "--out", "out")
    assert done.exit_code == 4
    assert "not met" in done.output
    assert sorted(path.name for path in Path("out").iterdir()) == sorted(FILES)


def test_what_the_project_asks_for_holds_unless_an_option_says_else(run, site):
    text = (site / "project.toml").read_text()
    (site / "firm.toml").write_text('"honest.yes" = "Unser Faktor: {factor}."\n')
    (site / "project.toml").write_text(
        text + '\n[check]\nindependent = "yes"\n'
        '[statement]\nclass_h = "5cm"\nlanguage = "de"\nfirm = "Büro"\ntext = "firm.toml"\n'
        'budgets = ["point C08 z"]\n'
    )
    run("statement", site, "--out", "out", "--firm", "Another", "--class-v", "6cm")
    document = json.loads(Path("out/statement.json").read_text())
    assert (document["language"], document["firm"]) == ("de", "Another")
    assert document["asprs"]["class_v_m"] == 0.06
    said = {each["key"]: each["text"] for each in document["sentences"]}
    assert said["honest.yes"].startswith("Unser Faktor: 1,06")
    assert said["asprs.tested.h"].startswith("Mit 30 Kontrollpunkten")
    assert list(document["budgets"]) == ["point C08 z"]
    assert "assume.independent.yes" in {each["key"] for each in document["assumptions"]}


def test_adjust_states_beside_its_report_with_one_exit_code(run, site):
    text = (site / "project.toml").read_text()
    (site / "project.toml").write_text(text + '\n[statement]\nclass_v = "40mm"\n')
    done = run("adjust", site, "--statement", "--out", "out")
    assert done.exit_code == 4
    assert sorted(path.name for path in Path("out/statement").iterdir()) == sorted(FILES)
    assert run("adjust", site, "--out", "other").exit_code == 0


def test_tables_have_a_row_for_each_point_and_source(run, site):
    run("statement", site, "--out", "out", "--without", "C07=target moved", "--budget", "point C08 z")
    lines = [line for line in Path("out/check_points.csv").read_text().splitlines() if line[0] != "#"]
    assert lines[0].startswith("point,cover,east,north,up,d_e,d_n,d_h,sd_e,sd_n,sd_h,sd_adjusted_e")
    assert lines[0].endswith("T,p,T_from_the_others,ce90_predicted,le90_predicted,used,reason")
    assert len(lines) == 31
    assert lines[7].startswith("C07,open,")
    assert lines[7].endswith(",no,target moved")
    budget = Path("out/budget.csv").read_text().splitlines()
    assert budget[0] == ("quantity,unit,value,u,level,source,number,u_k,share,sensitivity,sd,dof,taken_from")
    levels = {line.split(",")[4] for line in budget[1:]}
    assert levels == {"kind", "strip", "camera", "photo", "point", "parameter", "observation"}
    left = Path("out/leave_one_out.csv").read_text().splitlines()
    assert len(left) == 10


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--class-h", "5"], "a length must have a unit"),
        (["--class-h", "5 parsec"], "'parsec'"),
        (["--area", "5m"], "an area must have a unit"),
        (["--without", "C07"], "POINT="),
        (["--standard", "din"], "'din'"),
        (["--budget", "point C99 z"], "'C99'"),
        (["--text", "missing.toml"], "missing.toml"),
        (["--sd", "checks=1"], "rates, bases, check; write it as images=0.5"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_written(run, site, options, said):
    done = run("statement", site, "--out", "out", *options)
    assert done.exit_code in (1, 2)
    assert said in " ".join(done.output.split())
    assert not Path("out").exists()


def test_coordinates_stand_in_the_system_of_the_client(run, site):
    crs = pytest.importorskip("pyproj")
    assert crs
    text = (site / "project.toml").read_text()
    frame = '\n[frame]\nkind = "topocentric"\norigin = [48.0, 9.0, 500.0]\n'
    (site / "project.toml").write_text(text + frame)
    done = run("statement", site, "--out", "out", "--crs", "EPSG:32632")
    assert done.exit_code == 0, done.output
    row = next(
        line for line in Path("out/check_points.csv").read_text().splitlines() if line.startswith("C01")
    )
    east, north = (float(each) for each in row.split(",")[2:4])
    assert abs(east - 500000) < 200
    assert 5.3e6 < north < 5.4e6
    assert "EPSG:32632" in Path("out/statement.html").read_text()


def test_longitudes_and_latitudes_are_stated_as_a_local_frame_is(run, tmp_path, monkeypatch):
    """D and C are turned to east, north, up at each point: the same figures in both kinds of space."""
    monkeypatch.chdir(tmp_path)
    shape = ("--strips", "3", "--photos-per-strip", "5", "--check-points", "25", "--seed", "2")
    assert run("simulate", "flight", *shape, "--spheroid", "wgs84").exit_code == 0
    earth = read("flight")
    found = []
    for project in (earth, in_topocentric(earth)):
        result = photogram.adjust(project.block, unit_variance="unity")
        found.append(result.statement(sd=(0.05, 0.06, 0.08), budgets=()))
    assert found[0].result.geographic
    assert not found[1].result.geographic
    one, other = (each.figures for each in found)
    assert one["prediction"]["all"]["T"] == pytest.approx(other["prediction"]["all"]["T"], rel=1e-4)
    assert one["rmse"] == pytest.approx(other["rmse"], rel=2e-3)
    for first, second in zip(found[0].leave_one_out, found[1].leave_one_out, strict=True):
        assert first["point"] == second["point"]
        assert first["T"] == pytest.approx(second["T"], rel=1e-3)
        assert first["rank"] == second["rank"]


def test_info_says_in_a_line_what_would_be_stated(run, site):
    assert "Accuracy statement" not in run("info", site).output
    text = (site / "project.toml").read_text()
    (site / "project.toml").write_text(text + '\n[statement]\nclass_h = "5cm"\nclass_3d = "12cm"\n')
    done = run("info", site, "--json", "info.json")
    stated = json.loads(Path("info.json").read_text())["statement"]
    assert stated["standards"] == ["asprs-2023", "plain"]
    assert stated["classes"] == {"h": 0.05, "3d": 0.12}
    assert (stated["check_points"], stated["calibrated_lengths"], stated["budgets"]) == (30, 0, None)
    said = "Accuracy statement standards asprs-2023, plain classes horizontal 5 cm, 3D 12 cm check points 30"
    assert f"{said} budgets three that are chosen" in " ".join(done.output.split())
    (site / "lengths.csv").write_text("line,from,to,length,sd\na,C01,C30,230.0,0.001\n")
    asked = '\n[statement]\nstandards = ["vdi-2634"]\nbudgets = ["point C08 z", "distance C01 C30"]\n'
    (site / "project.toml").write_text(text + asked)
    run("info", site, "--json", "info.json")
    stated = json.loads(Path("info.json").read_text())["statement"]
    assert (stated["standards"], stated["classes"]) == (["vdi-2634"], {})
    assert (stated["check_points"], stated["calibrated_lengths"]) == (30, 1)
    assert stated["budgets"] == ["point C08 z", "distance C01 C30"]
    (site / "project.toml").write_text(text + '\n[check]\nindependent = "yes"\n')
    assert "classes none check points 30" in " ".join(run("info", site).output.split())


def test_a_result_as_data_is_stated_as_the_project_asks_in_whose_folder_it_lies(run, site, monkeypatch):
    text = (site / "project.toml").read_text()
    asked = '\n[check]\nindependent = "yes"\n[statement]\nclass_h = "5cm"\nclient = "Town"\nlanguage = "de"\n'
    (site / "project.toml").write_text(text + asked)
    assert run("adjust", site, "--out", "out", "--parquet", site / "data", "--no-html").exit_code == 0
    for path, options, client in ((site / "data", (), "Town"), (".", ("--client", "Another"), "Another")):
        done = run("statement", path, "--out", "stated", *options)
        assert done.exit_code == 0, done.output
        document = json.loads(Path("stated/statement.json").read_text())
        assert (document["language"], document["client"]) == ("de", client)
        assert document["asprs"]["class_h_m"] == 0.05
        assert "assume.independent.yes" in {each["key"] for each in document["assumptions"]}
        names = {each["name"] for each in document["files"]}
        assert "project.toml" in names
        assert "control.csv" not in names
        monkeypatch.chdir(site / "data" if path != "." else ".")


def test_settings_beside_a_result_that_are_of_another_block_are_told_and_not_taken(run, site):
    run("adjust", site, "--out", "out", "--parquet", "here/data", "--no-html")
    run("new", "here/other", "--kind", "survey")
    for path in Path("here/other").iterdir():
        shutil.move(path, Path("here", path.name))
    names = Path("here/points.csv").read_text().replace("t046", "t999")
    Path("here/points.csv").write_text(names)
    Path("here/images.csv").write_text(Path("here/images.csv").read_text().replace("t046", "t999"))
    done = run("statement", "here/data", "--out", "stated")
    assert done.exit_code == 0, done.output
    settings = Path("here/project.toml").resolve()
    remark = Phrase("command.other-block", {"settings": str(settings), "folder": "here/data"})
    assert str(remark) in " ".join(done.stderr.split())
    assert json.loads(Path("stated/statement.json").read_text())["client"] is None


@pytest.fixture
def model(run, site):
    """Return the golden block as a COLMAP model, with the options that read its control and accuracies."""
    assert run("convert", site, "model", "--to", "colmap").exit_code == 0
    options = ("--control", site / "control.csv", "--sd", "images=0.5", "--sd", "control=0.1,0.1,0.2")
    return ("model", *options, "--unit-variance", "unity")


HEAD = ("--client", "Town", "--firm", "Office", "--class-h", "5cm")


def test_adjust_states_models_of_other_programs_by_options(run, model):
    run("adjust", *model, "--statement", *HEAD, "--out", "out", "--no-html")
    document = json.loads(Path("out/statement/statement.json").read_text())
    assert (document["client"], document["firm"]) == ("Town", "Office")
    assert document["asprs"]["class_h_m"] == 0.05
    run("statement", *model, *HEAD, "--out", "alone")
    alone = json.loads(Path("alone/statement.json").read_text())
    assert alone["figures"] == document["figures"]
    assert alone["sentences"] == document["sentences"]


def test_options_of_a_statement_require_one(run, site):
    refused = run("adjust", site, "--client", "Town")
    assert refused.exit_code == 2
    assert "--client" in refused.stderr
    assert not Path("site-adjusted").exists()


def test_a_wrong_option_of_a_statement_is_refused_before_the_adjustment(run, site):
    refused = run("adjust", site, "--statement", "--class-h", "5")
    assert refused.exit_code == 1
    assert not Path("site-adjusted").exists()


@pytest.mark.parametrize("option", [("--control", "site/control.csv"), ("--loss", "huber"), ("--keep-all",)])
def test_a_saved_result_refuses_options_of_reading_and_adjustment(run, site, option):
    run("adjust", site, "--out", "out", "--parquet", "data", "--no-html")
    refused = run("statement", "data", *option)
    assert refused.exit_code == 2
    assert "PATH" in refused.stderr
    assert not Path("data-statement").exists()
