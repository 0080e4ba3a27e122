"""Pictures straight as SVG: whole, nothing over anything else or cut, what they show where it belongs."""

import base64
import io
import re
from importlib.resources import files
from xml.etree import ElementTree

import numpy as np
import pytest

from example_scripts import load
from photogram import adjust, collection, formats, simulate
from photogram.giant import read_project
from photogram.show.sketch.layout import LABEL, laid_out, ticks, width, wrapped
from photogram.show.sketch.marks import (
    Ellipses,
    Markers,
    Mesh,
    Names,
    Panel,
    Shades,
    Sketch,
    Texts,
    contours,
    horizontal_line,
    rgb,
)
from photogram.show.sketch.svg import svg, svg_of
from svg_words import assert_readable, boxes, elements

EXAMPLES = files("photogram") / "examples"


def with_gross_errors():
    block = simulate(strips=3, photos_per_strip=6, seed=5).block
    xy = block.image_xy.copy()
    xy[40:42] += 0.5
    return adjust(block.replace(image_xy=xy))


RESULTS = {
    "galveston": lambda: adjust(read_project(EXAMPLES / "galveston").to_block()),
    "calibrated": lambda: adjust(load("self_calibration").measured()),
    "ring": lambda: collection.adjust(collection.read(EXAMPLES / "collection" / "ring.txt")),
    "archive": lambda: adjust(formats.read(str(EXAMPLES / "archive")).block, unit_variance="unity"),
    "gross": with_gross_errors,
}


@pytest.fixture(scope="module", params=RESULTS)
def sketches(request):
    """Return the pictures of a result by name."""
    result = RESULTS[request.param]()
    return result.plot.available()


def test_pictures_are_whole_and_their_identifiers_begin_with_their_names(sketches):
    for sketch in sketches.values():
        _, every = elements(sketch)
        names = [each.get("id") for each in every if each.get("id")]
        assert len(set(names)) == len(names) > 0
        assert all(name.startswith("name-") for name in names)
        used = re.findall(r"url\(#([^)]+)\)", svg_of(sketch, "name", ""))
        assert set(used) <= set(names)


def test_no_word_lies_over_another_or_is_cut(sketches):
    for name, sketch in sketches.items():
        assert len(assert_readable(sketch, name)) > 10


def test_numbers_along_axes_lie_within_their_limits(sketches):
    for sketch in sketches.values():
        for placed in laid_out(sketch):
            low, high = np.sort(placed.panel.limits, axis=0)
            for axis, given in enumerate((placed.across, placed.up)):
                assert len(given.values) >= 2
                room = 1e-9 * (high[axis] - low[axis])
                assert (given.values >= low[axis] - room).all()
                assert (given.values <= high[axis] + room).all()


def test_both_renderers_show_the_same(ring_result):
    for sketch in ring_result.plot.available().values():
        drawn = sketch.figure()
        panels = [each for each in sketch.panels if each is not None]
        said = "".join(text for text, _ in boxes(elements(sketch)[0]))
        for axes, panel in zip(drawn.axes, panels, strict=False):
            np.testing.assert_allclose(np.array([axes.get_xlim(), axes.get_ylim()]).T, panel.limits)
            assert axes.get_title(loc="left") == panel.title
            if axes.get_legend():
                assert all(text.get_text() in said for text in axes.get_legend().get_texts())


@pytest.fixture(scope="module")
def ring_result():
    return RESULTS["ring"]()


def placed_on(limits, marks=(), **more):
    [found] = laid_out(Sketch(5.0, 4.0, [Panel(np.array(limits), marks, **more)]))
    return found


@pytest.mark.parametrize("shape", ["o", ".", "+", "^", "s", "D", "*"])
@pytest.mark.parametrize("face", ["", "white"])
@pytest.mark.parametrize("limits", [[[0.0, 0.0], [10.0, 5.0]], [[0.0, 5.0], [10.0, 0.0]]])
def test_markers_lie_where_their_places_are_and_none_beyond_the_panel(shape, face, limits):
    places = np.random.default_rng(1).uniform([-5.0, -5.0], [15.0, 10.0], (200, 2))
    placed = placed_on(limits, equal=True)
    drawn = re.findall(r"M([-\d.]+) ([-\d.]+)", svg(Markers(places, shape, 4.0, face=face), placed))
    inside = ((places >= 0) & (places <= [10.0, 5.0])).all(axis=1)
    assert len(drawn) == inside.sum()
    left, top, right, low = placed.box
    expected = placed.at(places[inside])
    assert ((expected >= [left, top]) & (expected <= [right, low])).all()
    shift = np.array(drawn, float) - expected
    assert np.ptp(shift, axis=0) == pytest.approx(0.0, abs=0.11)
    assert np.abs(shift).max() < 3.0
    across, up = (places[inside] / [10.0, 5.0]).T
    np.testing.assert_allclose(expected[:, 0], left + across * (right - left))
    down = up if limits[0][1] > 0 else 1.0 - up
    np.testing.assert_allclose(expected[:, 1], top + down * (low - top))


