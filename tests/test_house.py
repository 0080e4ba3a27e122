"""The house of the Python package: arrows point down, and files import each other in no circle."""

import ast
import re
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import photogram
from rust_files import CRATE, order, upward
from rust_files import imports as rust_imports

SOURCES = Path(photogram.__file__).parent
PROGRAMS = (
    "giant",
    "collection",
    "perspective_center",
    "absolute_orientation",
    "comparator",
    "stellar",
    "targets",
    "film",
)
FLOORS = (
    ("__main__",),
    ("cli",),
    ("formats",),
    PROGRAMS,
    ("planning", "diagnosis"),
    ("distributed",),
    ("adjustment",),
    ("results",),
    ("network",),
    ("plots", "history"),
    ("show",),
    ("io",),
    ("statistics",),
    ("arguments",),
    ("memory",),
    ("errors",),
    ("messages", "extras"),
    ("words",),
    ("lazy_dataclasses", "summaries"),
)
"""From the top down, as CONTRIBUTING has them: a file knows its own folder and floors below."""


def modules():
    """Return the files of the package by the names of their modules, without what hands names on."""
    found = {}
    for path in sorted(SOURCES.rglob("*.py")):
        parts = path.relative_to(SOURCES.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    del found["photogram"]
    return found


COMPOSED = {
    *("document", "statement", "reliability_summary", "_findings", "_files", "_members", "_table", "_terms"),
    *("_plot_data", "_observables", "_scaled", "_adjust", "_adjust_again", "_snoop", "_check"),
}
"""Methods of results whose definitions are in the files above that read the results."""


def nodes(node):
    """Return the nodes of a file without the methods that lead to the files above."""
    yield node
    for part in ast.iter_child_nodes(node):
        if not (isinstance(part, ast.FunctionDef) and part.name in COMPOSED):
            yield from nodes(part)


@cache
def imports():
    """Return what each file imports of the package: within functions, by a string, for types only, too."""
    found = modules()
    graph = {}
    for name, path in found.items():
        arrows = set()
        for node in nodes(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                inside = {f"{node.module}.{each.name}" for each in node.names} & set(found)
                arrows |= inside or ({node.module} & set(found))
            elif isinstance(node, ast.Import):
                arrows |= {each.name for each in node.names} & set(found)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                arrows |= {node.value} & set(found)
        graph[name] = arrows - {name}
    return graph


def test_files_import_each_other_in_no_circle():
    faces = {name for name, path in modules().items() if path.name == "__init__.py"}
    graph = {name: arrows - faces for name, arrows in imports().items() if name not in faces}
    assert len(graph) > 200
    assert list(TopologicalSorter(graph).static_order())


def test_arrows_point_down():
    floor = {folder: number for number, folders in enumerate(FLOORS) for folder in folders}
    seen = set()
    for name, arrows in imports().items():
        for other in arrows:
            own, foreign = name.split(".")[1], other.split(".")[1]
            seen |= {own, foreign}
            if own != foreign:
                assert floor[own] < floor[foreign], f"{name} imports {other}"
    assert seen == set(floor)


KNOWS = {
    "network": {"adjustment", "normals", "geometry"},
    "adjustment": {"normals"},
    "normals": set(),
    "geometry": set(),
}
"""What a folder of the crate may know of the others."""


def test_floors_of_the_crate():
    """Beside its files a folder names those below it only, in `use` and in paths."""
    arrows = set()
    for folder, below in KNOWS.items():
        files = [*(CRATE / folder).rglob("*.rs")]
        assert len(files) > 5
        for path in files:
            named = set(re.findall(r"\bcrate::(?:\{?\s*)(\w+)", path.read_text(encoding="utf-8"))) & set(
                KNOWS
            )
            assert named <= below | {folder}, f"{path.relative_to(CRATE)} knows {named - below - {folder}}"
            arrows |= {(folder, other) for other in named - {folder}}
    assert arrows >= {("network", "adjustment"), ("adjustment", "normals")}


def _inside(folder):
    """Return what the files of a folder of the crate name of each other."""
    graph = {file: arrows for file, arrows in rust_imports(CRATE).items() if file[:1] == (folder,)}
    return {file: {other for other in arrows if other in graph} for file, arrows in graph.items()}


@pytest.mark.parametrize("folder", ["normals", "adjustment", "network", "geometry"])
def test_files_of_the_engine_name_each_other_in_no_circle(folder):
    inside = _inside(folder)
    assert len(inside) > 20
    assert list(TopologicalSorter(inside).static_order())


def test_types_from_a_network_to_covariances_are_few_and_exist():
    """The table of the main types, in the documentation of the crate."""
    table = re.findall(
        r"^//! \|[^|]+\| `(\w+)` \|([^|]+)\|$", (CRATE / "lib.rs").read_text(encoding="utf-8"), re.M
    )
    types = [(layer, name) for layer, names in table for name in re.findall(r"`(\w+)`", names)]
    assert 20 < len(types) == len(set(types)) <= 30
    text = {
        layer: "".join(path.read_text(encoding="utf-8") for path in (CRATE / layer).rglob("*.rs"))
        for layer in KNOWS
    }
    for layer, name in types:
        assert re.search(rf"\b(struct|enum|trait|type) {name}\b", text[layer]), f"{layer} has no {name}"


def test_files_of_a_network_import_in_the_order_of_their_table():
    table = order(CRATE / "network")
    assert len(table) == len(set(table)) > 30
    assert table.index("adjust") < table.index("problem") < table.index("input")
    assert upward("network") == []


def test_an_import_against_the_order_is_listed(tmp_path):
    folder = tmp_path / "network"
    folder.mkdir()
    (folder / "mod.rs").write_text(
        "//! | part | `upper`, `lower` |\nmod lower;\nmod upper;\n", encoding="utf-8"
    )
    (folder / "upper.rs").write_text("use super::lower::A;\n", encoding="utf-8")
    (folder / "lower.rs").write_text("use super::upper::B;\n", encoding="utf-8")
    (folder / "other.rs").write_text("", encoding="utf-8")
    assert upward("network", tmp_path) == [
        "network/lower must not import network/upper",
        "network/other must be once in the table of network/mod.rs",
    ]
