"""What a project on files says of its statement: sections, cover of check points, calibrated lengths."""

import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from golden_data import DATA, golden
from message_codes import check_message, rejected
from photogram import InputError, adjust, formats
from photogram.formats.names import with_names
from photogram.formats.plain.settings import KEYS, read_sentences
from photogram.formats.supplements import with_control
from photogram.results.statement.request import Asked

ROOT = Path(__file__).parents[2]
EXAMPLE = Path(formats.__file__).parents[1] / "examples" / "project"
SECTIONS = """
[check]
survey_common_sd = 0.004
survey_common_in_control = true
independent = "same-base"
[statement]
standards = ["asprs-2023", "vdi-2634"]
class_h = "5cm"
class_v = "0.1 m"
class_3d = "120mm"
area = "12.5km2"
without = { middle = "target moved" }
language = "de"
text = "firm.toml"
budgets = ["point middle z", "distance north-1 t01"]
coverage = 0.9
title = "Genauigkeit"
project = 'the "north" quarry'
client = "Kies AG"
firm = "Vermessung"
surveyor = "E. Muster"
date = 2026-05-01
length_limit = [0.00001, 5e-6, inf]
expansion = 11.5e-6
"""
SENTENCES = '"asprs.points" = "Asked for: {asked}."\n'
LENGTHS = """line,from,to,length,sd,temperature
1,north-1,south-1,70.765,0.005,21.5
1,north-1,north-2,50.1,0,
"""


@pytest.fixture
def project(tmp_path):
    """Return the folder of the example with all that a statement may be asked."""
    place = Path(shutil.copytree(EXAMPLE, tmp_path / "project"))
    settings = (place / "project.toml").read_text()
    # What stands there as a comment would be found in its place.
    (place / "project.toml").write_text(settings[: settings.index("# [check]")] + SECTIONS)
    (place / "firm.toml").write_text(SENTENCES)
    (place / "lengths.csv").write_text(LENGTHS)
    change(place / "control.csv", "z,use", "z,use,cover")
    change(place / "control.csv", re.compile("(,control|,check)$", re.MULTILINE), r"\1,")
    change(place / "control.csv", "check,", "check,Vegetated")
    return place


def change(path, old, new):
    text = path.read_text()
    changed = old.sub(new, text) if isinstance(old, re.Pattern) else text.replace(old, new, 1)
    assert changed != text
    path.write_text(changed)


def written(project, place, file_format="plain"):
    for name, content in formats.to_files(project, file_format).items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(content)
    return place


def refused(place):
    with pytest.raises(InputError) as found:
        formats.read(place)
    return found.value


def record_of(path, text):
    return next(k for k, line in enumerate(path.read_text().split("\n"), 1) if text in line)


def test_all_that_may_be_asked_is_read_as_a_statement_takes_it(project):
    asked = formats.read(project).statement
    assert asked == {
        "survey_common_sd": (0.004, 0.004, 0.004),
        "survey_common_in_control": True,
        "independent": "same-base",
        "standards": ("asprs-2023", "vdi-2634"),
        "classes": {"h": 0.05, "v": 0.1, "3d": pytest.approx(0.12)},
        "area": 12.5e6,
        "without": {"middle": "target moved"},
        "language": "de",
        "text": {"asprs.points": "Asked for: {asked}."},
        "budgets": ("point middle z", "distance north-1 t01"),
        "coverage": 0.9,
        "title": "Genauigkeit",
        "project": 'the "north" quarry',
        "client": "Kies AG",
        "firm": "Vermessung",
        "surveyor": "E. Muster",
        "date": "2026-05-01",
        "limit": (1e-5, 5e-6, np.inf),
        "expansion": 11.5e-6,
        "lengths": (
            {"line": "1", "from": "north-1", "to": "south-1", "length": 70.765, "sd": 0.005}
            | {"temperature": 21.5},
            {"line": "1", "from": "north-1", "to": "north-2", "length": 50.1, "sd": 0.0},
        ),
        "vegetated": frozenset({"middle"}),
    }
    checked = Asked.checked(**asked)
    assert all(getattr(checked, name) == own for name, own in asked.items())


def test_a_project_that_says_nothing_of_a_statement_asks_nothing():
    assert formats.read(EXAMPLE).statement == {}


