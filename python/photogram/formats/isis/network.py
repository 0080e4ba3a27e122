"""Control networks: points with their measures in images, as columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.pvl import Group
from photogram.lazy_dataclasses import dataclass, field, fields

__all__ = [
    "MEASURE_TYPES",
    "MESSAGE",
    "POINT_TYPES",
    "SOURCES",
    "ControlMeasures",
    "ControlNetwork",
    "ControlPoints",
]

POINT_TYPES = ("Tie", "Ground", "Free", "Constrained", "Fixed")
"""What types of points mean; `Tie` and `Ground` are what old networks have for `Free` and `Fixed`."""
SOURCES = (
    "None",
    "User",
    "AverageOfMeasures",
    "Reference",
    "Ellipsoid",
    "DEM",
    "Basemap",
    "BundleSolution",
)
"""What sources of a-priori coordinates and radii mean."""
MEASURE_TYPES = ("Candidate", "Manual", "RegisteredPixel", "RegisteredSubPixel")
"""What types of measures mean."""

MESSAGE = ("network_id", "target", "created", "modified", "description", "user")
"""Texts of the header, in the order of their numbers in binary networks."""

_Codes = NDArray[np.int8]
_Indices = NDArray[np.int32]
_Rest = tuple[NDArray[np.uint8], NDArray[np.int64]]


_WIDTHS = {"apriori": 3, "adjusted": 3, "constrained": 3, "apriori_covariance": 6, "adjusted_covariance": 6}
"""Numbers in each row of a column, where there are several."""
_NO_COLUMNS = ("serials", "rest")


class _Columns:
    """Points or measures: all columns have as many rows."""

    rest: _Rest

    def _check(self, rows: int) -> None:
        for each in fields(self):  # type: ignore[arg-type]
            if each.name in _NO_COLUMNS:
                continue
            shape = (rows, _WIDTHS[each.name]) if each.name in _WIDTHS else (rows,)
            found = np.shape(getattr(self, each.name))
            if found != shape:
                raise InputError(f"{each.name} has the shape {found}, not {shape}")
        if self.rest[1].shape != (rows + 1,):
            raise InputError(f"rest begins in {len(self.rest[1])} places, not {rows + 1}")


@dataclass(frozen=True, eq=False)
class ControlPoints(_Columns):
    """The points of a network.

    Coordinates are rectangular and body-fixed, in metres; a covariance is the upper triangle of a matrix, row
    by row, in square metres. Whatever a point does not have is NaN, -1 where it is an index or a code.

    Parameters
    ----------
    ids
        What they are called.
    types
        (n,) index into `POINT_TYPES`.
    edit_lock, ignore, rejected
        (n,) not to be edited; not to be used; rejected by the adjustment.
    reference
        (n,) the measure to which the others of the point refer, counted from its first one.
    apriori_source, apriori_radius_source
        (n,) index into `SOURCES`: where the a-priori coordinates, and the radius, are from.
    apriori, apriori_covariance
        (n, 3), (n, 6) coordinates before an adjustment.
    constrained
        (n, 3) whether latitude, longitude and radius are weighted.
    adjusted, adjusted_covariance
        (n, 3), (n, 6) coordinates of an adjustment.
    rest
        What else was read (who chose the point, when; files of sources; what nobody knows): fields of
        messages, byte for byte, and where those of each point begin (n + 1). It is written back.
    """

    ids: Sequence[str]
    types: _Codes
    edit_lock: Bools
    ignore: Bools
    rejected: Bools
    reference: _Indices
    apriori_source: _Codes
    apriori_radius_source: _Codes
    apriori: Floats
    apriori_covariance: Floats
    constrained: Bools
    adjusted: Floats
    adjusted_covariance: Floats
    rest: _Rest

    def __post_init__(self) -> None:
        """Check the shapes of the columns."""
        self._check(len(self.ids))

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.ids)

    @property
    def is_fixed(self) -> Bools:
        """(n,) whether a point is held where it is: `Fixed`, in old networks `Ground`."""
        return np.isin(self.types, [POINT_TYPES.index("Fixed"), POINT_TYPES.index("Ground")])

    @property
    def is_constrained(self) -> Bools:
        """(n,) whether the a-priori coordinates of a point are observed: `Constrained`."""
        return np.asarray(self.types == POINT_TYPES.index("Constrained"))


@dataclass(frozen=True, eq=False)
class ControlMeasures(_Columns):
    """The measures of a network, those of a point one after the other.

    Samples and lines are pixels, counted so that the centre of an image's first pixel is (1, 1). Whatever a
    measure does not have is NaN.

    Parameters
    ----------
    serials
        Serial numbers of images, each once.
    serial
        (m,) index of the image in `serials`.
    types
        (m,) index into `MEASURE_TYPES`.
    sample, line
        (m,) what was measured.
    apriori_sample, apriori_line
        (m,) where it was expected.
    sample_sigma, line_sigma
        (m,) standard deviations.
    sample_residual, line_residual
        (m,) residuals of an adjustment.
    diameter
        (m,) of a crater that was measured.
    edit_lock, ignore, rejected
        (m,) not to be edited; not to be used; rejected by the adjustment.
    rest
        What else was read, as in :class:`ControlPoints`: who measured, when, numbers of the registration.
    """

    serials: Sequence[str]
    serial: _Indices
    types: _Codes
    sample: Floats
    line: Floats
    apriori_sample: Floats
    apriori_line: Floats
    sample_sigma: Floats
    line_sigma: Floats
    sample_residual: Floats
    line_residual: Floats
    diameter: Floats
    edit_lock: Bools
    ignore: Bools
    rejected: Bools
    rest: _Rest

    def __post_init__(self) -> None:
        """Check the shapes of the columns."""
        self._check(len(self.serial))

    def __len__(self) -> int:
        """Return the number of measures."""
        return len(self.serial)


@dataclass(frozen=True, eq=False)
class ControlNetwork:
    """A control network.

    What an adjustment has found is put into it by :func:`dataclasses.replace`: into the points, the measures,
    and these into the network. What is not replaced is written as it was read.

    Parameters
    ----------
    points, measures
        Its points and their measures.
    firsts
        (n + 1,) the first measure of each point, and the number of all.
    network_id, target, user, created, modified, description
        What its header says; None where it does not. ISIS reads no network without the first two.
    version
        Of the file that it was read from.
    radii
        (3,) radii of the target in metres; (0,) where they are not said.
    others
        Keys and groups of the header that nobody knows.
    header_rest
        Fields of the binary header that nobody knows, byte for byte.
    """

    points: ControlPoints
    measures: ControlMeasures
    firsts: NDArray[np.int64]
    network_id: str | None = ""
    target: str | None = ""
    user: str | None = None
    created: str | None = None
    modified: str | None = None
    description: str | None = None
    version: int = 5
    radii: Floats = field(default_factory=lambda: np.zeros(0))
    others: Group = field(default_factory=lambda: Group("", "label"))
    header_rest: bytes = b""

    def __post_init__(self) -> None:
        """Check that the measures are those of the points."""
        if self.firsts.shape != (len(self.points) + 1,):
            raise InputError(f"firsts has the shape {self.firsts.shape}, not {(len(self.points) + 1,)}")

    @property
    def point_of_measure(self) -> NDArray[np.int64]:
        """(m,) the point of each measure."""
        return np.repeat(np.arange(len(self.points)), np.diff(self.firsts))
