"""What small work loads: nothing that it does not need, so that it feels instant (`benches/entrance.py`)."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

COMMAND = """
import sys
sys.argv = ["photogram", *{arguments!r}]
from photogram.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
"""
HEAVY = (
    "matplotlib",
    "pandas",
    "pyarrow",
    "pydantic",
    "pyproj",
    "geopandas",
    "scipy",
    "erfa",
    "tetra3rs",
)
SHOWING = ("rich", "typer", "photogram.results.document", "photogram.show.html", "photogram.show.page")
NUMERICAL = ("numpy", "orjson", "photogram._photocore")
SELDOM = (
    "difflib",
    "numpy.ma",
    "photogram.network.simulated_scanner",
    "photogram.results.network_trial",
    "photogram.results.reliability",
    "photogram.results.snooping_log",
    "photogram.show.quantity",
    "photogram.statistics.verdict",
    "statistics",
)
OF_OTHERS = (
    "photogram.diagnosis.conventions",
    "photogram.film.certificate",
    "photogram.formats.blocks_exchange",
    "photogram.formats.isis.assembling",
    "photogram.giant.printout",
    "photogram.targets.first_calibration",
    "urllib.request",
)
"""Modules for blocks of other kinds, and for adjustments that fail."""
MOST = 420
"""Modules of the package that the adjustment of a project loads, with its report and page."""


def loaded(program, among, folder):
    """Return which modules a program leaves loaded."""
    said = f"\nimport sys; print(*sorted(set({among!r}) & set(sys.modules)), file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", program + said], check=True, capture_output=True, text=True, cwd=folder
    )
    return done.stderr.split()


def test_what_must_not_be_loaded_is_there():
    listed = (*SHOWING, *NUMERICAL, *SELDOM, *OF_OTHERS)
    assert [name for name in listed if name.startswith("photogram.") and find_spec(name) is None] == []


@pytest.mark.parametrize(
    "program", ["import photogram", COMMAND.format(arguments=["--help"])], ids=["import", "help"]
)
def test_import_and_help_load_no_numbers(program, tmp_path):
    assert loaded(program, (*HEAVY, *NUMERICAL, "photogram.giant", "photogram.formats"), tmp_path) == []


@pytest.mark.parametrize("command", ["adjust", "calibrate", "collection", "giant", "plan", "simulate"])
def test_help_of_commands_loads_no_arrays(command, tmp_path):
    assert loaded(COMMAND.format(arguments=[command, "--help"]), ("numpy", "pandas"), tmp_path) == []


@pytest.mark.parametrize("command", ["giant", "adjust"])
def test_examples_load_what_they_need(command, tmp_path):
    program = COMMAND.format(arguments=[command, "--example", "--no-html", "--quiet"])
    others = (
        "photogram.comparator",
        "photogram.stellar",
        "photogram.collection",
        "photogram.distributed.run",
    )
    assert loaded(program, (*HEAVY, *others, "photogram._photocore"), tmp_path) == ["photogram._photocore"]


def test_a_project_loads_what_is_of_it(tmp_path):
    program = COMMAND.format(arguments=["adjust", "--example", "--quiet"])
    program += "\nassert len([each for each in sys.modules if each.startswith('photogram.')]) <= " + str(MOST)
    assert loaded(program, OF_OTHERS, tmp_path) == []


def test_giant_does_not_wait_for_readers_of_other_formats(tmp_path):
    program = COMMAND.format(arguments=["giant", "--example", "--no-html", "--quiet"])
    among = ("photogram.formats.registry", "photogram.formats.colmap", "photogram.formats.crs")
    assert loaded(program, among, tmp_path) == ["photogram.formats.crs"]


def test_adjust_and_its_block_load_no_pictures(tmp_path):
    program = "from photogram import Block, adjust, simulate\nassert adjust(simulate().block).converged"
    assert loaded(program, (*HEAVY, *SHOWING, *SELDOM), tmp_path) == []


def test_a_name_of_a_package_loads_no_other(tmp_path):
    program = "from photogram.network import Level\nfrom photogram.statistics import critical_normal"
    among = ("photogram.network.block", "photogram.network.trajectories", "photogram.statistics.groups")
    assert loaded(program, among, tmp_path) == []


def test_a_command_loads_no_other(tmp_path):
    among = [f"photogram.cli.{name}" for name in ("adjust", "giant", "comparator", "stellar_camera", "plan")]
    assert loaded(COMMAND.format(arguments=["--help"]), among, tmp_path) == []
    assert loaded(COMMAND.format(arguments=["plan", "--help"]), among, tmp_path) == ["photogram.cli.plan"]


@pytest.mark.parametrize(
    ("program", "most"),
    [
        (COMMAND.format(arguments=["--help"]), 12),
        ("from photogram import Block, adjust, simulate\nassert adjust(simulate().block).converged", 95),
    ],
    ids=["help", "adjust"],
)
def test_small_work_loads_few_files(program, most, tmp_path):
    count = "\nimport sys; print(sum(each.startswith('photogram') for each in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", program + count], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    assert int(done.stdout.split()[-1]) <= most


MADE = """
import dataclasses
made, make = [], dataclasses.dataclass

def counted(cls=None, /, **options):
    if cls is None:
        return lambda cls: counted(cls, **options)
    made.append(cls.__module__)
    return make(cls, **options)

dataclasses.dataclass = counted
from photogram import adjust, simulate
assert adjust(simulate().block).converged
print(sum(each.startswith("photogram.") for each in made))
"""


def test_small_work_makes_few_dataclasses(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", MADE], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    assert 10 < int(done.stdout) <= 30
