"""The packaged example of a night, and the script that made it."""

import runpy
from importlib.resources import files
from pathlib import Path

EXAMPLE = Path(str(files("photogram") / "examples" / "exposures" / "night.toml"))
MAKER = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "make_exposures.py"))
