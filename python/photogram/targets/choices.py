"""Words that options of calibrations accept."""

from typing import Literal

Shape = Literal["held", "bend", "points"]  # estimated: none, centre-line deflections, every point
ViewBy = Literal["name", "time"]
Synchronisation = Literal["known", "none", "offset"]
Regularisation = Literal["mrcal"]
CornerBasis = Literal["kind", "camera", "level", "photo", "component", "rays"]
PixelOrigin = Literal["corner", "center"]
