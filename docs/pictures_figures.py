"""Draw the pictures of docs/pictures.md and docs/statement.md: docs/pictures/*.svg.

    python docs/pictures_figures.py

The network is the packaged example of GIANT, the camera that of examples/self_calibration.py; the field of
residuals is a simulated block whose camera bends a little more than the adjustment knows, the features are
those of the example of metrology, films those of the example of an archive, the map of the statement is that
of the example of a survey.
"""

from __future__ import annotations

import sys
from importlib.resources import files
from pathlib import Path

import numpy as np

from photogram import Block, InnerConstraints, Result, adjust, adjust_started, first_values, formats, simulate
from photogram.giant import read_project
from photogram.plots import Plot
from photogram.results.features import with_features
from photogram.show.page import Drawing

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from self_calibration import measured

FOLDER = Path(__file__).with_name("pictures")


def bent() -> Block:
    """Return a simulated block with a lens that is not perfect: 20 micrometres in the corners."""
    block = simulate(
        strips=6, photos_per_strip=30, points_per_photo=80, position_sd=0.05, image_sd=0.004, seed=1
    ).block
    radius = np.hypot(*block.image_xy.T)[:, np.newaxis]
    return block.replace(image_xy=block.image_xy * (1.0 + 0.02 * radius**2 / 160.0**3))


def part() -> Result:
    """Return the packaged example of metrology, adjusted, with the circle through its holes."""
    project = formats.read(str(files("photogram") / "examples" / "flange"))
    result = adjust_started(first_values(project.block), datum=InnerConstraints())
    return with_features(result, project.features)


def scanned() -> Result:
    """Return the packaged example of an archive, adjusted."""
    project = formats.read(str(files("photogram") / "examples" / "archive"))
    return adjust(project.block, unit_variance="unity")


def stated() -> Plot:
    """Return the map on the first sheet of the statement of the packaged survey."""
    project = formats.read(str(files("photogram") / "examples" / "survey"))
    page = adjust(project.block, unit_variance="unity").statement(**project.statement).document()
    drawings = [part for section in page.sections for part in section.parts if isinstance(part, Drawing)]
    plot = next(each for each in drawings if each.name == "map-differences").sketch()
    assert plot is not None
    return plot


def results() -> dict[str, tuple[Result, tuple[str, ...]]]:
    """Return adjustments, and which pictures are taken of each."""
    galveston = adjust(read_project(files("photogram") / "examples" / "galveston").to_block())
    return {
        "giant": (galveston, ("network", "redundancy", "undetected", "tests")),
        "lens": (adjust(measured()), ("correlations", "distortion")),
        "bent": (adjust(bent()), ("residuals",)),
        "part": (part(), ("features",)),
        "scanned": (scanned(), ("films",)),
    }


def pictures() -> dict[str, str]:
    """Return the drawings by their names."""
    every = {name: getattr(result.plot, name)() for result, names in results().values() for name in names}
    every["statement"] = stated()
    return {name: plot.render("svg").decode() for name, plot in every.items()}


def main() -> None:
    """Write the pictures."""
    FOLDER.mkdir(exist_ok=True)
    for name, svg in pictures().items():
        (FOLDER / f"{name}.svg").write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    main()
