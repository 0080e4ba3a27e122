"""Reader of support data in JSON: ISDs, as written by ALE."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Literal, cast

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.csm.isd import (
    Detector,
    Framelets,
    Isd,
    Jitter,
    Plane,
    Positions,
    Turns,
    of_quaternions,
)
from photogram.formats.declarations import declared
from photogram.io.places import at_place, positive
from photogram.io.tree import Tree
from photogram.network.lens import Lens, LensModel
from photogram.network.moving_photos import Lines
from photogram.network.trajectories import increasing
from photogram.network.unknowns import rotations
from photogram.words import Phrase, phrase

_TRANSX = re.compile(r"(INS-?\d+)_TRANSX")
_KINDS = {
    "USGS_ASTRO_LINE_SCANNER_SENSOR_MODEL": "line",
    "USGS_ASTRO_FRAME_SENSOR_MODEL": "frame",
    "USGS_ASTRO_PUSH_FRAME_SENSOR_MODEL": "push frame",
}
FRAMELETS = 100_000  # Largest number in an image: each is a photo
_MEMBERS = {
    "radial": ("coefficients",),
    "transverse": ("x", "y"),
    "lrolrocnac": ("coefficients",),
    "kaguyalism": ("boresight_x", "x", "boresight_y", "y"),
    "cahvor": ("coefficients",),
    "radtan": ("coefficients",),
}
"""Keys of the coefficients of each lens; `coefficients` may contain all of them."""
UNITS = {"m": 1.0, "km": 1000.0}  # Metres; default km
APART = 0.01  # Largest difference of the time tables, relative to the span


def isd_of(tree: Tree) -> Isd:
    keywords = tree.get("naif_keywords", {})
    kind = cast("Any", _KINDS[tree["name_model"].known("sensor model", _KINDS)])
    size = tree["image_samples"].whole(1), tree["image_lines"].whole(1)
    code = _instrument(tree, keywords)
    tree, remarks = completed(tree, keywords, code)
    focal_length = not_zero(tree["focal_length_model"]["focal_length"])
    tables = [tree[name] for name in ("instrument_position", "instrument_pointing", "body_rotation")]
    frames = {each["reference_frame"].whole(-(2**31)) for each in tables if "reference_frame" in each}
    if len(frames) > 1:
        raise tables[0].error(phrase("csm.frames", names=sorted(frames)))
    detector = _detector(tree, keywords, code)
    pointing, center = _turns(tree, "instrument_pointing"), tree["center_ephemeris_time"].number()
    position = _positions(tree["instrument_position"])
    look = _look(kind, focal_length, detector, position, pointing)
    own: dict[str, Any] = {"look": look}
    if kind != "frame" and "jitter" in tree:
        raise tree["jitter"].error(phrase("csm.jitter"))
    if kind == "line":
        lines = read_lines(tree, center)
        own["lines"], of_lines = fitting(lines, size[1], pointing.times, keywords, code)
        remarks += of_lines
    elif kind == "push frame":
        own["framelets"] = _framelets(tree, size[1], float(detector.summing[1]))
    elif "jitter" in tree:
        jitter = tree["jitter"]
        coefficients = [jitter[f"{axis}JitterCoefficients"].numbers() for axis in ("sample", "line")]
        times = np.array(jitter["lineExposureTimes"].numbers())
        if len(coefficients[0]) != len(coefficients[1]) or not len(times):
            counts = dict(zip(("samples", "lines"), map(len, coefficients), strict=True))
            raise jitter.error(phrase("csm.coefficients", **counts))
        own["jitter"] = Jitter(np.array(coefficients), times)
    a, b = (tree["radii"][name].number() * _unit(tree["radii"]) for name in ("semimajor", "semiminor"))
    if not 0 < b <= a:
        raise tree["radii"].error(phrase("csm.radii", a=a, b=b))
    return Isd(
        tree.file,
        kind,
        tree["name_platform"].text(),
        tree["name_sensor"].text(),
        size,
        (a, b),
        look * focal_length if focal_length < 0 else focal_length,
        detector,
        _lens(tree, focal_length),
        position,
        pointing,
        _turns(tree, "body_rotation"),
        center,
        remarks=remarks,
        **own,
    )


def _look(
    kind: str, focal_length: float, detector: Detector, position: Positions, pointing: Turns
) -> Literal[1, -1]:
    """Return 1 if a camera looks along +z of its axes, -1 if along -z.

    Support data have a negative focal length for -z. ISIS has a positive one for the metric camera of Apollo:
    its focal plane is mirrored for +z, and its body is on the other side.
    """
    if kind != "line" and focal_length < 0:
        return -1
    middle = len(pointing.times) // 2, len(position.times) // 2
    depth = -(pointing.matrices[middle[0]] @ position.places[middle[1]])[2]
    mirrored = np.linalg.det(detector.planes["csm"].matrix) < 0
    return -1 if kind == "frame" and mirrored and depth < 0 else 1


def _unit(tree: Tree) -> float:
    return UNITS[tree.get("unit", "km").known("unit", UNITS)]


def _rows(tree: Tree, width: int) -> Floats:
    try:
        found = np.array(tree.value, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.ndim != 2 or found.shape[1] != width or not np.isfinite(found).all():
        # Row by row, so that the message names the invalid row.
        found = np.array([row.numbers(width) for row in tree])
    if not len(found):
        raise tree.error(phrase("format.empty"))
    return found


def _times(tree: Tree, count: int) -> Floats:
    times = tree["ephemeris_times"]
    with at_place(times):
        return increasing("ephemeris_times", times.numbers(count))


def _positions(tree: Tree) -> Positions:
    unit, places, speeds = _unit(tree), _rows(tree["positions"], 3), None
    if tree.get("velocities", []).value:
        speeds = unit * _rows(tree["velocities"], 3)
        if len(speeds) != len(places):
            raise tree["velocities"].error(phrase("format.count", n=len(speeds), required=len(places)))
    return Positions(_times(tree, len(places)), unit * places, speeds)


def _turns(tree: Tree, name: str) -> Turns:
    """Return K R(t): rotations of records, then the constant one."""
    own = tree[name]
    matrices = of_quaternions(own["quaternions"], _rows(own["quaternions"], 4))
    return Turns(_times(own, len(matrices)), constant_rotation(own, "constant_rotation") @ matrices)


def constant_rotation(table: Tree, key: str) -> Floats:
    if key not in table:
        return np.eye(3)
    with at_place(table[key]):
        return np.asarray(rotations(key, np.reshape(table[key].numbers(9), (1, 3, 3)), 1)[0])


def _framelets(tree: Tree, lines: int, summing: float) -> Framelets:
    own = tree["framelet_height"]
    height = own.number() / summing
    every = tree["interframe_delay"].number()
    positive(own, "framelet_height and interframe_delay", min(height, every))
    if lines % height or lines / height > FRAMELETS:
        raise own.error(phrase("csm.framelets", lines=lines, most=FRAMELETS, height=height * summing))
    first = tree["starting_ephemeris_time"].number() + 0.5 * tree["exposure_duration"].number()
    switches = (tree.get(f"framelet{name}", False).switch() for name in ("_order_reversed", "s_flipped"))
    return Framelets(height, round(lines / height), first, every, *switches)


def _lens(tree: Tree, focal_length: float) -> Lens | None:
    optics = tree["optical_distortion"]
    models = [name for name, _ in optics.items()]
    if len(models) != 1:
        raise optics.error(phrase("format.count", n=len(models), required=1))
    model = Tree(models[0], optics.file, optics.path).known("lens", _MEMBERS)
    own = optics[model]
    members = [own[name] for name in (("coefficients",) if "coefficients" in own else _MEMBERS[model])]
    parts = (each if isinstance(each.value, list) else [each] for each in members)
    found = [value.number() for part in parts for value in part]
    if not any(found) and model == "radial":
        return None
    with at_place(own):
        return Lens(cast("LensModel", model), tuple(found), focal_length if model == "radtan" else 1.0)


def _detector(tree: Tree, keywords: Tree, code: str | None) -> Detector:
    """Return the detector; ISIS uses its own transformation to millimetres."""

    def pair(form: str) -> Floats:
        return np.array([tree[form.format(axis)].number() for axis in ("sample", "line")])

    summing = pair("detector_{}_summing")
    positive(tree["detector_sample_summing"], "the sum of pixels", float(summing.min()))
    csm = from_pixels(tree["focal2pixel_samples"], tree["focal2pixel_lines"])
    isis = csm if code is None else transformed(keywords, code)
    centre = np.array([tree["detector_center"][axis].number() for axis in ("sample", "line")])
    return Detector(centre, pair("starting_detector_{}"), summing, {"csm": csm, "isis": isis})


def from_pixels(samples: Tree, lines: Tree) -> Plane:
    """Return the inverse of a transformation from millimetres to detector pixels."""
    rows = _affine(samples, lines)
    inverse: Floats = np.asarray(np.linalg.inv(rows[:, 1:]), dtype=float)
    return Plane(-inverse @ rows[:, 0], inverse)


def _affine(first: Tree, second: Tree) -> Floats:
    rows = np.array([first.numbers(3), second.numbers(3)])
    if not 0 < abs(np.linalg.det(rows[:, 1:])) < np.inf:
        raise first.error(phrase("csm.inverse", other=second.path))
    return rows


def _instrument(tree: Tree, keywords: Tree) -> str | None:
    """Return the prefix of keywords, as `INS-85600`; None without keywords."""
    codes = sorted({own[1] for name, _ in keywords.items() if (own := _TRANSX.fullmatch(name))})
    frames = tree["instrument_pointing"].get("time_dependent_frames", []).value
    named = [code for code in codes if isinstance(frames, list) and frames and code == f"INS{frames[0]}"]
    if len(codes) > 1 and not named:
        raise keywords.error(phrase("csm.instruments", names=codes))
    return (named or [*codes, None])[0]


def transformed(keywords: Tree, code: str) -> Plane:
    """Return the transformation of an instrument's keywords TRANSX, TRANSY."""
    rows = _affine(keywords[f"{code}_TRANSX"], keywords[f"{code}_TRANSY"])
    return Plane(rows[:, 0], rows[:, 1:])


