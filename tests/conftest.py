"""What several test files need: blocks of test data that are not part of the repository, small blocks."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest

from photogram import Block, simulate

STRASBOURG = Path(__file__).parents[2] / "shared" / "data" / "strasbourg"


@pytest.fixture(scope="session")
def strasbourg() -> Path:
    """Directory of the Strasbourg block; the test is skipped where it is absent."""
    if not STRASBOURG.is_dir():
        pytest.skip("the Strasbourg block is not there (../shared/data/strasbourg)")
    return STRASBOURG


@pytest.fixture(scope="session")
def small_block() -> Block:
    """Six photos in two strips, control in the corners, five check points; rectangular."""
    return simulate(
        strips=2, photos_per_strip=3, points_per_photo=15, control="corners", check_points=5, seed=3
    ).block


@pytest.fixture
def bad_block(small_block: Block) -> dict[str, object]:
    """Return the arrays of the small block as keywords of Block, to be spoilt by a test."""
    return copy.deepcopy({name: getattr(small_block, name) for name in Block.__dataclass_fields__})
