"""Options of a statement from Python, project.toml and the command line."""

import dataclasses
import shutil
from pathlib import Path

import pytest
from golden_statement import BLOCK

from photogram.cli import statement as command
from photogram.formats import read
from photogram.results.statement.request import Asked

CASES = {
    "standards": (("nssda", "plain"), 'standards = ["nssda", "plain"]', ["--standard", "nssda,plain"]),
    "classes": (
        {"h": 0.05, "v": 0.1, "3d": 0.25},
        'class_h = "5cm"\nclass_v = "10cm"\nclass_3d = "25cm"',
        ["--class-h", "5cm", "--class-v", "10cm", "--class-3d", "25cm"],
    ),
    "area": (2e6, 'area = "2km2"', ["--area", "2km2"]),
    "without": ({"C08": "moved"}, 'without = { C08 = "moved" }', ["--without", "C08=moved"]),
    "independent": ("no", 'independent = "no"', ["--independent", "no"]),
    "survey_common_sd": (
        (0.1, 0.2, 0.3),
        "survey_common_sd = [0.1, 0.2, 0.3]",
        ["--survey-common-sd", "0.1,0.2,0.3"],
    ),
    "survey_common_in_control": (True, "survey_common_in_control = true", ["--survey-common-in-control"]),
    "language": ("de", 'language = "de"', ["--language", "de"]),
    "text": ({"honest.yes": "{factor}"}, 'text = "firm.toml"', ["--text", "site/firm.toml"]),
    "budgets": (("point C08 z",), 'budgets = ["point C08 z"]', ["--budget", "point C08 z"]),
    "coverage": (0.9, "coverage = 0.9", ["--coverage", 0.9]),
    "limit": ((1e-5, 5e-6, 2.0), "length_limit = [1e-5, 5e-6, 2.0]", ["--length-limit", "1e-5,5e-6,2"]),
    "expansion": (1e-5, "expansion = 1e-5", ["--expansion", "1e-5"]),
    "date": ("2026-05-01", "date = 2026-05-01", ["--date", "2026-05-01"]),
    **{
        name: ("Word", f'{name} = "Word"', [f"--{name}", "Word"])
        for name in ("title", "project", "client", "firm", "surveyor")
    },
}
OF_CHECK = ("independent", "survey_common_sd", "survey_common_in_control")
OF_TABLES = {"sd", "vegetated", "lengths", "components"}  # Contents of tables and of a result


def test_every_option_has_a_case():
    assert CASES.keys() | OF_TABLES == {option.name for option in dataclasses.fields(Asked)}


@pytest.mark.parametrize("name", CASES)
def test_options_are_equal_from_all_entrances(run, monkeypatch, name):
    value, line, arguments = CASES[name]
    shutil.copytree(BLOCK, "site", copy_function=shutil.copyfile)
    Path("site/firm.toml").write_text('"honest.yes" = "{factor}"\n')
    requests = []
    monkeypatch.setattr(command, "stated", lambda job, result, asked, **_: requests.append(asked) or 1 / 0)
    done = run("statement", "site", *arguments)
    assert requests, done.output
    section = "check" if name in OF_CHECK else "statement"
    with Path("site/project.toml").open("a") as file:
        file.write(f"\n[{section}]\n{line}\n")
    expected = Asked.checked(**{name: value})
    assert getattr(expected, name) != getattr(Asked(), name)
    for request in (requests[0], read(Path("site")).statement):
        assert Asked.checked(**{name: request[name]}) == expected
