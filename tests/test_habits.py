"""What strangers who join rely on: commands that workflows call, the list of the public API, citations."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

import public_api
from photogram import __version__

ROOT = Path(__file__).parents[1]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def commands():
    """Return the commands that `./dev` knows."""
    return set(re.findall(r"^  ([\w-]+)\)", (ROOT / "dev").read_text(encoding="utf-8"), re.MULTILINE))


def test_the_public_api_is_that_of_its_list():
    listed = public_api.LIST.read_text(encoding="utf-8").splitlines()
    there = public_api.lines()
    gone, new = sorted(set(listed) - set(there)), sorted(set(there) - set(listed))
    assert (gone, new) == ([], []), "run `python tests/public_api.py`, and say in CHANGELOG.md what changed"
    assert listed == there
    assert len(there) > 1000


def test_dev_tells_its_commands():
    done = subprocess.run([ROOT / "dev"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert len(commands()) > 10
    assert commands() <= set(re.split(r"[\s|]+", done.stdout.replace(";", " ")))


@pytest.mark.parametrize("path", [*WORKFLOWS, ROOT / ".pre-commit-config.yaml"], ids=lambda path: path.name)
def test_workflows_call_commands_that_everybody_has(path):
    text = path.read_text(encoding="utf-8")
    assert yaml.safe_load(text)
    called = set(re.findall(r"\./dev ([\w-]+)", text))
    assert called
    assert called <= commands()
    for script in re.findall(r"run: (\.ci/\w+)", text):
        assert (ROOT / script).exists()


def test_releases_make_wheels_for_all_machines():
    release = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8"))
    targets = {each["target"] for each in release["jobs"]["wheels"]["strategy"]["matrix"]["include"]}
    for part in ("linux-gnu", "linux-musl", "apple-darwin", "windows"):
        assert any(part in each for each in targets)
    assert {"wheels", "sdist", "checks"} <= set(release["jobs"]["publish"]["needs"])


def test_the_citation_is_of_this_version_and_names_the_reports():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == __version__
    assert cited["cff-version"] == "1.2.0"
    years = {each["year"] for each in cited["references"]}
    assert {1987, 1969, 1962, 1973, 1972} <= years
    for each in cited["references"]:
        assert each["title"]
        assert each["authors"]


def test_crates_and_changelog_have_the_version_of_the_package():
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    assert workspace["package"]["version"] == __version__
    for member in workspace["members"]:
        package = tomllib.loads((ROOT / member / "Cargo.toml").read_text(encoding="utf-8"))["package"]
        assert package["version"] == {"workspace": True}
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    entries = re.findall(r"^## \[(\S+)\] - (?:unreleased|\d{4}-\d\d-\d\d)$", changes, re.MULTILINE)
    assert entries[0] == __version__
    headings = set(re.findall(r"^### (.*)$", changes, re.MULTILINE))
    assert headings <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security", "Known limitations"}