def test_lengths_are_in_the_unit_of_the_project(project):
    change(project / "project.toml", '# length = "m"', 'length = "mm"')
    asked = formats.read(project).statement
    assert asked["classes"]["h"] == pytest.approx(50.0)
    assert asked["area"] == pytest.approx(12.5e12)
    assert asked["survey_common_sd"] == (0.004, 0.004, 0.004)


def test_three_common_deviations_are_east_north_up(project):
    change(project / "project.toml", "survey_common_sd = 0.004", "survey_common_sd = [0.003, 0.004, 0.006]")
    assert formats.read(project).statement["survey_common_sd"] == (0.003, 0.004, 0.006)


def test_reasons_may_stand_in_a_section_of_their_own(project):
    change(project / "project.toml", 'without = { middle = "target moved" }\n', "")
    with (project / "project.toml").open("a") as file:
        file.write('[statement.without]\nmiddle = "under water"\n')
    assert formats.read(project).statement["without"] == {"middle": "under water"}


# What is refused


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "survey_common_sd = 0.004",
            "survey_common = 0.004",
            "error.at [check]: error.unknown.close key survey_common survey_common_sd",
        ),
        (
            "survey_common_sd = 0.004",
            "survey_common_sd = -0.004",
            "error.key check survey_common_sd: request.deviations",
        ),
        (
            "survey_common_sd = 0.004",
            "survey_common_sd = nan",
            "error.key check survey_common_sd: error.finite nan",
        ),
        (
            "survey_common_sd = 0.004",
            "survey_common_sd = [1, 2]",
            "error.key check survey_common_sd: error.count 2: toml.or 1,3",
        ),
        ("in_control = true", "in_control = 1", "error.key check survey_common_in_control: error.flag 1"),
        ('"same-base"', '"perhaps"', "error.key check independent: error.choice"),
        (
            'independent = "same-base"',
            "independent = true",
            "error.key check independent: toml.text: error.value True",
        ),
        (
            '"asprs-2023"',
            '"asprs"',
            "error.key statement standards: error.unknown.close standard asprs asprs-2023",
        ),
        ('["asprs-2023", "vdi-2634"]', '"plain"', "error.key statement standards: error.list plain"),
        (
            'class_h = "5cm"',
            'class_x = "5cm"',
            "error.at [statement]: error.unknown.close key class_x class_v",
        ),
        (
            'class_h = "5cm"',
            "class_h = 5",
            "error.key statement class_h: request.length 5",
        ),
        (
            'class_h = "5cm"',
            'class_h = "5 kms"',
            "error.key statement class_h: error.unknown.close unit of length kms km",
        ),
        (
            'class_h = "5cm"',
            'class_h = "0cm"',
            "error.key statement class_h: error.at classes h: error.positive 0.0",
        ),
        (
            'class_v = "0.1 m"',
            'class_v = "1e999m"',
            "error.key statement class_v: error.at classes v: error.positive inf",
        ),
        (
            'area = "12.5km2"',
            'area = "12.5km"',
            "error.key statement area: request.area 12.5km",
        ),
        ('{ middle = "target moved" }', '"middle"', "error.key statement without: error.table middle"),
        (
            '{ middle = "target moved" }',
            '{ middle = " " }',
            "error.key statement.without middle: plain.reason",
        ),
        (
            '{ middle = "target moved" }',
            '{ midle = "moved" }',
            "error.at without: error.unknown.close point midle middle",
        ),
        (
            'language = "de"',
            'language = "fr"',
            "error.key statement language: error.choice",
        ),
        ('text = "firm.toml"', 'text = "film.toml"', "error.key statement text: error.absent file"),
        ('text = "firm.toml"', f'text = "{"x" * 300}"', "error.key statement text: error.absent file"),
        (
            '["point middle z"',
            "[1",
            "error.key statement budgets: toml.texts: error.value [1, 'distance north-1",
        ),
        (
            "coverage = 0.9",
            "coverage = 90",
            "error.key statement coverage: error.range 90.0 0 1",
        ),
        ("coverage = 0.9", 'coverage = "90 %"', "error.key statement coverage: error.number 90 %"),
        ('firm = "Verm', 'firma = "Verm', "error.at [statement]: error.unknown.close key firma firm"),
        ("project = 'the \"north\" quarry'", "project = 5", "error.key statement project: toml.text 5"),
        (
            "date = 2026-05-01",
            "date = 2026-05-01T12:00:00",
            "error.key statement date: toml.text: error.value datetime.datetime(2026,",
        ),
        (
            "[0.00001, 5e-6, inf]",
            "[0.00001, 5e-6]",
            "error.key statement length_limit: error.count 3 2",
        ),
        (
            "[0.00001, 5e-6, inf]",
            "[inf, 5e-6, 1]",
            "error.key statement length_limit: plain.length-limit: error.value [inf,",
        ),
        (
            "[0.00001, 5e-6, inf]",
            "[1, -5e-6, 1]",
            "error.key statement length_limit: error.at limit: request.limit",
        ),
        ("expansion = 11.5e-6", "expansion = inf", "error.key statement expansion: error.finite inf"),
    ],
)
def test_what_cannot_be_asked_is_an_error_of_its_line(project, old, new, said):
    path = project / "project.toml"
    change(path, old, new)
    error = refused(project)
    assert error.file == path
    check_message(said, error)
    assert error.record == record_of(path, new)
    assert error.text in path.read_text().split("\n")