def not_zero(tree: Tree) -> float:
    found = tree.number()
    if not found:
        raise tree.error(phrase("format.zero"))
    return found


def read_lines(tree: Tree, center: float) -> Lines:
    """Return the times of lines from the upper edge."""
    rates = tree["line_scan_rate"]
    rows = np.array([row.numbers(3) for row in rates])
    if not len(rows):
        raise rates.error(phrase("format.empty"))
    with at_place(rates):
        return Lines(rows - [0.5, -center, 0.0])


_DRIFT = ("MULTIPLI_LINE_ERROR", "ADDITIVE_LINE_ERROR", "ADDITIONAL_PREROLL")
"""Keywords of an instrument: the rate of lines dt is dt (1 + first) + second, shifted by `third` lines."""


def fitting(
    lines: Lines, count: int, table: Floats, keywords: Tree, code: str | None
) -> tuple[Lines, tuple[Phrase, ...]]:
    """Return line times consistent with the pointing of the file, and remarks.

    The drift in the keywords of an instrument is applied if it improves the agreement with the ends of
    `table`, the (k,) times of the pointing: rates of newer files include it.
    """
    ends = table[[0, -1]]

    def misfit(own: Lines) -> float:
        return float(np.abs(np.sort(own.times([0.0, count])) - ends).max())

    remarks = []
    if code is not None and f"{code}_{_DRIFT[0]}" in keywords:
        factor, further, shift = (keywords[f"{code}_{name}"].number() for name in _DRIFT)
        rows = np.array(lines.table)
        rows[:, 2] = rows[:, 2] * (1 + factor) + further
        rows[:, 1] += shift * rows[:, 2]
        if misfit(drifted := Lines(rows)) < misfit(lines):
            lines = drifted
            remarks.append(phrase("csm.drift", rate=float(rows[0, 2])))
    span, known = float(abs(np.diff(lines.times([0.0, count]))[0])), float(ends[1] - ends[0])
    if known > 0 and abs(span - known) > APART * known:
        percent = 100 * abs(span - known) / max(span, known)
        remarks.append(phrase("csm.duration", lines=count, span=span, table=known, percent=percent))
    return lines, tuple(remarks)


