"""Every way to import works by itself, in a new process."""

import ast
import inspect
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from inspect import signature
from pathlib import Path
from pkgutil import resolve_name

import pytest

import photogram
import public_api

BENCHES = sorted((Path(__file__).parents[1] / "benches").glob("*.py"))


@pytest.mark.parametrize(
    ("statement", "name"),
    [
        ("import photogram.network.block", "photogram.network.block.Block"),
        ("import photogram", "photogram.Spheroid"),
        ("from photogram.statistics import reliability", "reliability.noncentrality"),
        ("from photogram.statistics import global_test", "global_test"),
        ("from photogram.adjustment import adjust, Progress", "adjust"),
        ("import photogram.adjustment", "photogram.adjust"),
        ("from photogram.distributed import plan_in_parts", "plan_in_parts"),
        ("from photogram.network import Film, Trajectory, project, with_gnss", "project"),
        ("import photogram", "photogram.formats.csm.read_support"),
        ("import photogram", "photogram.comparator.pictures.sketches"),
        ("import photogram.io.writing", "photogram.io.writing.check_outputs"),
    ],
)
def test_every_way_to_import_works_in_a_new_process(statement, name):
    program = f"{statement}; print({name}.__name__)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == name.rpartition(".")[2]


@pytest.mark.parametrize("package", list(public_api.packages()))
def test_a_module_does_not_stand_in_the_place_of_what_is_called_like_it(package):
    home = import_module(package)
    folder = Path(home.__file__).parent
    for name in public_api.names(home):
        if (folder / f"{name}.py").exists() or (folder / name / "__init__.py").exists():
            import_module(f"{package}.{name}")
            assert not inspect.ismodule(getattr(home, name))


def test_each_thing_has_one_public_name():
    names = {}
    for package in public_api.packages():
        home = import_module(package)
        assert sorted(set(home.__all__)) == sorted(home.__all__)
        for name in public_api.names(home):
            value = getattr(home, name)
            if callable(value):
                names.setdefault(inspect.unwrap(value), []).append(f"{package}.{name}")
    assert len(names) > 300
    assert [several for several in names.values() if len(several) > 1] == []


def test_other_names_are_not_found():
    for name in ("photogram.nothing", "photogram.giant.nothing", "photogram.diagnosis.nothing"):
        with pytest.raises(ModuleNotFoundError, match="nothing"):
            import_module(name)
    with pytest.raises(AttributeError, match=r"No photogram\.adjustment attribute nothing"):
        import_module("photogram.adjustment").nothing  # noqa: B018


def test_the_reference_says_names_that_there_are():
    pages = sorted((Path(__file__).parents[1] / "docs" / "reference").glob("*.md"))
    lines = [line for page in pages for line in page.read_text(encoding="utf-8").splitlines()]
    said = [line.removeprefix("::: ") for line in lines if line.startswith("::: ")]
    assert len(said) == len(set(said))
    assert set(public_api.packages()) < set(said)
    for name in said:
        assert resolve_name(name) is not None


def test_the_top_has_no_more_names_than_can_be_read():
    assert len(public_api.names(photogram)) <= 61
    assert {"Distance", "Position", "LeverArm"} <= set(photogram.__all__)


@pytest.mark.parametrize(
    "call",
    [
        photogram.adjust,
        photogram.adjust_in_parts,
        photogram.collection.adjust,
        photogram.targets.Calibration.adjust,
    ],
)
def test_what_adjusts_has_no_more_parameters_than_can_be_read(call):
    assert len(signature(call).parameters) <= 10


PARTS = """
from photogram import adjust_in_parts, simulate
from photogram.distributed import Division

block = simulate(strips=2, photos_per_strip=4, seed=1).block
print(adjust_in_parts(block, Division(parts=2)).report().splitlines()[0])
"""
COLLECTED = """
from photogram.adjustment.snooping import snoop
from photogram.collection.simulation import simulate

print(snoop(simulate(seed=1).collection).result.report().splitlines()[0])
"""


@pytest.mark.parametrize("program", [PARTS, COLLECTED])
def test_what_is_called_finds_what_it_needs(program):
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


@pytest.mark.parametrize("bench", BENCHES, ids=lambda path: path.stem)
def test_names_that_a_benchmark_imports_exist(bench):
    for node in ast.walk(ast.parse(bench.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "photogram":
            home = import_module(node.module or "")
            for name in (each.name for each in node.names):
                assert hasattr(home, name) or find_spec(f"{node.module}.{name}"), f"{node.module}.{name}"