def test_sections_of_other_names_are_refused_with_the_nearest(project):
    change(project / "project.toml", "[statement]", "[statment]")
    check_message("error.unknown.close table statment statement", refused(project))


def test_values_that_are_nested_deeply_are_refused_as_any(project):
    change(project / "project.toml", 'client = "Kies AG"', f'client{".a" * 3000} = "Kies AG"')
    check_message("error.key statement client: toml.text: error.object dict", refused(project))


def test_errors_of_names_that_stand_in_several_sections_name_the_right_line(project):
    path = project / "project.toml"
    change(path, "gnss = 0.03", "gnss = 0.03\ncheck = 0.01")
    change(path, "independent = ", "independant = ")
    error = refused(project)
    assert error.record == record_of(path, "independant")
    change(path, "independant = ", "independent = ")
    change(path, 'title = "Genauigkeit"', "title = 7")
    assert refused(project).record == record_of(path, "title = 7")


@pytest.mark.parametrize(
    ("sentences", "record", "said"),
    [
        ('# ours\n"asprs.point" = "{asked}"', 2, "asprs.points"),
        ('"asprs.points" = "{many}"', 1, "request.field asprs.points many"),
        ('"asprs.points" = "{asked"', 1, "expected '}'"),
        ('"asprs.points" = "{asked:.3f}"', 1, "request.form asprs.points"),
        ('"asprs.points" = 5', 1, "error.at asprs.points: error.text 5"),
        (
            'asprs.points = "{asked}"',
            1,
            "error.at [asprs]: plain.sentence-key: error.value {'points': '{asked}'}",
        ),
        (
            '[asprs]\npoints = "{asked}"',
            1,
            "error.at [asprs]: plain.sentence-key: error.value {'points': '{asked}'}",
        ),
        ('"asprs.points" = "{asked}\n', 1, "error.parse TOML Illegal character '\\n' (at line 1, column 26)"),
    ],
)
def test_sentences_at_fault_are_errors_of_their_line(project, sentences, record, said):
    (project / "firm.toml").write_text(sentences)
    error = refused(project)
    assert (error.file, error.record) == (project / "firm.toml", record)
    check_message(said, error)
    with rejected(""):
        read_sentences(project / "firm.toml")


def test_a_file_of_sentences_that_is_not_there_is_an_error(tmp_path):
    with rejected("error.read No such file or directory"):
        read_sentences(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Vegetated", "wood", "error.column cover: error.choice open,vegetated wood"),
        (
            "south-1,-23.638,-34.7,1.24,control,",
            "south-1,-23.638,-34.7,1.24,control,vegetated",
            "error.column cover: plain.cover-of-control south-1",
        ),
    ],
)
def test_covers_at_fault_are_errors_of_their_row(project, old, new, said):
    change(project / "control.csv", old, new)
    error = refused(project)
    assert (error.file, error.record) == (project / "control.csv", record_of(project / "control.csv", new))
    check_message(said, error)


