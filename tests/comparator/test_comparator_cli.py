"""`photogram comparator`: what is written, what is not, exit codes; packaged example and documentation."""

import json
import runpy
import subprocess
import sys
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
import pytest
from plates import case_2_session, noisy

from photogram.comparator import Correction, read, read_grid, to_cards, to_csv
from photogram.words import phrase

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "python" / "photogram" / "examples" / "comparator" / "comparator-3.txt"
TEXTS = {"listing.txt", "correction.json", "correction-joint.json"}


@pytest.fixture
def run(run):
    """Run the command in an empty directory."""
    return lambda *arguments: run("comparator", *arguments)


@pytest.fixture
def tables(tmp_path):
    """Write a session as two tables and its plate."""
    session = noisy(1)
    (tmp_path / "plate.csv").write_bytes(session.grids[1].to_csv())
    head, *rows = [line for line in to_csv(session).decode().splitlines() if not line.startswith("# grid")]
    column = next(k for k, line in enumerate(rows) if line.startswith("plate,"))
    top, body = [head, *rows[: column + 1]], rows[column + 1 :]
    half = [line for line in body if int(line.split(",")[1]) <= 2]
    for name, lines in (("first.csv", half), ("second.csv", body[len(half) :])):
        (tmp_path / name).write_text("\n".join([*top, *lines]) + "\n")
    return [tmp_path / "first.csv", tmp_path / "second.csv", "--grid", tmp_path / "plate.csv"]


def names(directory):
    return {path.name for path in Path(directory).iterdir()}


def test_the_packaged_example_runs_in_one_command(run):
    pytest.importorskip("matplotlib")
    result = run("--example", "--json", "result.json")
    assert result.exit_code == 0, result.output
    assert names("comparator-calibrated") == TEXTS | {"report.html", "grid-1320.csv", "grid-1320-joint.csv"}
    assert "SYSTEMATIC COMPARATOR, LINEAR" in Path("comparator-calibrated/listing.txt").read_text()
    document = json.loads(Path("result.json").read_bytes())
    printed = {"scale_x": 0.99999522, "scale_y": 0.99997765}
    for name, value in printed.items():
        sd = document["linear"]["covariance"][0][0] ** 0.5
        assert abs(document["linear"][name] - value) < 4 * sd
    assert document["comparator"] == 3
    assert document["left_handed"] is True
    assert [case["nearest_point"] for case in document["cases"]] == [5, 25, 21, 1]


def test_case_2_of_the_example_is_that_of_the_report():
    session = read([EXAMPLE])[0]
    case = case_2_session().cases[0]
    assert (session.cases[1].xy_um == case.xy_um).all()
    assert (session.cases[1].points == case.points).all()


def test_the_example_is_what_its_script_makes(tmp_path, monkeypatch):
    script = runpy.run_path(str(ROOT / "examples" / "make_comparator.py"))
    monkeypatch.setitem(script["main"].__globals__, "EXAMPLE", tmp_path)
    script["main"]()
    assert (tmp_path / EXAMPLE.name).read_bytes() == EXAMPLE.read_bytes()


