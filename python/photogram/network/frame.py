"""Reference frame of the coordinates of a block."""

from __future__ import annotations

from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase


@dataclass(frozen=True)
class Frame:
    """Reference frame of the coordinates of a block.

    Attributes
    ----------
    kind
        `cartesian`, `topocentric` (east, north, up at the origin), `geocentric` or `geographic`.
    crs
        Coordinate reference system of the origin, or of the coordinates; empty if unspecified.
    origin
        Latitude and longitude in degrees and ellipsoidal height in metres of a topocentric frame.
    ellipsoid
        Semi-axes of the ellipsoid of geographic coordinates; WGS 84.
    """

    kind: str = "cartesian"
    crs: str = ""
    origin: tuple[float, float, float] | None = None
    ellipsoid: tuple[float, float] = (6378137.0, 6356752.314245179)

    @property
    def phrase(self) -> Phrase:
        """The frame as a message."""
        own = Phrase(f"frame.{self.kind}")
        if self.origin is not None:
            place = zip(("latitude", "longitude", "height"), self.origin, strict=True)
            own = Phrase("frame.origin", {"frame": own, **dict(place)})
        return Phrase("frame.crs", {"frame": own, "crs": self.crs}) if self.crs else own

    def __str__(self) -> str:
        return str(self.phrase)
