"""The adjusted camera stations (sample, page 30; with covariances page 41)."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.arguments.types import Floats
from photogram.giant.printout.formats import VALUE, Space, attitude, attitude_name
from photogram.giant.printout.matrices import MATRIX, matrix_rows
from photogram.giant.printout.pages import Page, headed, paginate

__all__ = ["station_pages"]

POSITION, ATTITUDE = VALUE + 5, VALUE + 7
"""Columns of `LNG =` and `OMEGA =` with their values."""


def station_pages(
    space: Space,
    photo_to_ground: bool,
    names: Sequence[str],
    positions: Floats,
    attitudes: Floats,
    covariances: Floats | None,
) -> list[Page]:
    """Return the pages of the stations, thirteen each.

    Parameters
    ----------
    space, photo_to_ground
        How positions and angles are written.
    names, positions, attitudes
        The P stations, (P, 3) and (P, 3) their values.
    covariances
        (P, 6, 6), of which the blocks of the position and of the attitude are shown; None without error
        propagation.
    """
    matrix = "" if covariances is None else f"{'COVARIANCE MATRIX':^{MATRIX}}"
    heading = headed(
        "TRIANGULATED CAMERA STATIONS",
        f"{'IDENT':<10}{'POSITION':^{POSITION}}{matrix}"
        f"   {f'ATT({attitude_name(photo_to_ground)})':^{ATTITUDE}}{matrix}".rstrip(),
    )
    entries = (
        _entry(space, name, positions[row], attitudes[row], None if covariances is None else covariances[row])
        for row, name in enumerate(names)
    )
    return paginate(heading, entries)


def _entry(space: Space, name: str, position: Floats, angles: Floats, covariance: Floats | None) -> list[str]:
    rows = zip(
        ("", name, ""),
        space.names,
        space.values(position, 4),
        matrix_rows(None if covariance is None else covariance[:3, :3]),
        ("OMEGA", "PHI", "KAPPA"),
        attitude(angles),
        matrix_rows(None if covariance is None else covariance[3:, 3:]),
        strict=True,
    )
    lines = [
        f"{ident:<10}{axis} ={value}{matrix}   {angle:<5} ={turn}{turn_matrix}"
        for ident, axis, value, matrix, angle, turn, turn_matrix in rows
    ]
    return [*lines, ""]
