"""Common interface of blocks and collections before the adjustment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from photogram.arguments.types import Floats, Indices
from photogram.network.observations import Observation


class Given(Protocol):
    """P photos, n points and m image observations to adjust together: a block or a collection."""

    @property
    def photo_ids(self) -> list[str]:
        """P names of photos."""

    @property
    def point_ids(self) -> list[str]:
        """Names of the n points."""

    @property
    def point_positions(self) -> Floats:
        """(n, 3) given positions; NaN if unknown."""

    @property
    def point_sd(self) -> Floats:
        """(n, 3) standard deviations of observed coordinates: infinite is free, zero is fixed."""

    @property
    def image_photos(self) -> Indices:
        """(m,) photo index of each image observation."""

    @property
    def image_points(self) -> Indices:
        """(m,) point index of each image observation."""

    @property
    def image_xy(self) -> Floats:
        """(m, 2) image coordinates."""

    @property
    def image_sd(self) -> Floats:
        """(m, 2) a-priori standard deviations of image coordinates."""

    @property
    def observations(self) -> Sequence[Observation]:
        """Additional observations."""

    @property
    def image_unit(self) -> str:
        """Unit of image coordinates, `mm` or `px`."""

    @property
    def geographic(self) -> bool:
        """Whether positions are longitude, latitude and height."""
