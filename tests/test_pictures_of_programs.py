"""Pictures of orientations, plates, nights, comparators, plans: the style of the house, letters, names."""

from functools import partial
from importlib.resources import files
from itertools import combinations
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="matplotlib is not installed")
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from example_scripts import load
from photogram import orient
from photogram.absolute_orientation import plot, read_csv

EXAMPLES = Path(str(files("photogram").joinpath("examples")))
COMMANDS = [
    "absolute-orientation --example --out out --plots --no-html",
    "perspective-center --example --out out --plots --no-html",
    "stellar-camera --example --out out --plots --no-html",
    "stellar-camera exposures --example --out out --plots --no-html",
    "plan --strips 2 --photos-per-strip 4 --out out --plots --no-html",
    "comparator --example --out out --pdf --no-html",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_pictures_have_the_style_of_the_house(run, monkeypatch, command, tmp_path):
    made = []
    draw = Figure.draw

    def watched(figure, renderer):
        made.append(figure)
        return draw(figure, renderer)

    monkeypatch.setattr(Figure, "draw", watched)
    plotted = ["--plot-format", "svg"] if "--plots" in command else []
    result = run(*command.split(), *plotted, "--quiet")
    assert result.exit_code == 0, result.output
    assert made
    for figure in made:
        for axes in figure.axes:
            bar = axes.get_label() == "<colorbar>"
            assert bar or not (axes.spines["top"].get_visible() or axes.spines["right"].get_visible())
            assert not axes.get_title(loc="center")
            legend = axes.get_legend()
            assert legend is None or not legend.get_frame_on()
        assert not any(legend.get_frame_on() for legend in figure.legends)
    for path in tmp_path.rglob("*.svg"):
        assert "<text" in path.read_text()


def overlapping(axes):
    """Return names that cover one another."""
    names = [each for each in axes.texts if isinstance(each, Annotation)]
    boxes = [(each.get_text(), each.get_window_extent()) for each in names]
    return [(a, b) for (a, one), (b, other) in combinations(boxes, 2) if one.overlaps(other)]


@pytest.mark.parametrize("size", [(8.5, 6.0), (4.0, 4.5)])
def test_names_of_control_do_not_cover_each_other_in_given_axes(size):
    result = orient(read_csv(EXAMPLES / "absolute_orientation" / "stations.csv"))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    assert plot.residuals(result, axes) is axes
    figure.draw_without_rendering()
    written = {each.get_text() for each in axes.texts}
    assert {"H101", "V205"} <= written
    assert overlapping(axes) == []


def test_what_is_drawn_goes_into_given_axes_or_a_file_or_both(tmp_path):
    from photogram import adjust, plan, simulate, variance_components, variance_function
    from photogram.results import draw_components, draw_distortion, draw_lens_field, draw_variance_function

    block = simulate(strips=2, photos_per_strip=4, seed=2).block
    result = adjust(load("self_calibration").measured())
    components, function = variance_components(block), variance_function(block)
    draws = {
        "components": partial(draw_components, components),
        "function": partial(draw_variance_function, function),
        "field": partial(draw_lens_field, result, result.cameras[0]),
    }
    for name, draw in draws.items():
        axes = Figure().subplots(1, 2)
        assert draw(ax=axes[0]) is axes[0]
        assert axes[0].has_data()
        assert not axes[1].has_data()
        assert draw(tmp_path / f"{name}.svg").has_data()
        assert (tmp_path / f"{name}.svg").read_bytes().startswith(b"<?xml")
        assert draw(tmp_path / f"{name}.png", axes[1]) is axes[1]
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
    three = Figure().subplots(3, 1)
    assert draw_distortion(result, result.cameras[0], ax=three).tolist() == three.tolist()
    for found in (components, function):
        axes = Figure().subplots()
        assert found.plot(axes) is axes
        assert axes.has_data()
    own = Figure()
    parts = own.subfigures(1, 2)
    truth = simulate(strips=2, photos_per_strip=4, seed=2).truth
    predicted = plan({"a": truth, "b": truth})
    assert predicted.plot(parts[0]) is parts[0]
    assert predicted.plot(own) is own
    assert len(parts[0].axes) == 3