def test_tables_make_one_calibration(run, tables, tmp_path):
    result = run(*tables, "--no-plots", "--json", "result.json", "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert names(tmp_path / "first-calibrated") == TEXTS | {"grid-1.csv", "grid-1-joint.csv"}
    document = json.loads(Path("result.json").read_bytes())
    assert [case["case"] for case in document["cases"]] == [1, 2, 3, 4]
    corrected = read_grid(tmp_path / "first-calibrated" / "grid-1.csv")
    given = read_grid(tmp_path / "plate.csv")
    corrections = np.array(document["plates"][0]["corrections_plate_um"])
    assert corrected.xy_um - given.xy_um == pytest.approx(corrections, abs=1e-4)


def test_batches_of_decks(run, tmp_path):
    card = to_cards(case_2_session()).decode()
    (tmp_path / "batch.txt").write_text(card + card + "\n")
    result = run("batch.txt", "--no-plots", "--json", "all.json")
    assert result.exit_code == 0, result.output
    assert names("batch-calibrated") == {"1", "2"}
    assert names("batch-calibrated/2") == TEXTS | {"grid-1320.csv", "grid-1320-joint.csv"}
    documents = json.loads(Path("all.json").read_bytes())
    assert len(documents) == 2
    assert documents[0]["linear"] == documents[1]["linear"]
    assert documents[0]["cases"][0]["sigma0_um"]["linear"] == pytest.approx(1.264141260949165, rel=1e-6)


def test_pdf_and_other_choices(run, tables):
    pytest.importorskip("typst")
    result = run(*tables, "--out", "out", "--pdf", "--as-published", "--linear-only", "--estimate-grid")
    assert result.exit_code == 0, result.output
    assert names("out") == TEXTS | {"report.pdf", "grid-1.csv", "grid-1-joint.csv"}
    assert "NONLINEAR PARAMETERS" not in Path("out/listing.txt").read_text()


def test_without_matplotlib_there_are_no_pictures(run, tables, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = run(*tables, "--out", "out")
    assert result.exit_code == 0
    assert "report.html" in names("out")
    monkeypatch.setitem(sys.modules, "typst", None)
    monkeypatch.delitem(sys.modules, "photogram.show.pdf", raising=False)
    result = run(*tables, "--out", "out", "--pdf")
    assert result.exit_code == 0
    assert "pip install 'photogram[pdf]'" in result.stderr
    assert "report.pdf" not in names("out")


def test_bad_input_writes_nothing(run, tables, tmp_path):
    before = names(tmp_path)
    text = tables[1].read_text().splitlines()
    tables[1].write_text("\n".join([*text[:8], text[8].replace(",0,", ",0,9", 1), *text[9:]]) + "\n")
    result = run(*tables, "--json", "result.json")
    assert result.exit_code == 1
    assert f"{tables[1]}, record 9: " in result.stderr
    assert f"|{text[8].replace(',0,', ',0,9', 1)}|" in result.stderr
    assert "Traceback" not in result.output
    assert names(tmp_path) == before


def test_as_published_cuts_the_sigmas_after_the_linear_fit_only(run):
    assert run("--example", "--as-published", "--no-plots", "--out", "out").exit_code == 0
    lines = Path("out/listing.txt").read_text().splitlines()
    sigmas = {line[:40].strip(): line.split()[-3:] for line in lines if line.startswith("  AFTER LINEAR")}
    assert sigmas["AFTER LINEAR CORRECTIONS"] == ["1.448", "0.923", "1.214"]
    assert sigmas["AFTER LINEAR AND NONLINEAR CORRECTIONS"] == ["0.897", "0.897", "0.897"]


def test_usage(run):
    for arguments in ([], ["a.csv", "--example"], ["--example", "--hand", "up"]):
        assert run(*arguments).exit_code == 2


def test_handedness_must_agree(run, tables):
    result = run(*tables, "--hand", "left")
    assert result.exit_code == 1
    assert str(phrase("comparators.hand", case=1, measured="right", specified="left")) in result.stderr


def test_strict_turns_remarks_into_errors(run, tables):
    lines = tables[0].read_text().splitlines()
    tables[0].write_text("\n".join(line for line in lines if not line.startswith("1,1,1,0,25,")) + "\n")
    lenient = run(*tables, "--no-plots")
    assert lenient.exit_code == 0
    assert str(phrase("comparators.missing", case=1, n=1, count=25, plate=1)) in lenient.output
    strict = run(*tables, "--no-plots", "--strict", "--out", "strict")
    assert strict.exit_code == 1
    assert not Path("strict").exists()


def test_the_date_of_the_run_stands_on_the_title_page_only(run, tables, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "94435200")
    for out, said in (("a", []), ("b", ["--date", "12/29/72"])):
        assert run(*tables, "--no-plots", "--out", out, "--json", f"{out}.json", *said).exit_code == 0
    first, second = (Path(out, "listing.txt").read_text().splitlines() for out in ("a", "b"))
    different = [pair for pair in zip(first, second, strict=True) if pair[0] != pair[1]]
    assert [[line.split() for line in pair] for pair in different] == [
        [["DATE", "OF", "RUN", "1972-12-29"], ["DATE", "OF", "RUN", "12/29/72"]]
    ]
    for name in ("correction.json", "correction-joint.json", "grid-1.csv"):
        assert Path("a", name).read_bytes() == Path("b", name).read_bytes()
    assert Path("a.json").read_bytes() == Path("b.json").read_bytes()
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "²")
    refused = run(*tables, "--no-plots", "--out", "c")
    assert refused.exit_code == 1
    assert "SOURCE_DATE_EPOCH must be a number of seconds since 1970, got '²'" in refused.stderr
    assert not Path("c").exists()


def test_the_date_of_the_run_is_today_where_nothing_is_said(run, tables, monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    before = datetime.now(UTC).date()
    assert run(*tables, "--no-plots", "--out", "a").exit_code == 0
    (line,) = [line for line in Path("a/listing.txt").read_text().splitlines() if "DATE OF RUN" in line]
    assert before <= date.fromisoformat(line.split()[-1]) <= datetime.now(UTC).date()


def test_tables_and_pictures_of_every_case(run, tables):
    assert run(*tables, "--no-plots", "--out", "a").exit_code == 0
    assert run(*tables, "--no-plots", "--out", "b", "--each-case").exit_code == 0
    pages = [Path(out, "listing.txt").read_text().count("NONLINEAR CORRECTIONS, CASE") for out in ("a", "b")]
    assert pages == [0, 4]


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("comparator = ²", "comparator: "),
        (f"comparator = {'9' * 5000}", "(5000 characters)"),
        ("range_centre_um = 1e300", "range_centre_um: "),
        ("range_centre_um = nan", "range_centre_um: "),
        ("left_handed = perhaps", "left_handed: "),
        ("comparater = 3", "comparator"),
        ("Left handed = yes", "left_handed"),
        ("foo = bar", "grid, comparator, date,"),
    ],
)
def test_settings_that_cannot_be_name_their_record(run, tables, setting, words):
    kept = [line for line in tables[0].read_text().splitlines() if not line.startswith("#")]
    tables[0].write_text("\n".join([f"# {setting}", *kept]) + "\n")
    result = run(*tables, "--no-plots")
    assert result.exit_code == 1
    assert isinstance(result.exception, SystemExit)
    assert f"{tables[0]}, record 1: " in result.stderr
    assert words in result.stderr


