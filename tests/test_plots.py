"""Pictures of results: axes in and out, all kinds of networks, nothing over anything else, equal files."""

import re
import subprocess
import sys
from importlib.resources import files
from inspect import signature
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from example_scripts import EXAMPLES, load
from photogram import InputError, Spheroid, adjust, collection, simulate
from photogram.giant import read_project
from photogram.network.rays import local_axes
from photogram.plots import Plot
from photogram.plots.accessor import PLOTS
from photogram.plots.selection import cells, first_panels
from photogram.show.sketch.marks import Names, Panel

ALWAYS = {"network", "residuals", "redundancy", "undetected", "tests"}
OF_LENSES = [name for name in PLOTS if name not in ("features", "films")]
"""Of networks with unknown lenses, to which nothing is fitted, without films."""


@pytest.fixture(scope="module")
def galveston():
    return adjust(read_project(files("photogram") / "examples" / "galveston").to_block())


@pytest.fixture(scope="module")
def calibrated():
    return adjust(load("self_calibration").measured())


@pytest.fixture(scope="module")
def ring():
    return collection.adjust(collection.read(files("photogram") / "examples" / "collection" / "ring.txt"))


@pytest.fixture(scope="module")
def large():
    return adjust(simulate(strips=8, photos_per_strip=60, points_per_photo=30, position_sd=0.1, seed=1).block)


def written(plot):
    """Return all letters of a plot that are seen on axes."""
    found = []
    for axes in plot.figure().axes:
        found += [axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel()]
        found += [text.get_text() for text in axes.texts]
        if axes.get_legend():
            found += [text.get_text() for text in axes.get_legend().get_texts()]
    return "\n".join(found)


def test_every_network_has_its_plots(galveston, calibrated, ring):
    assert set(galveston.plot.available()) == ALWAYS
    # A collection without control has no hypotheses.
    assert set(calibrated.plot.available()) == {*ring.plot.available(), "undetected"} == set(OF_LENSES)


def test_plots_are_drawn_on_axes(calibrated):
    axes = Figure().subplots(3, 2)
    calibrated.plot.network().on(axes[0, 0])
    calibrated.plot.residuals().on(axes[1, 0])
    calibrated.plot.tests().on(axes[2])
    assert [each.has_data() for each in axes.flat] == [True, False, True, False, True, True]
    with pytest.raises(InputError) as error:
        calibrated.plot.redundancy().on(axes[1, 1])
    assert error.value.code == "plot.axes"
    empty = Figure()
    calibrated.plot.redundancy().on(empty)
    assert len(empty.axes) == 3


def test_a_plot_shows_itself_in_a_notebook(galveston, calibrated):
    plot = galveston.plot.network()
    assert isinstance(plot, Plot)
    assert repr(plot) == f"Plot({galveston.block.title!r}, 1 panel, {plot.width:.3g} x {plot.height:.3g} in)"
    first, second = (each._repr_svg_() for each in (plot, calibrated.plot.network()))
    identifiers = [set(re.findall(r'id="([^"]+)"', each)) for each in (first, second)]
    assert identifiers[0]
    assert identifiers[0].isdisjoint(identifiers[1])
    assert first == galveston.plot.network()._repr_svg_()


def test_methods_have_the_arguments_and_docstrings_of_their_functions(galveston):
    method = galveston.plot.network
    assert str(signature(method)).startswith("(*, plane:")
    assert method.__doc__ == PLOTS["network"].__doc__
    assert {*PLOTS, "trajectory"} <= set(dir(galveston.plot))


def test_plots_without_data_are_refused(galveston):
    for name in ("correlations", "distortion"):
        with pytest.raises(InputError) as error:
            getattr(galveston.plot, name)()
        assert error.value.code == f"plot.{name}"
    with pytest.raises(InputError, match="plane: must be one of XY, XZ, YZ"):
        galveston.plot.network(plane="up")
    bare = adjust(galveston.block, covariance=False)
    assert set(bare.plot.available()) == {"network", "residuals"}


