"""The printout of a job: selection and order of its pages, and pages of its input."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import rows_of_each, truth_value
from photogram.arguments.types import Bools
from photogram.giant.common import Common
from photogram.giant.contents import IMAGE_SD, GroundPoint, ImageFrame
from photogram.giant.fields import printed_order
from photogram.giant.limits import ErrorWarning, Limits, error_warnings
from photogram.giant.printout.forms import (
    Page,
    Space,
    Values,
    attitude,
    attitude_name,
    dms,
    fixed,
    headed,
    paginate,
    printout,
)
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
from photogram.network.refraction import Refraction
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


UNIT_VARIANCE: dict[str, str] = {
    "free": "UNIT VARIANCE WILL BE BASED ON COMPLETELY FREE CAMERA PARAMETERS",
    "constrained": "UNIT VARIANCE WILL BE BASED ON CONSTRAINED CAMERA PARAMETERS",
    "unity": "UNIT VARIANCE WILL BE SET TO UNITY",
    "redundancy": "UNIT VARIANCE WILL BE BASED ON REDUNDANCY NUMBERS",
}


def options_page(
    common: Common,
    space: Space,
    refraction: Refraction | None,
    unit_variance: str | None = None,
    *,
    as_published: bool = False,
) -> Page:
    """Return the page of the options; the default unit variance is as in COMMON.

    The sample shows one choice of most options; `docs/giant-listing.md` lists our lines. As published, the
    linear unit of a rectangular job is omitted. `refraction` may exceed the request of COMMON.
    """
    air = refraction is not None and refraction.air is not None
    water = refraction is not None and refraction.water is not None
    lines = [
        f"OBJECT SPACE REFERENCE SYSTEM IS {'GEOGRAPHIC' if space.geographic else 'RECTANGULAR'}",
        f"ROTATION ANGLES ARE {'PHOTO-TO-GROUND' if common.photo_to_ground else 'GROUND-TO-PHOTO'}",
        f"{'INTERSECTION ONLY' if common.intersection_only else 'COMPLETE TRIANGULATION'}"
        " PROCESS IS REQUESTED",
        f"ERROR PROPAGATION IS {'' if common.error_propagation else 'NOT '}REQUESTED",
    ]
    if common.error_propagation:
        lines.append(UNIT_VARIANCE[unit_variance or common.unit_variance])
    for medium, applied in (("ATMOSPHERIC", air), ("WATER", water)):
        lines.append(f"{medium} REFRACTION WILL {'' if applied else 'NOT '}BE INCLUDED IN THE ADJUSTMENT")
    lines.append(_listed_residuals(common.residual_limit))
    if common.strip:
        lines.append(f"LEADING '{common.strip}' WILL BE ELIMINATED FROM ALL IDENTIFICATIONS")
    if space.geographic:
        for axis, length in (("MAJOR", common.semi_major), ("MINOR", common.semi_minor)):
            lines.append(f"SEMI-{axis} AXIS OF SPHEROID = {length:.3f} {space.linear_unit}")
    elif not as_published:
        lines.append(f"LINEAR UNIT OF OBJECT SPACE = {space.linear_unit}")
    if common.save_points:
        lines.append("TRIANGULATED GROUND COORDINATES WILL BE SAVED")
    if common.save_stations:
        lines.append("ADJUSTED CAMERA STATION PARAMETERS WILL BE SAVED")
    return ["", *(line for option in lines for line in (option, ""))]


def _listed_residuals(limit: float) -> str:
    if limit == 0:
        return "ALL IMAGE RESIDUALS WILL BE LISTED"
    if limit < 0:
        return "NO IMAGE RESIDUALS WILL BE LISTED"
    return f"IMAGE RESIDUALS GREATER THAN {limit:.3f} (MM) WILL BE LISTED"


def control_pages(
    space: Space, ground: Iterable[GroundPoint], default_sd: tuple[float, float, float]
) -> list[Page]:
    """Return the pages of the control, ten points each.

    Unheld components are listed unchanged; `default_sd` replaces standard deviations of zero.
    """
    entries = []
    for point in ground:
        deviations = [sd or default for sd, default in zip(point.sd, default_sd, strict=True)]
        rows = zip(space.names, space.values(point.position, 4), space.values(deviations, 4), strict=True)
        first, second, third = (f"{axis} = {value}     ST. D. = {sd}" for axis, value, sd in rows)
        middle = f"{point.name:<10}{second}     TYPE = {point.type_code}"
        entries.append([f"{'':10}{first}", middle, f"{'':10}{third}", "", ""])
    return paginate(headed("GROUND CONTROL DATA"), entries)


ACROSS = 4  # Plate coordinates, or names of points, per line


def frame_pages(
    space: Space,
    photo_to_ground: bool,
    pose: Sequence[Values],
    principal_distance: float,
    images: ImageFrame,
    *,
    parameters: bool = True,
    plates: bool = True,
) -> list[Page]:
    """Return the requested pages of a frame: station, plate coordinates.

    The pose is position and attitude in block units, then their standard deviations.
    """
    x_sd, y_sd = (sd or IMAGE_SD for sd in images.sd)
    frame = ["", f"FRAME  {images.name}", ""]
    heading = [
        *frame,
        f"PRINCIPAL DISTANCE ={fixed(principal_distance, 12, 4)}"
        f"     ST. D. OF X ={fixed(x_sd, 10, 4)}     ST. D. OF Y ={fixed(y_sd, 10, 4)}",
        "",
    ]
    if parameters:
        heading += _parameters(space, photo_to_ground, pose)
    columns = headed("PLATE COORDINATES", f"{'ID':<8}{'X':>10}{'Y':>11}    " * ACROSS)[1:] if plates else []
    return paginate([*heading, *columns], _plates(images) if plates else [], again=[*frame, *columns])


def _parameters(space: Space, photo_to_ground: bool, pose: Sequence[Values]) -> Page:
    position, angles, position_sd, angles_sd = pose
    sense = attitude_name(photo_to_ground)
    lines = headed(
        "CAMERA STATION PARAMETERS", f"{'P O S I T I O N':^49}{f'A T T I T U D E  ({sense})':^49}".rstrip()
    )[1:]
    rows = zip(
        space.names,
        space.values(position, 4),
        space.values(position_sd, 4),
        ("OMEGA", "PHI", "KAPPA"),
        attitude(angles),
        (dms(each) for each in angles_sd),
        strict=True,
    )
    for name, value, sd, angle, turn, turn_sd in rows:
        lines.append(f"{name} = {value}   ST. D. = {sd}     {angle:<5} = {turn}   ST. D. = {turn_sd}")
    return [*lines, ""]


def _plates(images: ImageFrame) -> list[Sequence[str]]:
    cells = [
        f"{name:<8}{fixed(x, 10, 4)}{fixed(y, 11, 4)}    "
        for name, (x, y) in zip(images.points, images.xy.tolist(), strict=True)
    ]
    return [["".join(cells[row : row + ACROSS])] for row in range(0, len(cells), ACROSS)]


def warning_pages(warnings: Iterable[ErrorWarning]) -> list[Page]:
    """Return the pages of the warnings; empty without warnings."""
    entries: list[list[str]] = []
    for warning in warnings:
        # The first page of a warning contains its heading and the first names.
        heading = [*(["ERROR WARNINGS", ""] if warning.general else []), warning.heading, ""]
        for row in range(0, len(warning.names), ACROSS):
            names = "".join(f"{name:<20}" for name in warning.names[row : row + ACROSS])
            entries.append([names] if row else [*heading, names])
        entries.append(["", ""])
    return paginate([""], entries) if entries else []
