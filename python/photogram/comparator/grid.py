"""Grid plates: built in, from a file, or made square."""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from photogram.arguments.annotations import path
from photogram.arguments.types import Floats, Indices
from photogram.comparator.csvfile import read_table
from photogram.errors import InputError
from photogram.io.numbers import is_whole_number, whole_number
from photogram.lazy_dataclasses import dataclass, replace
from photogram.show.summary import Brief

BUILT_IN = (773, 1320, 778)  # The master grids of the program, in the order of its option MASTER (0, 1, 2)
# What lines above the coordinates of a plate may set
KEYS = ("grid", "owner", "adopted", "sigma_um", "temperature_c", "expansion_per_k")
MOST_EXPANSION = 1e-3  # A kelvin; steel has 1.2e-5, glass 8e-6


@dataclass(frozen=True, eq=False, repr=False)
class Grid(Brief):
    """A grid plate.

    Attributes
    ----------
    number
        Of the plate.
    points
        (l,) point numbers.
    xy_um
        (l, 2) calibrated coordinates in the axes of the plate, micrometres.
    sigma_um
        Standard deviation of a calibrated coordinate; None where it is not known.
    adopted
        Date of the calibration, as text, and what it rests on.
    temperature_c, expansion_per_k
        At which the coordinates hold (degrees Celsius), and by which part of themselves they grow a kelvin;
        None where that is not known.
    source
        The file that it was read from.
    """

    number: int
    points: Indices
    xy_um: Floats
    sigma_um: float | None = None
    adopted: str = ""
    source: Path | None = None
    temperature_c: float | None = None
    expansion_per_k: float | None = None

    def __post_init__(self) -> None:
        """Refuse plates that cannot be."""
        values, counts = np.unique(self.points, return_counts=True)
        if (counts > 1).any():
            raise InputError(f"plate {self.number} has point {values[counts > 1][0]} twice")
        if self.xy_um.shape != (*np.shape(self.points)[:1], 2) or not np.isfinite(self.xy_um).all():
            raise InputError(f"plate {self.number} needs two coordinates for each of its points")
        if self.sigma_um is not None and not 0 <= self.sigma_um < np.inf:
            raise InputError(f"plate {self.number}: {self.sigma_um} um is no standard deviation")
        if self.expansion_per_k is not None and not abs(self.expansion_per_k) < MOST_EXPANSION:
            raise InputError(
                f"plate {self.number}: no material expands by {self.expansion_per_k:g} of itself a kelvin"
            )

    @classmethod
    def square(
        cls, columns: int = 5, spacing_um: float = 50_000.0, number: int = 1, sigma_um: float | None = None
    ) -> Grid:
        """Return a plate of `columns` x `columns` points, centred, numbered along +X, then +Y."""
        steps = (np.arange(columns) - (columns - 1) / 2) * spacing_um
        y, x = np.meshgrid(steps, steps, indexing="ij")
        return cls(
            number, np.arange(1, columns**2 + 1), np.column_stack([x.ravel(), y.ravel()]), sigma_um=sigma_um
        )

    def at(self, temperature_c: float) -> Grid:
        """Return the plate at another temperature: X (1 + expansion (t - t0)).

        Raises
        ------
        InputError
            Its temperature or its expansion is not known.
        """
        if self.temperature_c is None or self.expansion_per_k is None:
            raise InputError(f"plate {self.number} has no temperature_c or no expansion_per_k")
        growth = 1.0 + self.expansion_per_k * (temperature_c - self.temperature_c)
        return replace(self, xy_um=self.xy_um * growth, temperature_c=temperature_c)

    def rows_of(self, points: Indices) -> Indices:
        """Return the rows of points, which must all be on the plate."""
        order = np.argsort(self.points)
        rows: Indices = order[np.searchsorted(self.points, points, sorter=order)]
        return rows

    def to_csv(self) -> bytes:
        """Return the plate as the file that :func:`read_grid` reads."""
        lines = [f"# grid = {self.number}"]
        lines += [f"# adopted = {self.adopted}"] if self.adopted else []
        lines += [f"# sigma_um = {self.sigma_um:g}"] if self.sigma_um is not None else []
        lines += [f"# temperature_c = {self.temperature_c:g}"] if self.temperature_c is not None else []
        lines += [f"# expansion_per_k = {self.expansion_per_k:g}"] if self.expansion_per_k is not None else []
        rows = zip(self.points.tolist(), self.xy_um.tolist(), strict=True)
        lines += ["point,x_um,y_um", *(f"{point},{x!r},{y!r}" for point, (x, y) in rows)]
        return ("\n".join(lines) + "\n").encode()


def read_grid(path: Path) -> Grid:
    """Read a plate: columns point, x_um, y_um (or x_mm, y_mm); `# grid = number`, `# sigma_um = ...` above.

    Above may stand, too, `# adopted = date`, `# owner = ...`, `# temperature_c = 20`, `# expansion_per_k =
    8.5e-6`, `# note = ...`.

    Points with a blank coordinate are left out.

    Raises
    ------
    InputError
        The file cannot be read or is not such a table, or sets what nothing reads.
    """
    table = read_table(path, "point", keys=KEYS)
    points, xy = [], []
    for row in table.records.rows():
        coordinates = table.coordinates_um(row)
        if coordinates is not None:
            points.append(row.integer("point"))
            xy.append(coordinates)
    number = table.settings.get("grid")
    sigma, temperature, expansion = (
        table.settings[key].number() if key in table.settings else None
        for key in ("sigma_um", "temperature_c", "expansion_per_k")
    )
    try:
        return Grid(
            0 if number is None else number.integer(),
            np.array(points, dtype=np.int64),
            np.array(xy, dtype=float).reshape(-1, 2),
            sigma,
            table.text("adopted"),
            path,
            temperature,
            expansion,
        )
    except InputError as error:
        raise InputError(error.message, file=path) from None


@cache
def built_in_grid(number: int) -> Grid:
    """Return a master grid of the program: 773, 1320 or 778.

    Point 11 of 773 and point 13 of 778 are missing: a digit or sign of them is not legible in the report.

    Raises
    ------
    InputError
        There is no such plate.
    """
    if number not in BUILT_IN:
        listed = ", ".join(str(known) for known in BUILT_IN)
        raise InputError(f"there is no built-in grid {number}; there are {listed}")
    with as_file(files("photogram.comparator") / "grids" / f"{number}.csv") as path:
        return read_grid(path)


def find_grid(name: str) -> Grid:
    """Return the plate that a word of the command line means: a built-in number, or a file.

    Raises
    ------
    InputError
        It is neither.
    """
    file = path("name", name)
    if is_whole_number(name) and not file.exists():
        try:
            number = whole_number(name)
        except ValueError as error:
            raise InputError(f"grid {error}") from None
        return built_in_grid(number)
    return read_grid(file)