@pytest.mark.parametrize("grid", ["²", "9" * 30, "9" * 5000, "a\0b"])
def test_names_of_plates_that_cannot_be(run, tables, grid):
    result = run(*tables[:2], "--grid", grid, "--no-plots")
    assert result.exit_code == 1
    assert isinstance(result.exception, SystemExit)


def test_no_result_goes_over_a_plate_that_was_read(run, tables, tmp_path):
    """The corrected plate would have the name of the given one."""
    given = tmp_path / "grid-1.csv"
    tables[3].rename(given)
    before = given.read_bytes()
    for named in (["--grid", given], []):
        if not named:
            first = tables[0].read_text()
            tables[0].write_text(f"# grid = grid-1.csv\n{first}")
        result = run(*tables[:2], *named, "--no-plots", "--out", tmp_path)
        assert result.exit_code == 1
        assert isinstance(result.exception, SystemExit)
        assert str(given) in result.stderr
        assert given.read_bytes() == before


def test_the_middle_of_the_range_comes_from_the_table(run, tables):
    tables[0].write_text("# range_centre_um = 130000\n" + tables[0].read_text())
    session = read(tables[:2], [read_grid(tables[3])])[0]
    assert session.centre_um == 130_000.0
    assert b"# range_centre_um = 130000" in to_csv(session)


