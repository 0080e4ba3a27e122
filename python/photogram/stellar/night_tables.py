"""Tables of a calibrated night: exposures with their attitudes and odds, images with their stars."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.stellar.nights import CalibratedNight
from photogram.stellar.pointing import axis_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["exposure_table", "image_table"]


def exposure_table(result: CalibratedNight) -> pd.DataFrame:
    """Return one row for each exposure that takes part.

    Angles in degrees; the quaternion (w, x, y, z) leads from ICRS to the camera (x right, y down, z along
    the axis), the covariance (radians squared) is that of the small turn about these axes, its upper triangle
    row by row; `by_chance` is the expected number of chance matches, `log_odds` a natural logarithm.
    """
    import pandas as pd

    rows = []
    for i, (name, exposure, attitude) in enumerate(
        zip(result.names, result.exposures, result.inertial, strict=True)
    ):
        azimuth, elevation = axis_of(result.calibration.attitudes[i])
        ra, dec = attitude.axis
        rows.append(
            {
                "exposure": name,
                "utc": exposure.utc,
                "images": len(exposure.xy),
                "identified": int(result.identified[i]),
                "left_out": int(result.rejected[i]),
                "by_chance": result.odds[i],
                "probability": result.probabilities[i],
                "log_odds": result.log_odds[i],
                "azimuth_deg": math.degrees(azimuth),
                "elevation_deg": math.degrees(elevation),
                "ra_deg": math.degrees(ra),
                "dec_deg": math.degrees(dec),
                **dict(zip(("qw", "qx", "qy", "qz"), attitude.quaternion.tolist(), strict=True)),
                **{
                    f"cov_{a}{b}": attitude.covariance[j, k]
                    for j, a in enumerate("xyz")
                    for k, b in enumerate("xyz")
                    if j <= k
                },
            }
        )
    return pd.DataFrame(rows)


def image_table(result: CalibratedNight) -> pd.DataFrame:
    """Return one row for each image used: pixels, measured minus computed, and how likely its star is."""
    import pandas as pd

    found, ids = result.calibration, result.night.catalogue.ids
    columns = {
        "exposure": [result.names[k] for k in found.exposures],
        "star": [ids[k] for k in found.stars],
        "probability": result.star_probabilities,
    }
    for name, values in (
        ("px", found.xy),
        ("residual_px", found.residuals),
        ("redundancy", found.redundancy),
        ("standardized", found.standardized),
    ):
        columns |= {f"x_{name}": values[:, 0], f"y_{name}": np.asarray(values[:, 1])}
    return pd.DataFrame(columns)
