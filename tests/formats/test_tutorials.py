"""The tutorials of docs/formats/ run."""

import re
import shlex
from pathlib import Path

import pytest

PAGES = sorted((Path(__file__).parents[2] / "docs" / "formats").glob("*.md"))
TUTORIALS = {
    name: commands
    for page in PAGES
    for name, commands in re.findall(
        r"<!-- tutorial: (\w+) -->\n```console\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL
    )
}


def test_there_is_one_for_each_origin():
    assert set(TUTORIALS) == {"tables", "rolling", "colmap", "opensfm", "blocks_exchange"}


@pytest.mark.parametrize("name", TUTORIALS)
def test_a_tutorial_runs(run, name):
    for line in TUTORIALS[name].splitlines():
        prompt, program, *words = shlex.split(line)
        assert (prompt, program) == ("$", "photogram")
        done = run(*words)
        assert done.exit_code == 0, f"{line}\n{done.output}"