def test_correct_applies_and_inverts(run, tables, tmp_path):
    assert run(*tables, "--no-plots", "--out", "out", "--quiet").exit_code == 0
    Path("points.csv").write_text("name,x_mm,y_mm\na,50.0001,60\nb,200,12.5\n")
    result = run("correct", "out/correction-joint.json", "points.csv", "corrected.csv")
    assert result.exit_code == 0, result.output
    head, *rows = Path("corrected.csv").read_text().splitlines()
    assert head == "name,x_mm,y_mm,corrected_x_um,corrected_y_um,sd_x_um,sd_y_um,in_range"
    correction = Correction.read(Path("out/correction-joint.json"))
    expected = correction.apply(np.array([[50_000.1, 60_000.0], [200_000.0, 12_500.0]]))
    found = np.array([[float(cell) for cell in row.split(",")[3:5]] for row in rows])
    assert found == pytest.approx(expected, abs=1e-4)
    assert all(0 < float(row.split(",")[5]) < 2 for row in rows)
    Path("back.csv").write_text(
        "x_um,y_um\n" + "\n".join(",".join(row.split(",")[3:5]) for row in rows) + "\n"
    )
    result = run("correct", "out/correction-joint.json", "back.csv", "--invert")
    assert result.output.splitlines()[0] == "x_um,y_um,reading_x_um,reading_y_um,in_range"
    assert float(result.output.splitlines()[1].split(",")[2]) == pytest.approx(50_000.1, abs=2e-4)
    Path("blank.csv").write_text("x_um,y_um\n,\n1,2\n3,\n")
    result = run("correct", "out/correction.json", "blank.csv")
    assert result.exit_code == 1
    assert "record 4: " in result.stderr


def test_places_that_were_not_calibrated_are_remarked_on_or_refused(run, tables):
    assert run(*tables, "--no-plots", "--out", "out", "--quiet").exit_code == 0
    correction = Correction.read(Path("out/correction.json"))
    (low_x, low_y), (high_x, _) = correction.identity.low_um, correction.identity.high_um
    edge = 0.1 * (high_x - low_x) / 2
    lines = ["x_um,y_um", f"{low_x!r},{low_y!r}", f"{low_x - edge!r},{low_y!r}"]
    Path("near.csv").write_text("\n".join(lines) + "\n")
    result = run("correct", "out/correction.json", "near.csv", "near-corrected.csv")
    assert result.exit_code == 0
    assert "near.csv, record 3: 1 of 2 points" in result.stderr
    ends = [line.rsplit(",", 1)[1] for line in Path("near-corrected.csv").read_text().splitlines()]
    assert ends == ["in_range", "yes", "no"]
    Path("far.csv").write_text("\n".join([*lines, "500000,-300000"]) + "\n")
    result = run("correct", "out/correction.json", "far.csv", "far-corrected.csv")
    assert result.exit_code == 1
    assert "(500000, -300000" in result.stderr
    assert not Path("far-corrected.csv").exists()
    assert (
        run("correct", "out/correction.json", "far.csv", "far-corrected.csv", "--extrapolate").exit_code == 0
    )


def test_tables_of_one_calibration_may_not_contradict(run, tables):
    text = tables[1].read_text()
    tables[1].write_text(text.replace("# comparator = 1", "# comparator = 2"))
    result = run(*tables, "--no-plots")
    assert result.exit_code == 1
    assert str(phrase("comparators.contradiction", key="comparator", value="2", other="1")) in result.stderr
    tables[1].write_text(f"# comparator = 1\n{text}")
    assert (
        str(phrase("error.repeated", kind="setting", name="comparator")) in run(*tables, "--no-plots").stderr
    )


def test_the_numbers_of_the_page_are_those_of_the_command():
    command = [sys.executable, str(ROOT / "docs" / "regenerate.py"), "--check", "comparator.md"]
    assert subprocess.run(command, check=False).returncode == 0
