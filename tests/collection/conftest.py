"""What the tests of collections share."""

from __future__ import annotations

from pathlib import Path

import pytest

from photogram.collection import Collection, read

DATA = Path(__file__).parents[3] / "shared" / "data" / "bal"


@pytest.fixture(scope="session")
def trafalgar() -> Collection:
    """Trafalgar 21-11315 of "Bundle Adjustment in the Large"; the test is skipped where it is absent."""
    path = DATA / "problem-21-11315-pre.txt"
    if not path.is_file():
        pytest.skip("the problem is not there (../shared/data/bal)")
    return read(path)
