"""Random projects survive the files: the same numbers, and written again the same bytes."""

import math
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_project import same

from photogram import InputError
from photogram.giant import (
    Camera,
    Common,
    Frame,
    GroundPoint,
    ImageFrame,
    Project,
    read_project,
    write_project,
)
from photogram.giant.common import SWITCHES
from photogram.giant.fields import parse_angle, parse_name
from photogram.giant.files import NAMES

# What fits into a field, and what does not quite.

PRINTABLE = st.characters(codec="utf-8", exclude_categories=("C", "Z"))
MOSTLY_PLAIN = st.sampled_from("ABCDEFGHXYZabc0123456789!-+.*_ /'\"#&()é\u00d8\u03a9\u6c34\U0001f4f7")


@st.composite
def names(draw, strip=""):
    """Names of one to eight printable characters that the rules of the files leave as they are."""
    name = draw(st.text(draw(st.sampled_from([MOSTLY_PLAIN, PRINTABLE])), min_size=1, max_size=8))
    name = parse_name(name, strip) or "0"
    return name if not name.startswith("****") and parse_name(name, strip) == name else f"N{name[:7]}".strip()


@st.composite
def decimals(draw, width, positive=False):
    """Numbers that a field of a width can hold exactly, of all magnitudes."""
    digits = draw(st.integers(1, width - 2))
    units = draw(st.integers(int(positive), 10**digits - 1))
    places = draw(st.integers(0, min(width - 3, 9)))
    text = f"{Decimal(units).scaleb(-places):f}"
    if not positive and len(text) < width and draw(st.booleans()):
        text = f"-{text}"
    return float(text) if len(text) + ("." not in text) <= width else float(digits)


@st.composite
def packed_angles(draw, width, degrees=360, positive=False):
    """Angles that a DMS field of a width can hold exactly."""
    parts = draw(st.integers(0, degrees)), draw(st.integers(0, 59)), draw(st.integers(0, 59))
    parts = parts if parts[0] < degrees else (degrees, 0, 0)
    keep = draw(st.integers(0, 2))  # large angles, minutes, seconds
    whole = sum(part * size for part, size in list(zip(parts, (10000, 100, 1), strict=True))[keep:])
    sign = "" if positive or draw(st.booleans()) else "-"
    fraction = f"{draw(st.integers(0, 99999)):05d}" if parts[0] < degrees else "0"
    text = f"{sign}{whole}.{fraction}"[:width]
    value = parse_angle(text, 0)[0]
    return value if value or not positive else parse_angle("1.000", 0)[0]


@st.composite
def rounded(draw, exact, inexact):
    """Return a number that the field holds, or any other."""
    return draw(st.one_of(exact, inexact) if inexact is not None else exact)


