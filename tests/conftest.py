"""What several test files need: the Strasbourg block, small blocks, the command line."""

from __future__ import annotations

import copy
import functools
import os
from pathlib import Path

import pytest
import typer.testing
from hypothesis import HealthCheck, settings
from typer.testing import CliRunner

import browser as browsers
from golden_data import shared
from photogram import Block, simulate
from photogram.cli import app

# A busy machine is slow: the durations of the suite list slow tests. Continuous integration repeats the same
# examples, so that a failure belongs to the change; other runs draw new ones.
settings.register_profile(
    "photogram",
    deadline=None,
    derandomize="CI" in os.environ,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("photogram")

# The runner of typer builds all commands for every run, which takes more time than most commands need.
typer.testing._get_command = functools.cache(typer.testing._get_command)


@pytest.fixture(scope="session")
def strasbourg() -> Path:
    """Directory of the Strasbourg block; the test is skipped where it is absent."""
    return shared("strasbourg")


@pytest.fixture(scope="session")
def roma() -> Path:
    """Directory of the Roma photos; the test is skipped where it is absent."""
    return shared("roma")


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


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run the command line in an empty directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("NO_COLOR", "1")
    runner = CliRunner()
    return lambda *arguments: runner.invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def browser():
    """Start a browser once for the tests of a file."""
    with browsers.running() as started:
        yield started
