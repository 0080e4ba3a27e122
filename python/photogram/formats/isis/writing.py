"""Writing control networks, binary ones of version 5 and text, and all that stands beside an adjusted one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from photogram import _photocore
from photogram.errors import InputError
from photogram.formats.isis.jigsaw_files import jigsaw_files
from photogram.formats.isis.network import (
    HEADER,
    MESSAGE,
    ControlNetwork,
    columns_of_measures,
    columns_of_points,
)
from photogram.formats.isis.outcome import Outcome, contents_of
from photogram.formats.isis.reading import LABEL_BYTES, is_binary
from photogram.formats.isis.support import updated_support
from photogram.formats.project import Project
from photogram.io.pvl import Group, Value, label_text
from photogram.results.result import Result
from photogram.words import phrase

_VERSION = 5
_END = "End_Object\nEnd\n"
_UPPER = np.triu_indices(3)


def _header(network: ControlNetwork) -> list[tuple[str, Value]]:
    """Return what a network says of itself, in the order of ISIS."""
    return [(key, text) for key, name in HEADER.items() if (text := getattr(network, name)) is not None]


def binary_network(network: ControlNetwork) -> bytes:
    """Return a network as a binary file of version 5.

    Every field of every point and measure stands there as it was read, but for those whose columns have other
    values now.

    Raises
    ------
    InputError
        Columns that do not agree; something that was read from text and has no place in a binary network: the
        message names it, and the point.
    """
    columns = columns_of_points(network.points), columns_of_measures(network.measures)
    points = _photocore.control_point_messages(*columns, network.firsts)
    texts = [getattr(network, name) for name in MESSAGE]
    radii = network.radii.tolist()
    header = _photocore.control_header_message(texts, len(network.points), radii, network.header_rest)
    counts: list[tuple[str, Value]] = [
        ("NumberOfPoints", len(network.points)),
        ("NumberOfMeasures", len(network.measures)),
        ("Version", _VERSION),
    ]
    places: list[tuple[str, Value]] = [
        ("HeaderStartByte", LABEL_BYTES),
        ("HeaderBytes", len(header)),
        ("PointsStartByte", LABEL_BYTES + len(header)),
        ("PointsBytes", len(points)),
    ]
    info = [*_header(network), *counts, *network.others.items]
    inside = [Group("Core", "object", items=places), Group("ControlNetworkInfo", "group", items=info)]
    buffer = Group("ProtoBuffer", "object", inside=[*inside, *network.others.inside])
    label = label_text(Group("", "label", inside=[buffer])).encode()
    if len(label) > LABEL_BYTES:
        raise InputError(phrase("isis.label", n=len(label), size=LABEL_BYTES))
    return label.ljust(LABEL_BYTES, b"\0") + header + points


def network_text(network: ControlNetwork) -> bytes:
    """Return a network as text of version 5.

    Raises
    ------
    InputError
        Columns that do not agree; something that was read from a binary network and has no key in text: the
        message names it, and the point.
    """
    if network.header_rest:
        raise InputError(phrase("isis.fields"))
    columns = columns_of_points(network.points), columns_of_measures(network.measures)
    points = _photocore.control_point_text(*columns, network.firsts)
    items = _header(network)
    if network.radii.size:
        items.append(("TargetRadii", list[Value](network.radii.tolist())))
    items += [("Version", _VERSION), *network.others.items]
    own = replace(network.others, name="ControlNetwork", kind="object", items=items)
    head = label_text(Group("", "label", inside=[own])).removesuffix(_END)
    return head.encode() + points + _END.encode()


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
