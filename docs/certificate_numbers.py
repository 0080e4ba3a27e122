"""The numbers of docs/certificates.md: `python docs/regenerate.py certificates.md`."""

from __future__ import annotations

import tempfile
from importlib.resources import files
from pathlib import Path
from textwrap import wrap

from photogram.film import Certificate, compare_cameras
from photogram.film.years import simulated_certificates
from photogram.show.forms import table_text, written

EXAMPLE = files("photogram") / "examples" / "certificate" / "rc10.toml"


def slip_lines() -> list[str]:
    """Exchange two digits of a distance of the example, and say what the report says of it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rc10.toml"
        path.write_text(EXAMPLE.read_text(encoding="utf-8").replace("220.018", "220.108"), encoding="utf-8")
        document = Certificate.read(path).document()
    tables = [document.table("distances"), document.table("explanations")]
    return [line for table in tables for line in (table.title, *table_text(written(table)), "")][:-1]


def years_lines() -> list[str]:
    """Compare the simulated certificates of the example of `camera compare`."""
    found = compare_cameras(simulated_certificates())
    tables = [found.document().table(key) for key in ("calibrations", "series")]
    lines = [line for table in tables for line in ("", *table_text(written(table)))]
    return [*wrap(found.verdict.headline, 118), *lines]


BLOCKS = {"slip": slip_lines, "years": years_lines}
