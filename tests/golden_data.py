"""Golden data of the repository, and data sets of other projects beside it."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest

DATA = Path(__file__).parent / "data"
SHARED = Path(__file__).parents[2] / "shared" / "data"


def golden(*names: str) -> Any:
    """Return the content of a JSON file of `DATA`, plain or compressed (`name.json.gz`)."""
    path = DATA.joinpath(*names)
    if path.exists():
        return json.loads(path.read_text(encoding="utf-8"))
    return json.loads(gzip.decompress(path.with_name(path.name + ".gz").read_bytes()))


def shared(*names: str) -> Path:
    """Return a path below `SHARED`; skip the test if it is absent."""
    if needs(*names).args[0]:
        pytest.skip(needs(*names).kwargs["reason"])
    return SHARED.joinpath(*names)


def needs(*names: str) -> pytest.MarkDecorator:
    """Return the mark of tests that are skipped if a path below `SHARED` is absent."""
    reason = f"needs ../shared/data/{'/'.join(names)}, the data of another project"
    return pytest.mark.skipif(not SHARED.joinpath(*names).exists(), reason=reason)
