"""Values that support data do not have, derived from their other fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from photogram.io.json import Tree

_FRAME = "USGS_ASTRO_FRAME_SENSOR_MODEL"
_SUMMING = "the number of detector {} that one {} of the image combines"
_START = "the {} of the detector, from 0, at which the image begins"
_CENTER = "the {} of the detector at which the axis of the camera meets it, in pixels"
_PLANE = "three numbers: the {} of the detector at x = y = 0 mm, and its change for 1 mm of x and of y"


def _middle(axis: str) -> Callable[[Tree], float | None]:
    """Return what derives the middle of a whole frame; of a part of a frame there is none."""

    def derive(tree: Tree) -> float | None:
        if not tree["name_model"].text().startswith(_FRAME) or tree[f"starting_detector_{axis}"].number():
            return None
        return tree[f"image_{axis}s"].whole(1) * tree[f"detector_{axis}_summing"].number() / 2

    return derive


def _only_time(tree: Tree) -> Any:
    """Return the time of the only record of the pointing."""
    times = tree["instrument_pointing"].get("ephemeris_times", []).value
    return times[0] if isinstance(times, list) and len(times) == 1 else None


def _none(_: Tree) -> None:
    return None


_RULES: tuple[tuple[str, str, Callable[[Tree], Any], str], ...] = (
    ("focal_length_model/focal_length", "FOCAL_LENGTH", _none, "the focal length in millimetres"),
    ("focal2pixel_samples", "ITRANSS", _none, _PLANE.format("sample")),
    ("focal2pixel_lines", "ITRANSL", _none, _PLANE.format("line")),
    ("detector_sample_summing", "", _none, _SUMMING.format("samples", "sample")),
    ("detector_line_summing", "", _none, _SUMMING.format("lines", "line")),
    ("starting_detector_sample", "", _none, _START.format("sample")),
    ("starting_detector_line", "", _none, _START.format("line")),
    ("detector_center/sample", "BORESIGHT_SAMPLE", _middle("sample"), _CENTER.format("sample")),
    ("detector_center/line", "BORESIGHT_LINE", _middle("line"), _CENTER.format("line")),
    ("center_ephemeris_time", "", _only_time, "the time of the exposure in ephemeris seconds"),
)
"""Path of a value, keyword of the instrument that has it, derivation from other fields, meaning."""


def completed(tree: Tree, keywords: Tree, code: str | None) -> tuple[Tree, tuple[str, ...]]:
    """Return support data with the values that other fields determine, and remarks on these.

    `code` is the prefix of the instrument's keywords.
    """
    remarks = []
    for path, keyword, derive, meaning in _RULES:
        group, _, name = path.rpartition("/")
        holder = tree.get(group, {}).value if group else tree.value
        if not isinstance(holder, dict) or holder.get(name) is not None:
            continue
        known = f"{code}_{keyword}"
        value = keywords[known].value if known in keywords else derive(tree)
        if value is None:
            if name in holder or tree.value.get(group or name, 0) is None:
                raise Tree(None, tree.file, f"/{path}").error(
                    f"is null, and no other field determines it; it must be {meaning}"
                )
            continue
        origin = f"from {known}" if known in keywords else "derived from the other fields"
        remarks.append(f"{path} is missing: {value} {origin} is used")
        own = {**holder, name: value}
        tree = Tree({**tree.value, group: own} if group else own, tree.file)
    return tree, (*remarks, *_center_in_corner(tree))


def _center_in_corner(tree: Tree) -> list[str]:
    """Return a remark on a whole frame whose axis meets the detector in its corner."""
    offsets = (tree[f"focal2pixel_{axis}s"].numbers(3)[0] for axis in ("sample", "line"))
    middle = _middle("sample")(tree), _middle("line")(tree)
    center = tree["detector_center"]
    if None in middle or any(offsets) or any(center[axis].number() for axis in ("sample", "line")):
        return []
    return [
        "detector_center is 0, 0, a corner of the detector: some programs write 0 if the value is unknown."
        f" The middle of the image is sample {middle[0]:g}, line {middle[1]:g}; correct detector_center if"
        " the axis of the camera meets the detector there"
    ]
