"""Document of a calibration, its JSON members (`docs/json.md`), and its map files.

It extends the document of the block by board, views and projection uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations.unknowns import Prior
from photogram.network.passages import beyond_knots
from photogram.show.page import (
    Document,
    Drawing,
    Fact,
    Facts,
    Layers,
    Part,
    Remarks,
    Section,
    Tone,
    fixed,
    significant,
)
from photogram.show.quantity import Axis, Quantity, Table, column, members, records
from photogram.targets.cross_validation import changes_between
from photogram.targets.drawing import (
    plot_board_residuals,
    plot_cross_validation,
    plot_difference,
    plot_poorest_views,
    plot_uncertainty,
)
from photogram.targets.grouping import Groups, residual_groups, views
from photogram.targets.lens_fit import field_of, grid_of_pixels
from photogram.targets.uncertainty import UncertaintyMap, at_distance, map_name
from photogram.targets.vision import TURNED, transformed

if TYPE_CHECKING:
    from photogram.targets import Calibrated, Worth


@np.errstate(over="ignore", invalid="ignore")
def calibration_page(calibrated: Calibrated, page: Document) -> Document:
    worth, uncertainty = calibrated.worth, list[Part]()
    if worth is not None:
        uncertainty += [Remarks(worth.sentences)] if worth.sentences else []
        uncertainty += [Layers("uncertainty", made)] if (made := drawings(worth)) else []
        facts = []
        for cross in worth.cross:
            for (a, b), tests in zip(cross.parts, cross.tests, strict=True):
                for each in tests:
                    note = f"chi² of {each.dof}, p {each.probability:.2g}; {len(a)} and {len(b)} views"
                    tone: Tone = "" if each.explained else "bad"
                    facts.append(Fact.of(each.name, each.chi2, note=note, tone=tone, figures=3))
        uncertainty += [Facts("Cross-validation", facts)] if facts else []
    tables = [
        Table("splines", "Splined lenses", splines(calibrated), about=KNOTS),
        Table("moved_by_priors", "Changes by priors of cameras", prior_shift(calibrated)),
    ]
    sections = [
        Section("uncertainty", "Uncertainty of projection", uncertainty, CAPTION),
        Section("board", "Board", [Facts("The board", board_facts(calibrated))]),
        Section.of(
            Table(
                "views", "Views", [*views(calibrated), Quantity(calibrated.poses, member="pose")], about=VIEWS
            )
        ),
        Section("corners", "Residuals of corners", _residuals(calibrated)),
        *(Section.of(each) for each in tables if each.visible),
    ]
    highlights = [*([] if worth is None else worth_facts(worth)), *page.highlights]
    return replace(
        page.with_members(partial(_members, calibrated)),
        what="Calibration with targets",
        highlights=highlights,
        sections=[*sections, *page.sections],
    )


MIN_PRIOR_REDUNDANCY = 0.05  # a knot with less redundancy is determined by its prior
VIEWS = "Pictures of one view show the board in one pose. chi² is the weighted sum of squares of its corners."
KNOTS = (
    f"Knots with a redundancy below {MIN_PRIOR_REDUNDANCY:g} are determined by their priors. Projection has"
    " no uncertainty beyond the knots; all pixels are within the knots if fov_x_deg is sufficient."
)


def _residuals(calibrated: Calibrated) -> list[Part]:
    drawings = [
        Drawing(
            "board-residuals",
            "On the board",
            "Mean residuals over all views: errors of the print.",
            partial(plot_board_residuals, calibrated),
        ),
        Drawing(
            "poorest-views",
            "Poorest views",
            "Residuals of the pictures that fit worst.",
            partial(plot_poorest_views, calibrated),
        ),
    ]
    tables = [Table("", title, residual_groups(calibrated, by)) for by, title in _GROUPS.items()]
    several = (table for table in tables if len(table.columns[0].values) > 1)
    return [Layers("corner-residuals", drawings), *several]


_GROUPS: dict[Groups, str] = {
    "camera": "By camera",
    "level": "By level of the detector",
    "radius": "By distance from the middle of the picture",
}


CAPTION = (
    "Standard deviation, in the worst direction, of the image of a point that stays fixed to the housing."
    " Dots: corners that were seen; line: their convex hull; dashed, of splined lenses: where knots end."
)
CROSS = (
    "Images of the same points by the second part of the views less those by the first (vectors), and what"
    " that is beside its covariance: about 1 where the covariance explains it."
)
APART = "Where both calibrations image the same points, once the motion between their axes is out."


def worth_facts(worth: Worth) -> list[Fact]:
    """Return the largest standard deviation of each map in the observed board region."""
    return [
        Fact.of(
            f"{each.camera}, {at_distance(each.distance, each.unit)}",
            each.largest,
            "px",
            "largest standard deviation of projection where the board was seen",
            figures=2,
        )
        for each in worth.maps
    ]


def drawings(worth: Worth) -> list[Drawing]:
    found = [
        Drawing(f"map-{map_name(each)}", _title(each), CAPTION, partial(plot_uncertainty, each))
        for each in worth.maps
    ]
    for cross in worth.cross:
        for own in worth.maps:
            if own.camera in cross.cameras:
                sketch = partial(plot_cross_validation, cross, own)
                name = f"cross-validation-{map_name(own)}"
                found.append(Drawing(name, f"Cross-validation, {_title(own)}", CROSS, sketch))
    for each in worth.differences:
        name = f"difference-{each.cameras[0]}-{each.cameras[1]}".replace(" ", "-")
        found.append(Drawing(name, "Difference", APART, partial(plot_difference, each)))
    return found


def _title(found: UncertaintyMap) -> str:
    return f"{found.camera} {at_distance(found.distance, found.unit)}"


def _members(calibrated: Calibrated) -> dict[str, Any]:
    board, fit, bend = calibrated.calibration.board, board_fit(calibrated), calibrated.bend
    points = [
        Quantity(np.array(board.names, dtype=object), kind="name", member="id"),
        Quantity(board.places, member="nominal"),
        Quantity(calibrated.points, member="adjusted"),
    ]
    of_board: dict[str, Any] = members(board, "kind", "columns", "rows", "unit")
    of_board |= {"shape": calibrated.calibration.shape, "points": records(points)}
    if bend is not None:
        of_board |= {"bend": bend.position[:2], "bend_covariance": bend.covariance}
    if fit is not None:
        of_board |= members(fit, "plane", "rms_out_of_plane")
        of_board["spacing_ppm"] = dict(zip(STRETCHES, fit.stretch.tolist(), strict=True))
        of_board["sd_spacing_ppm"] = dict(zip(STRETCHES, fit.sd.tolist(), strict=True))
    sensors = [
        {"camera": calibrated.cameras[row].name, "pose": calibrated.sensors[row]}
        for row in calibrated.sensors_adjusted()
    ]
    return {
        "board": of_board,
        **({"sensors": sensors} if sensors else {}),
        **({} if calibrated.worth is None else worth_members(calibrated.worth)),
    }


def worth_files(worth: Worth) -> dict[str, bytes]:
    files = {}
    for each in worth.maps:
        name = f"map-{map_name(each)}"
        files[f"{name}.csv"], files[f"{name}.npz"] = each.to_csv(), each.to_npz()
    return files


def worth_members(worth: Worth) -> dict[str, Any]:
    maps = ("camera", "datum", "noise_only", "model", "distance", "columns", "rows", "sd", "covariances")
    apart = ("cameras", "distances", "rms", "largest", "columns", "rows", "vectors", "covariances", "remarks")
    of_motion = {"motion": "fitted.motion", "rotation_deg": "rotation", "shared_corners": "shared"}
    of_view = {"name": "candidate.name", "pose": "candidate.pose"}
    of_test = partial(members, p="probability")
    cross_validation = []
    for each in worth.cross:
        splits = [
            {
                "views": parts,
                "tests": [of_test(test, "name", "chi2", "dof") for test in tests],
                "dk": changes_between(*housings)[0][: each.whole.board.start],
            }
            for parts, tests, housings in zip(each.parts, each.tests, each.housings, strict=True)
        ]
        cross_validation.append({**members(each, "into", "explained", "factor"), "splits": splits})
    return {
        "maps": [members(each, *maps, largest_where_seen="largest") for each in worth.maps],
        "cross_validation": cross_validation,
        "difference": [
            members(each, *apart, **of_motion)
            | {"test": each.test and of_test(each.test, "name", "chi2", "dof")}
            for each in worth.differences
        ],
        "suggested_views": [
            {
                **members(each, "camera", "distance"),
                "largest_before": float(np.max(each.before)),
                "views": [members(view, "corners", "largest", "rms", **of_view) for view in each.views],
            }
            for each in worth.suggestions
        ],
        "worth": worth.sentences,
    }


NOTABLE_STRETCH = 3.0  # standard deviations of the spacing of a board


def board_facts(calibrated: Calibrated) -> list[Fact]:
    calibration = calibrated.calibration
    board, unit = calibration.board, calibration.board.unit
    found = [
        Fact("Board", board.described),
        Fact("Shape", _SHAPES[calibration.shape]),
        Fact(
            "Scale", "from the spacing", note="nothing checks it: its relative error is that of every length"
        ),
    ]
    where = "cx, cy and pixels count from 0 at the centre of the first; COLMAP has 0.5 more"
    found.append(Fact("Pixels", "centre is 0", note=where))
    if (bend := calibrated.bend) is not None:
        for name, value, sd in zip(_BENDS, bend.position.tolist(), bend.sd.tolist(), strict=False):
            found.append(Fact.of(name, value, unit, f"sd {significant(sd, 2)} {unit}", figures=4))
    fit = board_fit(calibrated)
    if fit is None:
        return found
    found.append(Fact.of("Out of its plane, rms", fit.rms_out_of_plane, unit, figures=3))
    for name, value, sd in zip(STRETCHES, fit.stretch.tolist(), fit.sd.tolist(), strict=True):
        tone: Tone = "look" if abs(value) > NOTABLE_STRETCH * sd else ""
        found.append(Fact.of(f"Spacing, {name}", value, "ppm", f"sd {fixed(sd, 0)} ppm", tone, decimals=0))
    return found


_BENDS = ("Deflection along x (bend_x)", "Deflection along y (bend_y)")
_SHAPES = {
    "held": "held: every point is taken for where it should be",
    "bend": "two parabolas, whose deflections in the middle are unknowns",
    "points": "every point is an unknown, observed with its nominal place",
}


STRETCHES = ("scale x", "scale y", "shear")


@dataclass(frozen=True, eq=False)
class BoardFit:
    plane: Floats  # (3,) a, b, c of z = a + b x + c y, fitted to the adjusted points
    rms_out_of_plane: float  # Root mean square of z about the plane, in the unit of the board
    # (3,) in ppm, with standard deviations: relative excess of the spacing along x and y. The third is the
    # sine of the angle deficit of columns and rows to 90 degrees
    stretch: Floats
    sd: Floats


def board_fit(calibrated: Calibrated) -> BoardFit | None:
    """Return the fit of a board with at least four estimated points, or None.

    The adjusted coordinates are fitted to the nominal ones, (x, y) = t + M (X, Y), with equal weights. With
    columns m, n of M the stretches are |m| - 1, |n| - 1 and m'n.
    """
    result, board = calibrated, calibrated.calibration.board
    seen = np.flatnonzero(result.used_points)
    if calibrated.calibration.shape != "points" or len(seen) < 4:
        return None
    nominal, found = board.places[seen], result.point_positions[seen]
    design = np.column_stack([np.ones(len(seen)), nominal[:, :2]])
    solve = np.linalg.pinv(design)
    plane = solve @ found[:, 2]
    away = found[:, 2] - design @ plane
    fitted = (solve @ found[:, :2])[1:]  # rows m and n
    lengths = np.linalg.norm(fitted, axis=1)
    stretch = np.array([*(lengths - 1), fitted[0] @ fitted[1]])
    # Partials of |m|, |n| and m'n by m and n, which are linear in the points.
    units = fitted / lengths[:, np.newaxis]
    by_rows = np.zeros((3, 2, 2))
    by_rows[0, 0], by_rows[1, 1] = units
    by_rows[2] = fitted[::-1]
    by_points = np.einsum("rij,in->rnj", by_rows, solve[1:])
    partials = np.concatenate([by_points, np.zeros((3, len(seen), 1))], axis=2).reshape(3, -1)
    covariance = result.covariance(("point", [result.block.point_ids[row] for row in seen.tolist()]))
    sd = np.sqrt(np.einsum("ri,ij,rj->r", partials, covariance, partials))
    return BoardFit(plane, float(np.sqrt(np.mean(away**2))), 1e6 * stretch, 1e6 * sd)


def prior_shift(calibrated: Calibrated) -> list[Quantity]:
    before = calibrated.unregularised
    rows = [
        (own, k, float(own.values[k] - free.values[k]))
        for own, free in zip(calibrated.cameras, () if before is None else before.cameras, strict=False)
        for k in own.estimated
    ]
    names = [f"{own.name} {own.names[k]}" for own, k, _ in rows]
    axes = tuple(Axis.of(own.names[k], own.camera.unit_of(own.names[k])) for own, k, _ in rows)
    changes = np.array([change for _, _, change in rows])
    of_sd = changes / np.array([own.sd[k] for own, k, _ in rows])
    return [
        column("parameter", np.array(names, dtype=object), "Parameter", kind="name"),
        Quantity(changes, axes, "value", None, "change", head="Moved", of=np.arange(len(rows))),
        Quantity(of_sd, member="over_sd", head="Over its sd"),
    ]


def splines(calibrated: Calibrated) -> list[Quantity]:
    """Return statistics of the knots of each splined lens.

    `from_prior` are the unknown knots whose values are determined by their priors, `untouched` those without
    an image. `beyond` is the fraction of the image beyond the knots, NaN for an unknown image size;
    `fov_x_deg` the field with all pixels within the knots, NaN if this already holds.
    """
    rows = []
    corners, observations = calibrated.calibration.corners, calibrated.block.observations
    for number, each in enumerate(calibrated.cameras):
        camera, size = each.camera, corners.sizes[number]
        if camera.knots is None:
            continue
        knots = {id(knot) for knot in each.given.knot_unknowns}
        from_prior = sum(
            bool(np.nansum(own) / 2 < MIN_PRIOR_REDUNDANCY)
            for kind in calibrated.kinds.values()
            for row, own in zip(kind.rows.tolist(), kind.redundancy, strict=True)
            if isinstance(prior := observations[row], Prior) and id(prior.unknown) in knots
        )
        untouched = 0
        if knots:
            own = corners.use & (corners.cameras[corners.picture] == number)
            poses = calibrated.picture_poses[corners.picture[own]]
            seen = transformed(poses, calibrated.points[corners.point[own]])
            patches, _ = _photocore.camera_patches(camera.model, camera.values, seen * TURNED)
            untouched = len(knots) - len(np.unique(patches))
        beyond = sufficient = math.nan
        if size is not None:
            rays = camera.rays(grid_of_pixels(size))
            beyond = float(beyond_knots(camera.parameters, rays).mean())
            if beyond:
                count = (int(camera.parameters["nx"]), int(camera.parameters["ny"]))
                sufficient = math.ceil(field_of(rays, count, camera.parameters["order"]))
        rows.append((each.name, len(knots), from_prior, untouched, beyond, sufficient))
    return [
        column(name, [row[k] for row in rows], head, kind="name" if name == "camera" else "number")
        for k, (name, head) in enumerate(_SPLINES.items())
    ]


_SPLINES = {
    "camera": "Camera",
    "knots": "Estimated knots",
    "from_prior": "From priors",
    "untouched": "Without images",
    "beyond": "Image beyond the knots",
    "fov_x_deg": "Sufficient fov_x_deg",
}
