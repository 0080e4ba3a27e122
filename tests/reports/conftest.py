"""What tests of reports share."""

import browser as browsers
import pytest


@pytest.fixture(scope="session")
def browser():
    """Start a browser once."""
    with browsers.running() as started:
        yield started