def test_the_smallest_value_lies_on_top_in_its_colour():
    shades = Shades(0.0, 1.0, "")
    places, values = np.full((3, 2), 0.5), np.array([0.0, 1.0, 0.5])
    drawn = svg(Markers(places, "o", 4.0, values=values, shades=shades), placed_on([[0.0, 0.0], [1.0, 1.0]]))
    assert re.findall(r'stroke="(#\w+)"', drawn)[::2] == ["#fee838", "#00224e"]


def test_an_ellipse_has_its_axes_and_turn():
    placed = placed_on([[0.0, 0.0], [10.0, 5.0]], equal=True)
    scale = (placed.box[2] - placed.box[0]) / 10.0
    mark = Ellipses(np.array([[5.0, 2.5]]), np.array([[2.0, 1.0]]), np.array([30.0]), "#000000", 1.0)
    numbers = [float(each) for each in re.findall(r"-?\d+\.?\d*", svg(mark, placed).partition("stroke")[0])]
    start, (a, b, turn) = numbers[:2], numbers[2:5]
    assert (a, b) == pytest.approx((2.0 * scale, scale), abs=0.01)
    assert turn == pytest.approx(-30.0)
    end = placed.at(np.array([5.0 + 2.0 * np.cos(np.pi / 6), 3.5]))
    assert start == pytest.approx(end.tolist(), abs=0.01)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_cells_have_the_colours_of_their_values_and_none_without(up):
    from PIL import Image

    shades = Shades(0.0, 1.0, "")
    values = np.array([[0.0, 0.5, 1.0], [np.nan, 0.25, 0.75]])
    limits = [[0.0, 0.0], [3.0, 2.0]] if up > 0 else [[0.0, 2.0], [3.0, 0.0]]
    mark = Mesh(np.array([[0.0, 0.0], [3.0, 2.0]]), values, shades)
    [content] = re.findall(r"base64,([^\"]+)", svg(mark, placed_on(limits, equal=True)))
    pixels = np.array(Image.open(io.BytesIO(base64.b64decode(content))))
    seen = values[::-1] if up > 0 else values
    np.testing.assert_array_equal(pixels[..., 3] > 0, np.isfinite(seen))
    there = np.isfinite(seen)
    np.testing.assert_array_equal(pixels[there][:, :3], rgb(shades, seen[there]))


def test_colours_are_nearly_those_of_cividis():
    from matplotlib import colormaps

    values = np.linspace(0.0, 1.0, 256)
    own = rgb(Shades(0.0, 1.0, ""), values)
    assert np.abs(own - 255.0 * colormaps["cividis"](np.arange(256))[:, :3]).max() < 4.5


def test_words_are_as_wide_as_matplotlib_draws_them():
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    said = "1,798 images, rms 5.64 (means of cells) WXYZ {kgpq}~!"
    drawn = TextPath((0, 0), said, size=10.0, prop=FontProperties(family="DejaVu Sans"))
    assert width(said, 10.0) == pytest.approx(drawn.get_extents().width, rel=0.02)
    lines = wrapped(said, 10.0, 120.0)
    assert " ".join(lines) == said
    assert 2 < len(lines) < 6
    assert max(width(line, 10.0) for line in lines) <= 120.0


LIMITS = [
    (0.0, 1.0),
    (-3.7, 4.1),
    (499_850.0, 500_910.0),
    (5e6 + 0.001, 5e6 + 0.004),
    (0.0, 3.2e-7),
    (-2e9, 9e9),
]


@pytest.mark.parametrize("limits", [*LIMITS, *(limits[::-1] for limits in LIMITS)])
@pytest.mark.parametrize("length", [60.0, 200.0, 450.0])
@pytest.mark.parametrize("across", [True, False])
def test_ticks_are_even_steps_of_1_2_or_5_that_are_written_as_they_are(limits, length, across):
    found = ticks(np.array(limits), length, 8.0, across=across)
    steps = np.diff(found.values)
    assert len(found.values) >= 2 or (across and width(found.texts[0], 8.0) > length - 8.0)
    assert min(limits) - 1e-9 * np.ptp(limits) <= found.values.min()
    assert found.values.max() <= max(limits) + 1e-9 * np.ptp(limits)
    if len(steps) > 1:
        assert steps == pytest.approx(steps[0], rel=1e-5)
        assert f"{steps[0]:.0e}"[0] in "125"
        wide = max(width(text, 8.0) for text in found.texts)
        assert not across or wide < steps[0] / np.ptp(limits) * length
    step = steps[0] if len(steps) else np.ptp(limits)
    written = [float(text.replace("−", "-")) for text in found.texts]
    assert written == pytest.approx(found.values.tolist(), abs=0.1 * step)
    assert len(set(found.texts)) == len(found.texts)