def test_the_network_shows_what_it_is_of(galveston):
    said = written(galveston.plot.network())
    assert "E, m" in said
    assert "photo (20)" in said
    assert "control point (22)" in said
    assert "2 rays (21)" in said
    assert "semi-axes of error ellipses, 95%" in said
    names = galveston.block.point_ids
    in_plan = galveston._plot_data().covariances(np.arange(len(names)))[:, :2, :2]
    sizes = np.sqrt(np.linalg.eigvalsh(in_plan)[:, 1])
    worst = int(np.nanargmax(sizes))
    assert f"{2.4477 * sizes[worst]:.3g} m, point {names[worst]}" in said


def test_large_networks_are_thinned_and_the_picture_says_so(large):
    plots = large.plot.available()
    said = written(plots["network"])
    assert "400 of 480 footprints are drawn" in said
    assert "the median one of each of" in said
    count = sum(len(each.get_offsets()) for each in plots["network"].figure().axes[0].collections[1:6])
    assert count <= 6000 + 150
    assert "means of cells with" in written(plots["residuals"])
    assert set(plots) == ALWAYS
    assert sum(len(plot.render("svg")) for plot in plots.values()) < 3e6


def test_names_do_not_touch(galveston):
    drawn = galveston.plot.network().figure()
    drawn.draw_without_rendering()
    axes = drawn.axes[0]
    named = [
        text
        for text in axes.texts
        if text.get_text() in {*galveston.block.photo_ids, *galveston.block.point_ids}
    ]
    assert len(named) > 30
    boxes = [text.get_window_extent() for text in named]
    for row, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:row])


def test_a_name_without_room_is_omitted():
    places = np.full((12, 2), 0.5) + 1e-3 * np.arange(12)[:, np.newaxis]
    names = Names(places, ["a long name"] * 12, ["black"] * 12)
    axes = Plot(2.0, 2.0, [Panel(np.array([[0.0, 0.0], [1.0, 1.0]]), [names])]).figure().axes[0]
    assert 0 < len(axes.texts) < 12


def test_only_the_first_parts_are_drawn_with_a_note():
    def draw(part):
        return Panel(np.array([[0.0, 0.0], [1.0, 1.0]]), title=f"{part}", notes=["a note"])

    panels = first_panels("films", "fields", [1, 2, 3], 2, draw)
    assert [(panel.title, len(panel.notes)) for panel in panels] == [("1", 1), ("2", 2)]
    assert panels[-1].notes[-1] == "the first 2 of 3 fields are drawn"
    with pytest.raises(InputError) as error:
        first_panels("films", "fields", [], 2, draw)
    assert error.value.code == "plot.films"


def test_means_of_cells():
    random = np.random.default_rng(5)
    xy = random.uniform([-30.0, -10.0], [30.0, 10.0], (2000, 2))
    grid = cells(xy, 6)
    assert (grid.columns, grid.rows) == (6, 2)
    np.testing.assert_allclose(grid.means(xy[:, 0]), grid.middles[:, 0], atol=1.5)
    np.testing.assert_allclose(grid.means(xy[:, 1]), grid.middles[:, 1], atol=1.5)
    assert grid.counts.sum() == 2000


def test_a_lens_that_was_left_out_shows_in_the_means_of_the_cells(large):
    block = large.block
    radius = np.hypot(*block.image_xy.T)[:, np.newaxis]
    bent = block.replace(image_xy=block.image_xy * (1 + 3e-8 * radius**2))
    said = written(adjust(bent).plot.residuals())
    assert "are larger than chance gives" in said
    assert "are larger than chance gives" not in written(large.plot.residuals())


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_equal_results_give_equal_files(ring, ending):
    first, second = (ring.plot.network().render(ending) for _ in range(2))
    assert first == second


def test_saved_pictures_are_all_there(calibrated, tmp_path):
    found = calibrated.plot.save(tmp_path, "svg")
    assert [path.name for path in found] == [f"{name}.svg" for name in OF_LENSES]
    assert all(path.read_bytes().startswith(b"<svg") for path in found)
    with pytest.raises(InputError, match="got 'doc'"):
        calibrated.plot.save(tmp_path, "doc")


