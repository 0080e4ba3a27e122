"""Fixtures of the stellar camera."""

import sys
from importlib.resources import files
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def plate():
    """Return the example: 75 stars, five images each, three groups."""
    from photogram.stellar import read_plain

    return read_plain(Path(str(files("photogram") / "examples" / "stellar" / "plate.toml")))


@pytest.fixture(scope="session")
def truth(plate):
    """Return the example without errors; its initial values are the true ones."""
    import star_plates as plates

    from photogram.stellar import calibrate

    solved = calibrate(plate).solved.parameters
    return plates.seen(plates.quiet(plate), solved)


@pytest.fixture(scope="module")
def night():
    """Return the example of a night."""
    from nights import EXAMPLE

    from photogram.stellar import read_night

    return read_night(EXAMPLE)


@pytest.fixture(scope="module")
def result(night):
    """Return the calibration of the night of the module."""
    from photogram.stellar import calibrate_night

    return calibrate_night(night)


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the files of the example."""
    from nights import EXAMPLE

    for name in ("night.toml", "images.csv"):
        (tmp_path / name).write_bytes((EXAMPLE.parent / name).read_bytes())
    return tmp_path
