"""`result.plot`: the plots of a result by name, and all of them at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec

from photogram.errors import InputError
from photogram.plots.distortion import correlations, distortion
from photogram.plots.features import features
from photogram.plots.network import network, undetected
from photogram.plots.residuals import films, redundancy, residuals
from photogram.plots.tests import tests
from photogram.plots.trajectories import trajectory
from photogram.show.page import Drawing, about
from photogram.show.sketch.plot import Plot

P = ParamSpec("P")

# Plots of any network, in the order in which they are written
DRAWN = (network, residuals, redundancy, undetected, tests, correlations, distortion, features, films)
PLOTS: dict[str, Callable[[Any], Plot]] = {function.__name__: function for function in DRAWN}


class _Method(Generic[P]):
    """A function of a result as a method of `Plots`, with docstring and arguments."""

    def __init__(self, function: Callable[Concatenate[Any, P], Plot]) -> None:
        self._function = function

    def __get__(self, plots: Plots | None, owner: type) -> Callable[P, Plot]:
        return MethodType(self._function, owner if plots is None else plots._result)


class Plots:
    """The plots of a result. Each method returns a :class:`Plot`.

    Parameters
    ----------
    result
        An adjusted block or collection.
    """

    network = _Method(network)
    residuals = _Method(residuals)
    redundancy = _Method(redundancy)
    undetected = _Method(undetected)
    tests = _Method(tests)
    correlations = _Method(correlations)
    distortion = _Method(distortion)
    features = _Method(features)
    films = _Method(films)
    trajectory = _Method(trajectory)

    def __init__(self, result: object) -> None:
        self._result = result

    def __repr__(self) -> str:
        return f"plots: {', '.join(f'.{name}()' for name in PLOTS)}, .save(folder)"

    def available(self) -> dict[str, Plot]:
        """Return the plots for which the result has data, by name.

        Plots are omitted if the result has no data for them: correlations and distortion of fixed cameras,
        redundancy, undetected errors and tests without covariances, features and films of a block without
        them.
        """
        return {name: plot for name in PLOTS if (plot := sketch_of(self._result, name))}

    def save(self, folder: Path | str, ending: str = "png") -> list[Path]:
        """Write all available plots to a folder, `network.png` ..., and return the paths.

        Parameters
        ----------
        folder
            Output folder.
        ending
            File name extension, which defines the format: `png`, `svg`, `pdf`.

        Raises
        ------
        InputError
            If the extension is unknown.
        ModuleNotFoundError
            If matplotlib is not installed (`pip install 'photogram[plots]'`); only `svg` does not need it.
        """
        from photogram.io.writing import write_whole

        plots = self.available().items()
        written = {Path(folder) / f"{name}.{ending}": plot.render(ending) for name, plot in plots}
        write_whole(written)
        return list(written)


def sketch_of(result: object, name: str) -> Plot | None:
    """Return a plot of a result; None if the result has no data for it."""
    try:
        return PLOTS[name](result)
    except InputError:
        return None


PICTURES = ("network", "residuals", "redundancy", "tests", "correlations", "distortion", "features", "films")


def drawings(result: object, names: Sequence[str] = PICTURES) -> dict[str, Drawing]:
    """Return the drawings of a result by name; those without data are empty."""
    return {
        name: Drawing(
            f"picture-{name}",
            about(f"{name}.title"),
            about(f"{name}.caption"),
            partial(sketch_of, result, name),
        )
        for name in names
    }