@pytest.mark.parametrize("command", ["giant", "collection", "adjust"])
def test_commands_write_all_pictures(run, tmp_path, command):
    result = run(command, "--example", "--out", "o", "--plots", "--plot-format", "svg", "--quiet")
    assert result.exit_code == 0, result.output
    there = {path.stem for path in (tmp_path / "o").glob("*.svg")}
    assert there >= ALWAYS - {"undetected" if command == "collection" else ""}


def test_pictures_need_a_place(run):
    ring = files("photogram") / "examples" / "collection" / "ring.txt"
    result = run("collection", str(ring), "--plots")
    assert result.exit_code == 2
    assert "requires --out DIR" in result.stderr


def test_svg_needs_no_matplotlib_and_other_formats_name_the_extra(galveston, monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "network" in repr(galveston.plot)
    plot = galveston.plot.network()
    assert plot.render("svg").startswith(b"<svg")
    for draw in (lambda: plot.render("png"), lambda: plot.on(None)):
        with pytest.raises(ModuleNotFoundError, match=r"pip install 'photogram\[plots\]'"):
            draw()


def test_a_network_on_both_sides_of_the_antimeridian_has_the_same_plan():
    here, there = (
        simulate(spheroid=Spheroid.wgs84(), origin=(longitude, 0.848, 140.0), seed=1).truth
        for longitude in (0.1, np.pi)
    )
    positions = (local_axes(block).positions(block.photo_positions) for block in (here, there))
    np.testing.assert_allclose(*positions, atol=1e-3)


def test_an_adjustment_loads_no_matplotlib():
    code = (
        "import sys, photogram; r = photogram.adjust(photogram.simulate(strips=2, photos_per_strip=3).block);"
        " r.plot; assert 'matplotlib' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_page_quotes_the_example_and_shows_pictures_that_are_there():
    root = Path(__file__).parents[1]
    command = [sys.executable, root / "docs" / "regenerate.py", "--check", "pictures.md"]
    assert subprocess.run(command, check=False).returncode == 0
    page = (root / "docs" / "pictures.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^\]]+\]\(pictures/(\w+)\.svg\)", page)
    assert sorted(shown) == sorted(PLOTS)
    for name in shown:
        assert 2_000 < (root / "docs" / "pictures" / f"{name}.svg").stat().st_size < 200_000


def test_the_example_writes_all_pictures(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    load("pictures").main([str(tmp_path)])
    assert {path.name for path in tmp_path.iterdir()} == {
        "side-by-side.png",
        *(f"{name}.svg" for name in OF_LENSES),
    }


def test_what_weighs_nothing_is_no_spike_among_test_values():
    """Stations whose standard deviations are kilometres are all at 0, and test nothing."""
    options = {"strips": 2, "photos_per_strip": 4, "seed": 5}
    plain = adjust(simulate(**options).block)
    block = simulate(**options).block
    loose = adjust(block.replace(photo_position_sd=1e6, photo_attitude_sd=1e3))
    first, second = (each.plot.tests().panels[0].marks[0].label for each in (plain, loose))
    assert first == second


def test_names_of_photos_can_be_read():
    from photogram.show.style import SOFT

    channel = [int(SOFT[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channel]
    luminance = float(np.dot([0.2126, 0.7152, 0.0722], linear))
    assert 1.05 / (luminance + 0.05) > 4.5
    [panel] = adjust(simulate(strips=2, photos_per_strip=4, seed=5).block).plot.network().panels
    [names] = [mark for mark in panel.marks if isinstance(mark, Names)]
    colours = zip(names.texts, names.colours, strict=True)
    assert {colour for name, colour in colours if name.startswith("010")} == {SOFT}


def test_the_repr_of_a_result_has_all_of_its_verdict():
    block = simulate(strips=2, photos_per_strip=4, seed=5).block
    xy = block.image_xy.copy()
    xy[40:44] += 1.0
    result = adjust(block.replace(image_xy=xy))
    assert len(result.verdict.headline) > 110
    assert result.verdict.headline in " ".join(repr(result).split())
    assert max(map(len, repr(result).splitlines())) <= 110
