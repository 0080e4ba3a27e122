"""Pictures of all programs as pages have them: without matplotlib, readable, and the same on axes."""

import re
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram.cli import app
from svg_words import assert_readable, elements

COMMANDS = {
    "comparator": "comparator --example",
    "plate": "stellar-camera --example",
    "night": "stellar-camera exposures --example",
    "projector": "perspective-center --example",
    "orientation": "absolute-orientation --example",
    "plan": "plan --strips 2 --photos-per-strip 4",
    "board": "calibrate --example",
    "components": "giant --example --components kind",
}


@pytest.fixture(scope="module", params=COMMANDS)
def sketches(request, tmp_path_factory):
    """Return the pictures of the page of a command, by their names."""
    found = {}

    def kept(drawing):
        found[drawing.name] = drawing.sketch()

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("photogram.show.html.inlined", kept)
        out = tmp_path_factory.mktemp("out") / "o"
        result = CliRunner().invoke(app, [*COMMANDS[request.param].split(), "--out", str(out), "--quiet"])
    assert result.exit_code in (0, 4), result.output
    return {name: sketch for name, sketch in found.items() if sketch is not None}


def test_they_can_be_read(sketches):
    assert sketches
    for name, sketch in sketches.items():
        words = assert_readable(sketch, name)
        assert len(words) > 5
        assert not any("nan" in said for said, _ in words)


def test_they_are_the_same_on_axes(sketches):
    pytest.importorskip("matplotlib")

    for name, sketch in sketches.items():
        drawn = sketch.figure()
        panels = [each for each in sketch.panels if each is not None]
        shown = [axes for axes in drawn.axes if axes.get_visible()]
        _, every = elements(sketch)
        said = " ".join(each.text or "" for each in every)
        for axes, panel in zip(shown, panels, strict=False):
            limits = np.array([axes.get_xlim(), axes.get_ylim()]).T
            np.testing.assert_allclose(limits, panel.limits, err_msg=name)
            assert axes.get_title(loc="left") == panel.title
            assert all(word in said for word in panel.title.split())
            if axes.get_legend():
                assert all(text.get_text() in said for text in axes.get_legend().get_texts())


@pytest.mark.parametrize(
    "commands", [["adjust --example --self-calibrate f,k1"], [COMMANDS[each] for each in COMMANDS]]
)
def test_commands_with_their_pages_load_no_matplotlib(commands, tmp_path):
    asked = [[*each.split(), "--out", f"o{k}", "--quiet"] for k, each in enumerate(commands)]
    code = (
        "import sys; from photogram.cli import app\n"
        f"for asked in {asked}:\n"
        "    try: app(asked)\n"
        "    except SystemExit as end: assert end.code in (0, 4), end.code\n"
        "    assert 'photogram.show.html' in sys.modules and 'matplotlib' not in sys.modules, asked"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)
    for k in range(len(commands)):
        page = (tmp_path / f"o{k}" / "report.html").read_text(encoding="utf-8")
        assert re.search(r'<svg role="img" aria-label="[^"]+"', page)


def test_pages_of_networks_have_their_pictures_without_matplotlib(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert run("giant", "--example", "--out", "o").exit_code == 0
    assert (tmp_path / "o" / "report.html").read_text(encoding="utf-8").count("<svg ") == 4
