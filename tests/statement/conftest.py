"""The adjusted golden block, once for all tests of the statement."""

import pytest
from golden_statement import BLOCK

import photogram
from photogram.formats import read


@pytest.fixture(scope="session")
def result():
    return photogram.adjust(read(BLOCK).block, unit_variance="unity")