def test_cover_of_points_that_are_off_does_not_count(project):
    change(project / "control.csv", "check,Vegetated", "off,vegetated")
    change(project / "project.toml", 'without = { middle = "target moved" }\n', "")
    assert "vegetated" not in formats.read(project).statement


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "north-1,south-1",
            "north-9,south-1",
            "error.column from: error.unknown.close point north-9 north-2",
        ),
        ("north-1,south-1", "north-1,south-9", "error.column to: error.unknown.close point south-9 south-2"),
        ("north-1,south-1", "north-1,north-1", "plain.same-ends north-1"),
        ("70.765", "", "error.column length: error.empty"),
        ("70.765", "-70.765", "error.column length: error.positive -70.765"),
        ("70.765", "long", "column length"),
        ("0.005", "", "error.column sd: cells.no-sd lengths"),
        ("0.005", "-0.005", "error.column sd: error.not-negative -0.005"),
        ("0.005", "inf", "column sd"),
        ("21.5", "warm", "column temperature"),
        ("1,north-1,south-1", ",north-1,south-1", "error.column line: error.no-name"),
        (
            "line,from,to,length",
            "line,from,to,size",
            "error.missing-columns 1 length line,from,to,size,sd,temperature",
        ),
    ],
)
def test_lengths_at_fault_are_errors_of_their_row(project, old, new, said):
    path = project / "lengths.csv"
    change(path, old, new)
    error = refused(project)
    assert (error.file, error.record) == (path, record_of(path, new) if new else 2)
    check_message(said, error)


def test_lengths_may_have_one_deviation_for_all(project):
    (project / "lengths.csv").write_text("line;from;to;length\nx;north-1;south-1;70,765\n")
    change(project / "project.toml", "[sd] ", "[sd]\nlengths = 2e-5\n#")
    (length,) = formats.read(project).statement["lengths"]
    assert length == {"line": "x", "from": "north-1", "to": "south-1", "length": 70.765, "sd": 2e-5}


def test_a_standard_about_lengths_needs_their_table(project):
    (project / "lengths.csv").unlink()
    error = refused(project)
    check_message("error.requires vdi-2634: request.lengths", error)
    assert error.record == record_of(project / "project.toml", "standards =")


# What is written


@pytest.mark.parametrize("unit", ["m", "mm", "us-ft"])
def test_a_round_trip_keeps_all_that_is_asked(project, tmp_path, unit):
    change(project / "project.toml", '# length = "m"', f'length = "{unit}"')
    change(project / "project.toml", '"target moved"', r'"moved \"C:\\\\\" \u007f, rückwärts"')
    whole = formats.read(project)
    again = formats.read(written(whole, tmp_path / "again"))
    assert again.statement == whole.statement
    assert again.statement["without"]["middle"].endswith("\x7f, rückwärts")
    files, others = (formats.to_files(each, "plain") for each in (again, whole))
    assert all(files[name] == others[name] for name in ("project.toml", "lengths.csv", "sentences.toml"))


def test_nothing_asked_is_nothing_written():
    files = formats.to_files(formats.read(EXAMPLE), "plain")
    text = files["project.toml"].decode()
    assert "statement" not in tomllib.loads(text)
    assert "check" not in tomllib.loads(text)
    assert not {"lengths.csv", "sentences.toml"} & set(files)
    assert "cover" not in files["control.csv"].decode()


def test_cover_of_a_check_point_that_became_control_is_not_written(project, tmp_path):
    whole = formats.read(project)
    block = whole.block
    held = np.where(np.isfinite(block.point_positions), 0.01, np.inf)
    again = written(whole.replace(block=block.replace(point_sd=held)), tmp_path / "again")
    assert "vegetated" not in formats.read(again).statement


def test_convert_and_adjust_keep_what_is_asked(run, project, tmp_path):
    whole = formats.read(project)
    assert run("adjust", "project", "--no-html").exit_code == 0
    assert formats.read(tmp_path / "project-adjusted" / "adjusted").statement == whole.statement
    assert run("convert", "project", "tables").exit_code == 0
    assert formats.read(tmp_path / "tables").statement == whole.statement


