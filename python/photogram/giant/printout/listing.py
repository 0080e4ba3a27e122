"""The printout of a job: selection and order of its pages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import rows_of_each, truth_value
from photogram.arguments.types import Bools
from photogram.giant.fields import printed_order
from photogram.giant.limits import Limits, error_warnings
from photogram.giant.printout.forms import Page, Space, printout
from photogram.giant.printout.input import control_pages, frame_pages, options_page, warning_pages
from photogram.giant.printout.results import (
    Residuals,
    correction_pages,
    iteration_pages,
    point_pages,
    propagated_point_pages,
    residual_pages,
    station_pages,
    statistics,
)
from photogram.network.block import Block
from photogram.results.result import Result

if TYPE_CHECKING:
    from photogram.giant import Project

NOTICES = {
    "converged": "",
    "not converged": "SOLUTION HAS NOT CONVERGED",
    "diverged": "SOLUTION HAS DIVERGED",
}


def listing(
    project: Project,
    block: Block,
    result: Result,
    *,
    as_published: bool = False,
    limits: Limits | None = None,
) -> str:
    """Return the printout of the 1987 program (unit 6) for an adjusted project.

    Columns 3 to 6, 8 and 11 of COMMON and its residual limit select the contents; see
    `docs/giant-listing.md`.

    Parameters
    ----------
    project, block
        The adjusted project: `block` is `project.to_block()`, with or without limits or another refraction.
    result
        The adjustment of the block, whether it converged or not.
    as_published
        If True, print only lines of the 1987 program. Corrections of unheld control components are then the
        changes of the last iteration instead of adjusted minus supplied.
    limits
        The limits of the block.

    Returns
    -------
    Lines with FORTRAN carriage control: a `1` in the first column begins a page.
    """
    truth_value("as_published", as_published)
    space = Space(block.geographic, block.linear_unit)
    pages = [
        options_page(
            project.common, space, block.refraction, result.unit_variance, as_published=as_published
        ),
        *_input_pages(project, block, space),
        *warning_pages(error_warnings(project, block, limits)),
    ]
    notice = "" if as_published else NOTICES[result.status]
    if not project.common.intersection_only:
        pages += iteration_pages(
            space,
            block.photo_ids,
            result.iterations,
            result.photo_corrections,
            notice,
            as_published=as_published,
        )
    for page in _result_pages(project, block, result, space, as_published):
        pages.append([notice, *page] if notice else page)
    return printout(block.title, pages)


def _input_pages(project: Project, block: Block, space: Space) -> Iterator[Page]:
    common = project.common
    if common.list_input_stations or common.list_input_images:
        images = {frame.name: frame for frame in reversed(project.images)}
        distances = block.known_distances("GIANT files")
        poses = block.photo_positions, block.photo_attitudes, block.photo_position_sd, block.photo_attitude_sd
        for row, name in enumerate(block.photo_ids):
            yield from frame_pages(
                space,
                block.photo_to_ground,
                [each[row] for each in poses],
                distances[row],
                images[name],
                parameters=common.list_input_stations,
                plates=common.list_input_images,
            )
    if common.list_input_control and project.ground:
        yield from control_pages(space, project.ground, common.default_control_sd)


def _result_pages(
    project: Project, block: Block, result: Result, space: Space, as_published: bool
) -> Iterator[Page]:
    common = project.common
    freedom = result.degrees_of_freedom
    if result.unit_variance == "unity":  # As in 1987: sums of squares of free cameras
        sd = result.photo_given_sd
        freedom -= np.count_nonzero((sd > 0) & np.isfinite(sd))
    closing = statistics(result.sums_of_squares, freedom, result.variance_of_unit_weight)
    yield from residual_pages(
        _residuals(block, result), common.residual_limit, closing, as_published=as_published
    )
    # Covariances of a diverged adjustment may be missing.
    used = result.used_points
    propagated = common.error_propagation and bool(
        np.isfinite(result.photo_cofactors).all() and np.isfinite(result.point_cofactors[used]).all()
    )
    if common.list_stations and not common.intersection_only:
        yield from station_pages(
            space,
            block.photo_to_ground,
            block.photo_ids,
            result.photo_positions,
            result.photo_attitudes,
            result.photo_covariances if propagated else None,
        )
    if common.list_points:
        yield from _points(project, block, result, space, propagated)
    yield from _corrections(project, block, result, space, as_published)


def _residuals(block: Block, result: Result) -> Iterator[Residuals]:
    """Yield the points in order of the block, with images by frame."""
    images = rows_of_each(block.image_points, len(block.point_ids))
    for point in np.flatnonzero(result.used_points).tolist():
        rows = images[point]
        frames = [block.photo_ids[photo] for photo in block.image_photos[rows].tolist()]
        yield block.point_ids[point], frames, result.residuals[rows]


def _points(project: Project, block: Block, result: Result, space: Space, propagated: bool) -> list[Page]:
    rows = np.flatnonzero(result.used_points).tolist()
    if project.common.sort_points:
        rows.sort(key=lambda row: printed_order(block.point_ids[row]))
    marks = {point.name: f"*{point.type_code}*" for point in project.ground}
    names = [block.point_ids[row] for row in rows]
    listed = space, names, [marks.get(name, "") for name in names], result.point_positions[rows]
    if not propagated:
        return point_pages(*listed)
    return propagated_point_pages(*listed, result.point_covariances[rows], np.isfinite(block.point_sd[rows]))


def _corrections(
    project: Project, block: Block, result: Result, space: Space, as_published: bool
) -> list[Page]:
    index = {block.point_ids[row]: row for row in np.flatnonzero(result.used_points).tolist()}
    names = list(dict.fromkeys(point.name for point in project.ground if point.name in index))
    if not names:
        return []
    rows = [index[name] for name in names]
    held: Bools = np.isfinite(block.point_sd[rows])
    corrections = result.point_differences[rows]
    if as_published:
        corrections = np.where(held, corrections, result.point_last_corrections[rows])
    return correction_pages(space, names, corrections, held, as_published=as_published)
