"""Modules under the names that they had before they lay in folders: the same modules."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name

import pytest

import photogram
from photogram.former_names import TODAY, today

SOURCES = Path(photogram.__file__).parent


@pytest.mark.parametrize("former", sorted(TODAY))
def test_a_former_name_is_the_module_of_today(former):
    module = import_module(f"photogram.{former}")
    assert module is import_module(f"photogram.{TODAY[former]}")
    assert module.__name__ == module.__spec__.name == f"photogram.{TODAY[former]}"
    assert not (SOURCES / Path(*former.split("."))).with_suffix(".py").exists()


def test_what_lay_inside_a_folder_that_moved_has_its_former_name_too():
    from photogram.io.writing.outputs import OutputSet
    from photogram.writing.outputs import OutputSet as FormerSet

    assert FormerSet is OutputSet


@pytest.mark.parametrize(
    ("statement", "name"),
    [
        ("import photogram.block", "photogram.block.Block"),
        ("import photogram", "photogram.geometry.Spheroid"),
        ("from photogram import reliability", "reliability.noncentrality"),
        ("from photogram.statistics import global_test", "global_test"),
        ("from photogram.adjustment import adjust, Progress", "adjust"),
        ("import photogram.adjustment", "photogram.adjust"),
        ("import photogram.writing.guard", "photogram.writing.guard.check_outputs"),
    ],
)
def test_every_way_to_import_works_in_a_new_process(statement, name):
    program = f"{statement}; print({name}.__name__)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == name.rpartition(".")[2]


def test_other_names_are_not_found():
    for name in ("photogram.nothing", "photogram.giant.nothing", "photogram.diagnosis.nothing"):
        with pytest.raises(ModuleNotFoundError, match="nothing"):
            import_module(name)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        import_module("photogram.adjustment").nothing  # noqa: B018


def test_the_reference_says_the_names_of_today():
    page = (Path(__file__).parents[1] / "docs" / "reference.md").read_text()
    said = [line.removeprefix("::: ") for line in page.splitlines() if line.startswith("::: ")]
    assert len(said) > 40
    for name in said:
        assert today(name) is None, name
        assert resolve_name(name) is not None
