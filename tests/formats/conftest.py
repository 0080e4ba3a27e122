"""Projects that the tests of several files change."""

import shutil
from pathlib import Path

import pytest
from moving import project_of, rolling, two_lines

from photogram import formats


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Write the projects of a rolling shutter, `drone`, and of two lines of a scanner, `lines`."""
    place = tmp_path_factory.mktemp("made")
    for name, block, size in (("drone", rolling(), (3000, 2000)), ("lines", two_lines(), None)):
        (place / name).mkdir()
        own = project_of(block, place, sizes=(size,) * len(block.cameras))
        for file, content in formats.to_files(own, "plain").items():
            (place / name / file).write_bytes(content)
    return place


@pytest.fixture
def moving_projects(made, tmp_path):
    """Return a folder with copies of both."""
    return Path(shutil.copytree(made, tmp_path / "own"))
