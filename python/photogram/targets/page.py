"""Document of a calibration, its JSON members (`docs/json.md`), and its map files.

It extends the document of the block by board, views and projection uncertainty.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.show.page import Document, Drawing, Fact, Facts, Layers, Part, Remarks, Section, Tone
from photogram.show.quantity import Quantity, Table, members, records
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.cross_validation import CrossValidation, DifferenceTest, changes_between
from photogram.targets.drawing import (
    plot_board_residuals,
    plot_cross_validation,
    plot_difference,
    plot_poorest_views,
    plot_uncertainty,
)
from photogram.targets.grouping import Groups, residual_groups, views
from photogram.targets.maps import UncertaintyMap, distance_text, map_name
from photogram.targets.tables import (
    MIN_PRIOR_REDUNDANCY,
    STRETCHES,
    board_facts,
    board_fit,
    prior_shift,
    splines,
)

if TYPE_CHECKING:
    from photogram.targets import Calibrated, Suggestions, Worth


@np.errstate(over="ignore", invalid="ignore")
def calibration_page(calibrated: Calibrated, page: Document) -> Document:
    """Return the document of a calibration from the one of its block."""
    worth = calibrated.worth
    tables = [
        Table("splines", "Splined lenses", splines(calibrated), about=KNOTS),
        Table("moved_by_priors", "Changes by priors of cameras", prior_shift(calibrated)),
    ]
    sections = [
        worth_section(worth),
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
            f"{each.camera}, {distance_text(each.distance, each.unit)}",
            each.largest,
            "px",
            "largest standard deviation of projection where the board was seen",
            figures=2,
        )
        for each in worth.maps
    ]


def worth_section(worth: Worth | None) -> Section:
    """Return the uncertainty section, without parts if nothing was requested."""
    parts: list[Part] = []
    if worth is not None:
        parts += [Remarks(worth.sentences)] if worth.sentences else []
        made = drawings(worth)
        parts += [Layers("uncertainty", made)] if made else []
        parts += [Facts("Cross-validation", facts)] if (facts := _tests(worth)) else []
    return Section("uncertainty", "Uncertainty of projection", parts, CAPTION)


def drawings(worth: Worth) -> list[Drawing]:
    """Return all plots for later drawing."""
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
    return found + [_of_difference(each) for each in worth.differences]


def _tests(worth: Worth) -> list[Fact]:
    found = []
    for cross in worth.cross:
        for (a, b), tests in zip(cross.parts, cross.tests, strict=True):
            for each in tests:
                note = f"chi² of {each.dof}, p {each.probability:.2g}; {len(a)} and {len(b)} views"
                tone: Tone = "" if each.explained else "bad"
                found.append(Fact.of(each.name, each.chi2, note=note, tone=tone, figures=3))
    return found


def _of_difference(found: CameraDifference) -> Drawing:
    name = f"difference-{found.cameras[0]}-{found.cameras[1]}".replace(" ", "-")
    return Drawing(name, "Difference", APART, partial(plot_difference, found))


def _title(found: UncertaintyMap) -> str:
    return f"{found.camera} {distance_text(found.distance, found.unit)}"


def _members(calibrated: Calibrated) -> dict[str, Any]:
    sensors = [
        {"camera": calibrated.cameras[row].name, "pose": calibrated.sensors[row]}
        for row in calibrated.sensors_adjusted()
    ]
    return {
        "board": _board(calibrated),
        **({"sensors": sensors} if sensors else {}),
        **({} if calibrated.worth is None else worth_members(calibrated.worth)),
    }


def _board(calibrated: Calibrated) -> dict[str, Any]:
    calibration, fit = calibrated.calibration, board_fit(calibrated)
    board = calibration.board
    names = np.array(board.names, dtype=object)
    found: dict[str, Any] = {
        **members(board, "kind", "columns", "rows", "unit"),
        "shape": calibration.shape,
        "points": records(
            [
                Quantity(names, kind="name", member="id"),
                Quantity(board.places, member="nominal"),
                Quantity(calibrated.points, member="adjusted"),
            ]
        ),
    }
    if (bend := calibrated.bend) is not None:
        found |= {"bend": bend.position[:2], "bend_covariance": bend.covariance}
    if fit is not None:
        found |= members(fit, "plane", "rms_out_of_plane")
        found["spacing_ppm"] = dict(zip(STRETCHES, fit.stretch.tolist(), strict=True))
        found["sd_spacing_ppm"] = dict(zip(STRETCHES, fit.sd.tolist(), strict=True))
    return found


def worth_files(worth: Worth) -> dict[str, bytes]:
    """Return the maps as named tables and arrays: `map-left-infinity.csv`."""
    files = {}
    for each in worth.maps:
        name = f"map-{map_name(each)}"
        files[f"{name}.csv"], files[f"{name}.npz"] = each.to_csv(), each.to_npz()
    return files


def worth_members(worth: Worth) -> dict[str, Any]:
    """Return the JSON members of the assessment."""
    maps = ("camera", "datum", "noise_only", "model", "distance", "columns", "rows", "sd", "covariances")
    return {
        "maps": [members(each, *maps, largest_where_seen="largest") for each in worth.maps],
        "cross_validation": [_cross(each) for each in worth.cross],
        "difference": [_difference(each) for each in worth.differences],
        "suggested_views": [_suggested(each) for each in worth.suggestions],
        "worth": worth.sentences,
    }


def _cross(cross: CrossValidation) -> dict[str, Any]:
    splits = [
        {
            "views": parts,
            "tests": [_test(test) for test in tests],
            "dk": changes_between(*housings)[0][: cross.whole.board.start],
        }
        for parts, tests, housings in zip(cross.parts, cross.tests, cross.housings, strict=True)
    ]
    return {**members(cross, "into", "explained", "factor"), "splits": splits}


def _test(test: DifferenceTest) -> dict[str, Any]:
    return members(test, "name", "chi2", "dof", p="probability")


def _difference(difference: CameraDifference) -> dict[str, Any]:
    own = ("cameras", "distances", "rms", "largest", "columns", "rows", "vectors", "covariances", "remarks")
    others = {"motion": "fitted.motion", "rotation_deg": "rotation", "shared_corners": "shared"}
    return {**members(difference, *own, **others), "test": difference.test and _test(difference.test)}


def _suggested(suggestions: Suggestions) -> dict[str, Any]:
    names = {"name": "candidate.name", "pose": "candidate.pose"}
    return {
        **members(suggestions, "camera", "distance"),
        "largest_before": float(np.max(suggestions.before)),
        "views": [members(view, "corners", "largest", "rms", **names) for view in suggestions.views],
    }
