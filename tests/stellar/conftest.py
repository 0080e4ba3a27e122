"""Fixtures of the stellar camera."""

import sys
from importlib.resources import files
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def plate():
    """Return the example: 75 stars, five images each, three groups."""
    from photogram.stellar.plain import read_plain

    return read_plain(Path(str(files("photogram") / "examples" / "stellar" / "plate.toml")))


@pytest.fixture(scope="session")
def truth(plate):
    """Return the example without errors; its initial values are the true ones."""
    import star_plates as plates

    from photogram.stellar import calibrate

    solved = calibrate(plate).solved.parameters
    return plates.seen(plates.quiet(plate), solved)