_FRAME = "USGS_ASTRO_FRAME_SENSOR_MODEL"


def _middle(axis: str) -> Callable[[Tree], float | None]:
    def derive(tree: Tree) -> float | None:
        if not tree["name_model"].text().startswith(_FRAME) or tree[f"starting_detector_{axis}"].number():
            return None
        return tree[f"image_{axis}s"].whole(1) * tree[f"detector_{axis}_summing"].number() / 2

    return derive


def _only_time(tree: Tree) -> Any:
    times = tree["instrument_pointing"].get("ephemeris_times", []).value
    return times[0] if isinstance(times, list) and len(times) == 1 else None


_VALUES = tuple(declared(__file__, "isd.csv"))
_DERIVED: Mapping[str, Callable[[Tree], Any]] = {
    "detector_center/sample": _middle("sample"),
    "detector_center/line": _middle("line"),
    "center_ephemeris_time": _only_time,
}
"""Functions that derive a value from other fields."""


def completed(tree: Tree, keywords: Tree, code: str | None) -> tuple[Tree, tuple[Phrase, ...]]:
    """Return support data completed from other fields, and remarks.

    `isd.csv` declares the values, the keywords of an instrument that replace them, and their meaning. `code`
    is the prefix of the keywords.
    """
    remarks = []
    for path, keyword, meaning in _VALUES:
        group, _, name = path.rpartition("/")
        holder = tree.get(group, {}).value if group else tree.value
        if not isinstance(holder, dict) or holder.get(name) is not None:
            continue
        known = f"{code}_{keyword}"
        derive = _DERIVED.get(path)
        value = keywords[known].value if known in keywords else derive and derive(tree)
        if value is None:
            if name in holder or tree.value.get(group or name, 0) is None:
                raise Tree(None, tree.file, f"/{path}").error(phrase("csm.null", meaning=meaning))
            continue
        origin = "csm.from-keyword" if known in keywords else "csm.from-fields"
        remarks.append(phrase(origin, name=path, value=str(value), keyword=known))
        own = {**holder, name: value}
        tree = Tree({**tree.value, group: own} if group else own, tree.file)
    offsets = [tree[f"focal2pixel_{axis}s"].numbers(3)[0] for axis in ("sample", "line")]
    offsets += [tree["detector_center"][axis].number() for axis in ("sample", "line")]
    middle = _middle("sample")(tree), _middle("line")(tree)
    if None not in middle and not any(offsets):
        # The camera axis of the frame meets a corner.
        remarks.append(phrase("csm.corner", sample=middle[0], line=middle[1]))
    return tree, tuple(remarks)
