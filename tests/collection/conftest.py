"""What the tests of collections share."""

from __future__ import annotations

import pytest

from golden_data import shared
from photogram.collection import Collection, read


@pytest.fixture(scope="session")
def trafalgar() -> Collection:
    """Trafalgar 21-11315 of "Bundle Adjustment in the Large"; the test is skipped where it is absent."""
    return read(shared("bal", "problem-21-11315-pre.txt"))
