"""Pictures straight as SVG: whole, nothing over anything else or cut, what they show where it belongs."""

import base64
import io
import re
import subprocess
import sys
from importlib.resources import files
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest

from example_scripts import load
from photogram import adjust, collection, formats, simulate
from photogram.giant import read_project
from photogram.plots import PICTURES, figures
from photogram.plots.accessor import sketch_of
from photogram.show.sketch.colours import rgb
from photogram.show.sketch.declared import Panel, Sketch
from photogram.show.sketch.layout import laid_out
from photogram.show.sketch.letters import width, wrapped
from photogram.show.sketch.marks import Ellipses, Markers, Mesh, Shades
from photogram.show.sketch.names import overlap
from photogram.show.sketch.svg import svg_of
from photogram.show.sketch.svg_marks import svg
from photogram.show.sketch.ticks import ticks

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
    return {name: found for name in PICTURES if (found := sketch_of(result, name)) is not None}


def elements(sketch):
    """Return the parts of a picture as they are read of its file."""
    root = ElementTree.fromstring(svg_of(sketch, "name", "a <title>"))
    assert root.get("aria-label") == "a <title>"
    return root, list(root.iter())


def boxes(root):
    """Return the words of a picture that stand upright, and the boxes of these."""
    found = []

    def walk(node, size, anchor):
        size, anchor = float(node.get("font-size", size)), node.get("text-anchor", anchor)
        if node.tag.endswith("text") and "transform" not in node.attrib:
            wide = width(node.text, size)
            left = float(node.get("x")) - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * wide
            low = float(node.get("y"))
            found.append((node.text, (left, low - 0.7 * size, left + wide, low)))
        for child in node:
            walk(child, size, anchor)

    walk(root, 8.0, "start")
    return found


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
        root, _ = elements(sketch)
        *_, wide, high = map(float, root.get("viewBox").split())
        words = boxes(root)
        assert len(words) > 10
        for said, (left, top, right, low) in words:
            assert min(left, top) >= 0, (name, said)
            assert right <= wide, (name, said)
            assert low <= high, (name, said)
        over = [(a, b) for (a, one), (b, other) in combinations(words, 2) if overlap(one, other)]
        assert over == [], name


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
    for name, figure in figures(ring_result).items():
        sketch = sketch_of(ring_result, name)
        panels = [each for each in sketch.panels if each is not None]
        said = "".join(text for text, _ in boxes(elements(sketch)[0]))
        for axes, panel in zip(figure.axes, panels, strict=False):
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


@pytest.mark.parametrize("shape", ["o", ".", "+", "^", "s", "D"])
@pytest.mark.parametrize("limits", [[[0.0, 0.0], [10.0, 5.0]], [[0.0, 5.0], [10.0, 0.0]]])
def test_markers_lie_where_their_places_are_and_none_beyond_the_panel(shape, limits):
    places = np.random.default_rng(1).uniform([-5.0, -5.0], [15.0, 10.0], (200, 2))
    placed = placed_on(limits, equal=True)
    drawn = re.findall(r"M([-\d.]+) ([-\d.]+)", svg(Markers(places, shape, 4.0), placed))
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
    superscript = found.power.removeprefix("10").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    step = steps[0] if len(steps) else np.ptp(limits)
    written = [float(text.replace("−", "-")) * 10.0 ** int(superscript or 0) for text in found.texts]
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


def test_a_command_with_its_page_loads_no_matplotlib(tmp_path):
    code = (
        "import sys; from photogram.cli import app\n"
        "try: app(['adjust', '--example', '--self-calibrate', 'f,k1', '--out', 'o', '--quiet'])\n"
        "except SystemExit as end: assert end.code == 0, end.code\n"
        "assert 'jinja2' in sys.modules and 'matplotlib' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    titles = ["Plan of the network", "Image residuals", "Test values", "Correlations", "Radial distortion"]
    labels = re.findall(r'<svg role="img" aria-label="([^"]+)"', page)
    assert all(any(label.startswith(title) for label in labels) for title in titles)


def test_pages_of_networks_have_their_pictures_without_matplotlib(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert run("giant", "--example", "--out", "o").exit_code == 0
    assert (tmp_path / "o" / "report.html").read_text(encoding="utf-8").count("<svg ") == 4
