"""What pages, examples and tests import: public names, but where the package itself is the subject."""

import ast
import inspect
import re
from functools import cached_property
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from types import FunctionType

import pytest

import public_api

ROOT = Path(__file__).parents[1]
PAGES = sorted({ROOT / "README.md", *(ROOT / "docs").rglob("*.md")} - {ROOT / "docs" / "extending.md"})
EXAMPLES = sorted(path for path in (ROOT / "examples").glob("*.py") if not path.name.startswith("make_"))
BLOCK = re.compile(r"^```python.*?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NAME = re.compile(r"(?<!::: )\bphotogram(?:\.\w+)+")
COMMENT = re.compile(r"<!--.*?-->")


def is_public(name):
    home = max((each for each in public_api.packages() if f"{name}.".startswith(f"{each}.")), key=len)
    return name == home or name.removeprefix(f"{home}.").split(".")[0] in import_module(home).__all__


def is_there(name):
    try:
        resolve_name(name)
    except (AttributeError, ImportError):
        return False
    return True


def imported(program):
    """Return what a program imports of the package."""
    for node in ast.walk(ast.parse(program)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "photogram":
            yield from (f"{node.module}.{each.name}" for each in node.names)
        elif isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name.partition(".")[0] == "photogram")


def test_internal_names_are_told_from_public_ones():
    assert is_public("photogram.network.Attitude")
    assert is_public("photogram.formats.csm")
    assert is_public("photogram.Block.replace")
    assert not is_public("photogram.network.observations.Attitude")
    assert not is_public("photogram.network.Block")
    assert is_there("photogram.network.observations.Attitude")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples_import_public_names(path):
    assert [name for name in imported(path.read_text(encoding="utf-8")) if not is_public(name)] == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_pages_say_public_names(path):
    text = path.read_text(encoding="utf-8")
    names = {name for block in BLOCK.findall(text) for name in imported(block)}
    names |= {name for name in NAME.findall(COMMENT.sub("", text)) if is_there(name)}
    assert sorted(name for name in names if not is_public(name)) == []


def test_tests_import_public_names_where_there_are_any():
    homes = [import_module(package) for package in public_api.packages()]
    values = [getattr(home, name) for home in homes for name in home.__all__]
    public = {inspect.unwrap(value) for value in values if callable(value)}
    found = []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        internal = (name for name in imported(path.read_text(encoding="utf-8")) if not is_public(name))
        values = {name: resolve_name(name) for name in internal}
        found += [
            name for name, value in values.items() if callable(value) and inspect.unwrap(value) in public
        ]
    assert found == []


def described(kind):
    """Return what of a public class needs a docstring: itself, its methods and properties."""
    yield kind.__qualname__, kind
    for name in {*dir(kind)} - {*getattr(kind, "__dataclass_fields__", ())}:
        home = next(each for each in kind.__mro__ if name in vars(each) or each is object)
        value = inspect.getattr_static(kind, name, None)
        own = home.__module__.startswith("photogram.") and not name.startswith("_")
        if own and isinstance(value, property | cached_property | classmethod | staticmethod | FunctionType):
            yield f"{kind.__qualname__}.{name}", value


def test_public_names_have_docstrings():
    found = {}
    for home in map(import_module, public_api.packages()):
        for value in (getattr(home, name) for name in home.__all__):
            if inspect.isclass(value):
                found |= described(value)
            elif inspect.isfunction(value):
                found[value.__qualname__] = value
    assert len(found) > 1000
    assert [name for name, value in found.items() if not (value.__doc__ or "").strip()] == []


def test_keywords_of_functions_are_the_fields_of_their_options():
    for path, text in public_api.keywords():
        assert path.read_text(encoding="utf-8") == text, "run `python tests/public_api.py`"