@st.composite
def projects(draw, exact):
    """Projects of a few frames; `exact`: of numbers that the files hold without rounding."""
    anything = (lambda strategy: None) if exact else (lambda strategy: strategy)
    geographic, strip = draw(st.booleans()), draw(st.sampled_from(["", "", "0", "A", "\u00e9"]))
    lengths = rounded(decimals(12), anything(st.floats(-1e7, 1e7)))
    angles = rounded(packed_angles(12), anything(st.floats(-2 * math.pi, 2 * math.pi)))
    latitudes = rounded(packed_angles(12, 90), anything(st.floats(-1.57, 1.57)))
    length_sd = st.just(0.0) | rounded(decimals(10, positive=True), anything(st.floats(1e-3, 1e5)))
    angle_sd = st.just(0.0) | rounded(packed_angles(10, 90, positive=True), anything(st.floats(1e-8, 1.5)))
    millimetres = rounded(decimals(10), anything(st.floats(-300, 300)))
    distances = millimetres.map(lambda distance: distance if abs(distance) > 1e-5 else -152.74)
    planimetry = angle_sd if geographic else length_sd
    positions = st.tuples(angles, latitudes, lengths) if geographic else st.tuples(*[lengths] * 3)
    position_sd = st.tuples(planimetry, planimetry, length_sd)
    semi_minor = draw(st.integers(1, 30_000_000)) / 4

    def unique(count, least=0):
        return draw(st.lists(names(strip), min_size=least, max_size=count, unique=True))

    cameras = [Camera(name, draw(distances)) for name in [*unique(2), *draw(st.sampled_from([[], [""]]))]]
    frames = unique(4, least=1)
    points = unique(8, least=1)
    images = []
    for name in draw(st.permutations(frames)):
        seen = draw(st.lists(st.sampled_from(points), unique=True))
        xy = np.array([[draw(millimetres), draw(millimetres)] for _ in seen]).reshape(-1, 2)
        own = draw(st.just(0.0) | distances)
        sd = draw(st.tuples(length_sd, length_sd))
        images.append(
            ImageFrame(name, seen, xy, own, sd, draw(st.sampled_from(["", *(c.name for c in cameras)])))
        )
    common = Common(
        title=draw(st.text(MOSTLY_PLAIN, max_size=80)).strip(" "),
        geographic=geographic,
        strip=strip,
        unit_variance=draw(st.sampled_from(["free", "constrained", "unity"])),
        max_iterations=draw(st.integers(1, 9)),
        convergence_percent=draw(st.integers(1, 99)),
        water_level=draw(millimetres),
        residual_limit=draw(millimetres),
        semi_minor=semi_minor,
        semi_major=semi_minor + draw(st.integers(0, 100_000)) / 4,
        control_sd=draw(position_sd),
        **{name: draw(st.booleans()) for _, name, _ in SWITCHES if name != "geographic"},
    )
    return Project(
        common=common,
        cameras=cameras,
        frames=[
            Frame(
                name,
                draw(positions),
                draw(st.tuples(angles, angles, angles)),
                draw(position_sd),
                draw(st.tuples(angle_sd, angle_sd, angle_sd)),
            )
            for name in frames
        ],
        images=images,
        ground=[
            GroundPoint(name, draw(positions), draw(position_sd), draw(st.integers(0, 7)))
            for name in dict.fromkeys([*draw(st.lists(st.sampled_from(points), unique=True)), *unique(3)])
        ],
    )


def written_and_read(project, directory):
    """Return the project read from its files, and the bytes of these."""
    write_project(project, directory, overwrite=True)
    return read_project(directory), [(directory / name).read_bytes() for name in NAMES]


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    return tmp_path_factory.mktemp("project")


@pytest.mark.giant("2", "a project that is read, written and read again has the same numbers")
@settings(max_examples=50, deadline=None)
@given(projects(exact=True))
def test_section_2_numbers_that_fit_come_back_to_the_last_bit(directory, project):
    again, first = written_and_read(project, directory)
    same(again, project)
    assert written_and_read(again, directory)[1] == first


@settings(max_examples=50, deadline=None)
@given(projects(exact=False))
def test_any_numbers_come_back_rounded_and_then_stay(directory, project):
    once, first = written_and_read(project, directory)
    twice, second = written_and_read(once, directory)
    same(twice, once)
    assert second == first
    for one, other in zip(project.frames + project.ground, once.frames + once.ground, strict=True):
        close(one.position, other.position, project.common.geographic)
    for one, other in zip(project.frames, once.frames, strict=True):
        assert np.cos(np.subtract(one.attitude, other.attitude)) == pytest.approx(1, abs=1e-15)
    for one, other in zip(project.images, once.images, strict=True):
        np.testing.assert_allclose(one.xy, other.xy, rtol=0, atol=0.000051)


def close(one, other, geographic):
    """Assert that positions differ by no more than the fourth decimal of the second and of the length."""
    difference = np.subtract(one, other)
    if geographic:
        assert np.cos(difference[:2]) == pytest.approx(1, abs=1e-15)
        difference[:2] = 0
    assert np.abs(difference).max() <= 0.00051


@pytest.mark.parametrize("strip", ["AB", "\t", "\n"])
def test_only_one_printable_character_is_stripped(tmp_path, strip):
    project = Project(Common(strip=strip), [], [], [], [])
    with pytest.raises(InputError, match="COMMON cannot be written: the character that COMMON strips"):
        write_project(project, tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("item", [Camera("0C", -150.0), GroundPoint("00", (1.0, 2.0, 3.0))])
def test_names_that_would_be_stripped_are_refused(tmp_path, item):
    cameras, points = ([item], []) if isinstance(item, Camera) else ([], [item])
    project = Project(Common(strip="0"), cameras, [], [], points)
    with pytest.raises(InputError, check=lambda error: error.code == "giant.stripped-name"):
        write_project(project, tmp_path / "new")
    item.name = "0"  # a name of nothing else keeps one
    write_project(project, tmp_path / "new")
