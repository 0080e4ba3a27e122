"""docs/first-ten-minutes.md does what it says, word by word."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "first-ten-minutes.md").read_text(encoding="utf-8")


@pytest.fixture
def walk(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import walk

    return walk


def test_every_step_of_the_page(walk, tmp_path):
    done = walk.walked("first-ten-minutes.md", tmp_path)
    for step in done:
        assert step.agrees, f"{step.command}\n{step.told}\n{step.remarks}"
    assert len(done) == 9
    assert (tmp_path / "snooped" / "report.html").is_file()


def test_the_page_installs_what_it_runs():
    assert "```sh\npip install '.[report]'\n```" in PAGE
    assert "pip install ." in (ROOT / "README.md").read_text(encoding="utf-8")
