"""Pictures of orientations, plates, nights, comparators, plans: the style of the house, letters, names."""

from importlib.resources import files
from itertools import combinations
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="matplotlib is not installed")
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from example_scripts import load
from photogram import InputError, orient
from photogram.absolute_orientation import read_csv

EXAMPLES = Path(str(files("photogram").joinpath("examples")))
COMMANDS = [
    "absolute-orientation --example --out out --plots --no-html",
    "perspective-center --example --out out --plots --no-html",
    "stellar-camera --example --out out --plots --no-html",
    "stellar-camera exposures --example --out out --plots --no-html",
    "plan --strips 2 --photos-per-strip 4 --out out --plots --no-html",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_pictures_have_the_style_of_the_house(run, monkeypatch, command):
    made = []
    draw = Figure.draw

    def watched(figure, renderer):
        made.append(figure)
        return draw(figure, renderer)

    monkeypatch.setattr(Figure, "draw", watched)
    result = run(*command.split(), "--quiet")
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
    result.plot().on(axes)
    figure.draw_without_rendering()
    written = {each.get_text() for each in axes.texts}
    assert {"H101", "V205"} <= written
    assert overlapping(axes) == []


def test_a_plot_is_drawn_on_axes_or_saved(tmp_path):
    from photogram import adjust, plan, simulate, variance_components, variance_function
    from photogram.results import plot_distortion, plot_lens_field

    block = simulate(strips=2, photos_per_strip=4, seed=2).block
    result = adjust(load("self_calibration").measured())
    plots = {
        "components": variance_components(block).plot(),
        "function": variance_function(block).plot(),
        "field": plot_lens_field(result, result.cameras[0]),
    }
    for name, plot in plots.items():
        axes = Figure().subplots(1, 2)
        plot.on(axes[0])
        assert axes[0].has_data()
        assert not axes[1].has_data()
        plot.save(tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").read_bytes() == plot.render()
        plot.save(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
        with pytest.raises(InputError) as error:
            plot.on(axes)
        assert error.value.code == "plot.axes"
    three = Figure().subplots(3, 1)
    plot_distortion(result, result.cameras[0]).on(three)
    assert all(axes.has_data() for axes in three)
    left, right = Figure().subfigures(1, 2)
    truth = simulate(strips=2, photos_per_strip=4, seed=2).truth
    plan({"a": truth, "b": truth}).plot().on(left)
    assert len(left.axes) == 3
    assert not right.axes
