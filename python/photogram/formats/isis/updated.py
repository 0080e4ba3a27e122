"""Control networks with what an adjustment has found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogram.formats.isis.network import ControlNetwork
from photogram.formats.isis.outcome import Outcome

__all__ = ["updated_network"]

_UPPER = np.triu_indices(3)


def updated_network(outcome: Outcome) -> ControlNetwork:
    """Return a network with adjusted coordinates, their covariances a posteriori, residuals and rejections.

    What did not count stays as it was read; a point all of whose measures are rejected is rejected.
    """
    network = outcome.contents.network
    points, measures = network.points, network.measures
    used = np.flatnonzero(outcome.result.used_points)
    rows = outcome.point_rows[used]
    adjusted, covariance = np.array(points.adjusted), np.array(points.adjusted_covariance)
    adjusted[rows] = outcome.xyz[used]
    covariance[rows] = outcome.covariances[used][:, _UPPER[0], _UPPER[1]]
    ignored = measures.ignore | points.ignore[network.point_of_measure]
    sample, line = np.array(measures.sample_residual), np.array(measures.line_residual)
    sample[~ignored], line[~ignored] = np.nan, np.nan
    taken = outcome.result.used_images
    sample[outcome.measure_rows[taken]], line[outcome.measure_rows[taken]] = outcome.residuals[taken].T
    counts = ~np.isnan(outcome.contents.starts[:, 0])
    out = counts.copy()
    out[rows] = False
    return replace(
        network,
        points=replace(
            points,
            adjusted=adjusted,
            adjusted_covariance=covariance,
            rejected=np.where(counts, out, points.rejected),
        ),
        measures=replace(
            measures,
            sample_residual=sample,
            line_residual=line,
            rejected=np.where(ignored, measures.rejected, outcome.rejected),
        ),
    )
