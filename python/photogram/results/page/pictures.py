"""Which pictures of a network stand on its page, and what a reader sees on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from photogram.results.network import AdjustedNetwork
from photogram.show.page import Drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["drawings"]

CAPTIONS = {
    "network": (
        "Plan of the network",
        "Photos with what they show, points by their number of rays, control and check points with their"
        " differences, and error ellipses (95 percent). What is enlarged has a scale bar.",
    ),
    "residuals": (
        "Image residuals over the frame",
        "Observed minus computed, camera by camera: one by one, or the means of cells where there are many."
        " Arrows that point alike in one part of the frame are what the camera model does not explain.",
    ),
    "redundancy": (
        "Redundancy over the frame and over the network",
        "Where the network checks itself, and where not: dark places have errors that nobody sees.",
    ),
    "tests": (
        "Test values against the normal distribution",
        "Left the histogram, right the ordered test values over those expected: they lie on the line where"
        " the standard deviations are right, on a steeper one where these are too small; single ones"
        " away from it"
        " are gross errors.",
    ),
    "correlations": (
        "Correlations of the parameters of cameras",
        "Strong colours away from the diagonal: parameters that the network can hardly tell apart.",
    ),
    "distortion": (
        "Radial distortion with its standard deviations",
        "The curve, dashed where no image lies; where it is estimated, with one standard deviation beside.",
    ),
    "features": (
        "Deviations of points from their features",
        "Outside positive, of a plane on the side of its normal; bars are U to either side.",
    ),
    "films": (
        "Residuals of fiducial marks, and patterns of films",
        "Means over all photos, in the frame of the camera: marks that stay off on all of them are those of"
        " the certificate, or a pattern that was left out. Patterns as the adjustment has them.",
    ),
}
"""Title and caption by name."""


def drawings(result: AdjustedNetwork) -> dict[str, Drawing]:
    """Return the pictures that a result may have, by name; what there is nothing of draws nothing."""
    return {
        name: Drawing(f"picture-{name}", *words, _drawing(result, name)) for name, words in CAPTIONS.items()
    }


def _drawing(result: AdjustedNetwork, name: str) -> Callable[[], Figure | None]:
    def draw() -> Figure | None:
        from photogram.plots import figures  # takes long to import

        return figures(result, [name]).get(name)

    return draw
