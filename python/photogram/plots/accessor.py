"""`result.plot`: the pictures of a result by name, and all of them at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from photogram.errors import InputError
from photogram.plots.correlations import correlations, correlations_sketch
from photogram.plots.distortion import distortion, distortion_sketch
from photogram.plots.features import features, features_sketch
from photogram.plots.films import films, films_sketch
from photogram.plots.network import network, network_sketch
from photogram.plots.redundancy import redundancy, redundancy_sketch
from photogram.plots.residuals import residuals, residuals_sketch
from photogram.plots.tests import tests, tests_sketch
from photogram.plots.trajectories import trajectory
from photogram.show.axes import Where
from photogram.show.sketch.declared import Sketch
from photogram.show.sketch.on_axes import figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURES: dict[str, Callable[[object], Sketch]] = {
    "network": network_sketch,
    "residuals": residuals_sketch,
    "redundancy": redundancy_sketch,
    "tests": tests_sketch,
    "correlations": correlations_sketch,
    "distortion": distortion_sketch,
    "features": features_sketch,
    "films": films_sketch,
}
"""What declares each picture, by name, in the order in which a reader looks at them."""


class Plots:
    """The pictures of a result. Each takes and returns axes of matplotlib (`pip install 'photogram[plots]'`).

    Parameters
    ----------
    result
        An adjusted block or collection.
    """

    def __init__(self, result: object) -> None:
        self._result = result

    def __repr__(self) -> str:
        return f"pictures: {', '.join(f'.{name}()' for name in PICTURES)}, .save(folder)"

    def network(self, ax: Where = None, *, plane: str | None = None) -> Axes:
        """Draw the network in plan; see :func:`photogram.plots.network`."""
        return network(self._result, ax, plane=plane)

    def residuals(self, ax: Where = None) -> Any:
        """Draw image residuals over the frame; see :func:`photogram.plots.residuals`."""
        return residuals(self._result, ax)

    def redundancy(self, ax: Where = None) -> Any:
        """Draw redundancy numbers over frame and network; see :func:`photogram.plots.redundancy`."""
        return redundancy(self._result, ax)

    def tests(self, ax: Where = None) -> Any:
        """Draw test values against the normal distribution; see :func:`photogram.plots.tests`."""
        return tests(self._result, ax)

    def correlations(self, ax: Where = None) -> Any:
        """Draw correlations of parameters of cameras; see :func:`photogram.plots.correlations`."""
        return correlations(self._result, ax)

    def distortion(self, ax: Where = None) -> Any:
        """Draw curves of radial distortion; see :func:`photogram.plots.distortion`."""
        return distortion(self._result, ax)

    def features(self, ax: Where = None) -> Any:
        """Draw deviations of points from their features; see :func:`photogram.plots.features`."""
        return features(self._result, ax)

    def films(self, ax: Where = None) -> Any:
        """Draw residuals of marks and patterns of films; see :func:`photogram.plots.films`."""
        return films(self._result, ax)

    def trajectory(self, ax: Where = None, *, name: str | None = None) -> Any:
        """Draw the corrections of a trajectory over time; see :func:`photogram.plots.trajectories`."""
        return trajectory(self._result, ax, name=name)

    def save(self, folder: Path | str, ending: str = "png") -> list[Path]:
        """Write all pictures that there are, `network.png` ..., and return their places.

        Parameters
        ----------
        folder
            Where to.
        ending
            Of the names, and so the format: `png`, `svg`, `pdf`.

        Raises
        ------
        InputError
            An ending that names no format.
        ModuleNotFoundError
            matplotlib is absent.
        """
        from photogram.io.writing import write_whole

        written = picture_files(self._result, Path(folder), ending)
        write_whole(written)
        return list(written)


def sketch_of(result: object, name: str) -> Sketch | None:
    """Return a picture of a result before it is drawn; None where there is nothing of it."""
    try:
        return PICTURES[name](result)
    except InputError:
        return None


def figures(result: object, names: Sequence[str] = tuple(PICTURES)) -> dict[str, Figure]:
    """Return pictures of a result by name, each a figure that belongs to no window.

    Those that there is nothing of are left out: correlations and distortion of known cameras, redundancy and
    tests without covariances, features where none are fitted, films where nothing is scanned.

    Parameters
    ----------
    result
        An adjusted block or collection.
    names
        Which, of `network`, `residuals`, `redundancy`, `tests`, `correlations`, `distortion`,
        `features`, `films`.

    Raises
    ------
    InputError
        Other names.
    ModuleNotFoundError
        matplotlib is absent.
    TypeError
        A result without photos and points.
    """
    if unknown := [name for name in names if name not in PICTURES]:
        raise InputError(f"there is no picture {', '.join(unknown)}, but {', '.join(PICTURES)}")
    found = {name: sketch for name in names if (sketch := sketch_of(result, name)) is not None}
    return {name: figure(sketch) for name, sketch in found.items()}


def picture_files(result: object, folder: Path, ending: str = "png") -> dict[Path, bytes]:
    """Return all pictures of a result as files of a folder, in the format of their ending.

    Raises
    ------
    InputError
        An ending that names no format.
    ModuleNotFoundError
        matplotlib is absent.
    """
    from photogram.show.pictures import files

    return files(figures(result), folder, ending)
