"""What stands beside an adjusted control network: jigsaw's tables, the network, support data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from photogram.formats.isis.contents import contents_of
from photogram.formats.isis.jigsaw_files import jigsaw_files
from photogram.formats.isis.network import ControlNetwork
from photogram.formats.isis.outcome import Outcome
from photogram.formats.isis.reading import is_binary
from photogram.formats.isis.support import updated_support
from photogram.formats.isis.writing import binary_network, network_text
from photogram.formats.project import Project
from photogram.results.result import Result

_UPPER = np.triu_indices(3)


def results(project: Project, result: Result) -> Mapping[str, bytes]:
    """Return the files of an adjusted network by their names."""
    outcome = Outcome(contents_of(project.details), result)
    path = outcome.contents.path
    files = dict(jigsaw_files(outcome))
    files[path.name] = (binary_network if is_binary(path) else network_text)(_updated_network(outcome))
    names: dict[str, int] = {}
    for image in outcome.contents.different:
        content = updated_support(image, result.trajectories[image.solving.trajectory.name])
        if content is None:
            continue
        count = names[image.path.name] = names.get(image.path.name, 0) + 1
        folder = "support" if count == 1 else f"support-{count}"
        files[f"{folder}/{image.path.name}"] = content
    return files


def _updated_network(outcome: Outcome) -> ControlNetwork:
    """Return a network with adjusted coordinates, their covariances a posteriori, residuals and rejections.

    What did not count stays as it was read; a point all of whose measures are rejected is rejected.
    """
    network = outcome.contents.network
    points, measures, ignored = network.points, network.measures, network.is_ignored
    used = np.flatnonzero(outcome.result.used_points)
    rows = outcome.point_rows[used]
    adjusted, covariance = np.array(points.adjusted), np.array(points.adjusted_covariance)
    adjusted[rows] = outcome.xyz[used]
    covariance[rows] = outcome.covariances[used][:, _UPPER[0], _UPPER[1]]
    residuals = np.column_stack([measures.sample_residual, measures.line_residual])
    residuals[~ignored] = np.nan
    taken = outcome.result.used_images
    residuals[outcome.measure_rows[taken]] = outcome.residuals[taken]
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
            sample_residual=residuals[:, 0],
            line_residual=residuals[:, 1],
            rejected=np.where(ignored, measures.rejected, outcome.rejected),
        ),
    )