@pytest.mark.parametrize("file_format", ["colmap", "blocks_exchange", "bingo"])
def test_formats_without_a_place_for_it_say_so(project, file_format):
    whole = formats.read(project)
    lost = formats.cannot_hold(whole, file_format)
    assert "what is asked of an accuracy statement" in lost
    assert "2 calibrated lengths" in lost
    assert "vegetation about 1 check point" in lost
    assert not {*lost} & {*formats.cannot_hold(whole.replace(statement={}), file_format)} & {*lost[-3:]}
    assert not any("statement" in each for each in formats.cannot_hold(whole, "plain"))


# What users add


def test_control_of_a_user_says_the_cover_of_its_points(project, tmp_path):
    table = tmp_path / "own.csv"
    table.write_text(
        "point,x,y,z,use,cover\nmiddle,1.637,-1.147,-5.036,check,open\nt01,-41,-37,1,check,vegetated\n"
        "nowhere,1,2,3,check,vegetated\n"
    )
    whole = with_control(formats.read(project), table, {"control": (0.02,)}, None)
    assert whole.statement["vegetated"] == {"t01"}
    bare = with_control(formats.read(EXAMPLE), table, {"control": (0.02,)}, None)
    assert bare.statement == {"vegetated": {"t01"}}
    table.write_text("point,x,y,z,use\nmiddle,1.637,-1.147,-5.036,check\n")
    assert "vegetated" not in with_control(formats.read(project), table, {}, None).statement


def test_other_names_of_points_are_names_in_what_is_asked(project, tmp_path):
    table = tmp_path / "names.csv"
    table.write_text("point,name\nmiddle,big rock\nt01,far end\nnorth-1,n 1\n")
    (project / "distances.csv").unlink()
    asked = with_names(formats.read(project), table).statement
    assert asked["vegetated"] == {"big rock"}
    assert asked["without"] == {"big rock": "target moved"}
    assert asked["budgets"] == ("point big rock z", "distance n 1 far end")
    assert [(each["from"], each["to"]) for each in asked["lengths"]] == [
        ("n 1", "south-1"),
        ("n 1", "north-2"),
    ]


# What it is for


def test_a_statement_takes_what_a_project_asks(project):
    change(project / "project.toml", "gnss = 0.03", "gnss = 0.03\ncheck = 0.01")
    change(project / "project.toml", 'without = { middle = "target moved" }\n', "")
    whole = formats.read(project)
    document = json.loads(adjust(whole.block).statement(**whole.statement).to_json())
    assert document["client"] == "Kies AG"
    assert document["language"] == "de"
    assert [each["cover"] for each in document["check_points"]] == ["vegetated"]
    assert list(document["budgets"]) == ["point middle z", "distance north-1 t01"]
    assert len(document["lengths"]["lengths"]) == 2


def test_classes_of_a_project_are_judged_as_the_golden_data_have_it(tmp_path):
    place = Path(shutil.copytree(DATA / "statement" / "block", tmp_path / "block"))
    with (place / "project.toml").open("a") as file:
        file.write('\n[statement]\nclass_h = "5cm"\nclass_v = "50 mm"\n')
    whole = formats.read(place)
    result = adjust(whole.block, unit_variance=whole.options.unit_variance)
    found = json.loads(result.statement(**whole.statement).to_json())["asprs"]
    expected = golden("statement", "statement.json")["asprs"]
    for key in ("class_h_m", "class_v_m", "upper_h", "upper_v"):
        assert found[key] == pytest.approx(expected[key], rel=1e-6)
    assert [found[key] for key in ("horizontal", "vertical")] == ["met with confidence", "met"]


def test_the_documentation_shows_sections_that_can_be_read(tmp_path):
    sections = ("check", "statement")
    keys = {section: [key.described() for key in KEYS if key.section == section] for section in sections}
    shown = "".join("\n".join([f"[{section}]", *keys[section], ""]) for section in sections)
    place = Path(shutil.copytree(EXAMPLE, tmp_path / "project"))
    (place / "lengths.csv").write_text(LENGTHS)
    (place / "firm.toml").write_text(SENTENCES)
    with (place / "project.toml").open("a") as file:
        file.write(shown.replace("C07", "middle"))
    asked = formats.read(place).statement
    assert asked.keys() >= {"survey_common_sd", "standards", "classes", "area", "text", "limit", "without"}