@pytest.mark.parametrize("equal", [True, False])
@pytest.mark.parametrize(
    "limits", [[[5e5, 5e5], [5e5, 5e5]], [[0.0, 0.0], [0.0, 1.0]], [[0.0, 0.0], [1e-9, 1e9]]]
)
def test_panels_of_one_value_or_far_from_square_are_drawn(limits, equal):
    panel = Panel(np.array(limits), [Markers(np.array(limits[:1]), "+", 3.0)], equal=equal)
    drawn = svg_of(Sketch(5.0, 4.0, [panel]), "name", "")
    assert ElementTree.fromstring(drawn) is not None
    assert "nan" not in drawn


def test_a_picture_without_panels_is_nothing():
    assert svg_of(Sketch(5.0, 4.0, [None]), "name", "") == ""


def test_contours_have_the_colours_between_their_levels_and_say_these():
    x, y = np.linspace(0.0, 2.0, 41), np.linspace(0.0, 1.0, 21)
    values = np.where(x < 0.5, np.nan, np.repeat(10.0 ** x[np.newaxis], 21, axis=0))
    shades = Shades(1.0, 100.0, "", log=True)
    made = contours(x, y, values, np.array([1.0, 10.0, 100.0]), shades, steps=2)
    placed = placed_on([[0.0, 0.0], [2.0, 1.0]], made)
    drawn = "".join(svg(mark, placed) for mark in made)
    colours = re.findall(r'fill="(#\w+)"', drawn)
    middles = rgb(shades, 10.0 ** np.array([0.25, 0.75, 1.25, 1.75]))
    assert colours == ["#{:02x}{:02x}{:02x}".format(*each) for each in middles.tolist()]
    paths = re.findall(r"M([\d.]+) [\d.]+l([-\d. ]+)", drawn)
    steps = [re.findall(r"-?[\d.]+", each)[::2] for _, each in paths]
    left = [
        np.cumsum([float(start), *map(float, each)]).min()
        for (start, _), each in zip(paths, steps, strict=True)
    ]
    assert min(left) == pytest.approx(placed.at(np.array([0.5, 0.0]))[0], abs=0.01)
    root, _ = elements(Sketch(5.0, 4.0, [placed.panel]))
    assert "10" in [said for said, _ in boxes(root)]


def test_equal_ratios_are_equally_long_along_logarithmic_axes():
    placed = placed_on([[1.0, 0.1], [100.0, 10.0]], log_across=True, log_up=True)
    at = placed.at(np.array([[1.0, 0.1], [10.0, 1.0], [100.0, 10.0]]))
    assert at[1] == pytest.approx(at[[0, 2]].mean(axis=0))
    assert placed.across.texts == ["1", "2", "5", "10", "20", "50", "100"]


def test_legends_are_beside_or_below_the_panel():
    marks = [Markers(np.array([[0.05, 0.95], [0.95, 0.05]]), "o", 3.0, label="point")]
    for legend in ("beside", "below"):
        placed = placed_on([[0.0, 0.0], [1.0, 1.0]], marks, legend=legend, across="across")
        [at] = [mark.places[0] for mark in placed.frame if isinstance(mark, Texts) and "point" in mark.texts]
        left, top, right, low = placed.box
        if legend == "beside":
            assert at[0] > right
            assert top < at[1] < low
        else:
            assert left < at[0] < right
            assert at[1] > low + LABEL


def test_centred_names_are_on_their_points_if_there_is_space():
    mark = Names(np.array([[0.5, 0.5], [0.51, 0.5]]), ["one", "two"], ["black"] * 2, centred=True)
    [(said, (left, top, right, low))] = [
        each
        for each in boxes(elements(Sketch(5.0, 4.0, [Panel(np.array([[0.0, 0.0], [1.0, 1.0]]), [mark])]))[0])
        if each[0] in mark.texts
    ]
    at = placed_on([[0.0, 0.0], [1.0, 1.0]], [mark]).at(mark.places[0])
    assert said == "one"
    assert [(left + right) / 2, (top + low) / 2] == pytest.approx(at.tolist(), abs=2.0)


def test_names_of_panels_below_each_other_are_aligned():
    panels = [
        Panel(np.array([[0.0, 0.0], [1.0, top]]), [horizontal_line(0.0, "black")], up=f"up {top}")
        for top in (1.0, 123456.0)
    ]
    drawn = svg_of(Sketch(5.0, 6.0, panels, 1), "name", "")
    places = [float(re.search(rf'<text x="([\d.]+)"[^>]*>{each.up}', drawn)[1]) for each in panels]
    assert places[0] == places[1]


def test_a_mark_without_a_sample_has_no_label():
    mark = Names(np.array([[0.5, 0.5]]), ["one"], ["black"], label="names")
    with pytest.raises(TypeError, match="Names"):
        placed_on([[0.0, 0.0], [1.0, 1.0]], [mark], legend="beside")
