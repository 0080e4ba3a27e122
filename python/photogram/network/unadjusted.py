"""What every network has before its adjustment, whatever numbers its poses and cameras are in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from photogram.arguments.types import Floats, Indices
from photogram.network.observations import Observation


class Given(Protocol):
    """P photos, n points and m image points that are adjusted together: a block or a collection."""

    @property
    def photo_ids(self) -> list[str]:
        """P names."""

    @property
    def point_ids(self) -> list[str]:
        """N names."""

    @property
    def point_positions(self) -> Floats:
        """(n, 3) as they were given; NaN where unknown."""

    @property
    def point_sd(self) -> Floats:
        """(n, 3) standard deviations of coordinates as observations: infinite not held, zero fixed."""

    @property
    def image_photos(self) -> Indices:
        """(m,) the photo of each image."""

    @property
    def image_points(self) -> Indices:
        """(m,) the point of each image."""

    @property
    def image_xy(self) -> Floats:
        """(m, 2) image coordinates."""

    @property
    def image_sd(self) -> Floats:
        """(m, 2) their standard deviations a priori."""

    @property
    def observations(self) -> Sequence[Observation]:
        """What else was observed."""

    @property
    def image_unit(self) -> str:
        """What image coordinates are measured in, `mm` or `px`."""

    @property
    def geographic(self) -> bool:
        """Whether positions are longitude, latitude and height."""
