"""Imports among the files of a crate.

`python tests/rust_files.py` lists imports that contradict the order of the files of the engine.
"""

import re
import sys
from pathlib import Path

Module = tuple[str, ...]
USE = re.compile(r"(?:^|\n)\s*(?:pub(?:\([^)]*\))?\s+)?use\s+([^;]+);")
CRATE = Path(__file__).parents[1] / "crates" / "photocore" / "src"
PATH = re.compile(r"\b(?:super|crate)(?:::\w+)+")


def imports(crate: Path) -> dict[Module, set[Module]]:
    """Return the files that each file of a crate names, in `use` and in paths, without those of its tests.

    A name that a folder's `mod.rs` hands on counts for the file that it is from; so `mod.rs` names a file
    only where its own code uses what it hands on.
    """
    files = {_module(path, crate): path for path in crate.rglob("*.rs")}
    texts = {module: _code(path) for module, path in files.items()}
    handed: dict[Module, dict[str, Module]] = {module: {} for module in files}
    used: dict[Module, list[Module]] = {}
    for module, text in texts.items():
        paths = [tuple(path.split("::")) for tree in USE.findall(text) for path in _flat(tree)]
        body = USE.sub("", text)
        if files[module].name in ("mod.rs", "lib.rs"):
            handed[module] = {path[-1]: path for path in paths}
            paths = [path for path in paths if re.search(rf"\b{re.escape(path[-1])}\b", body)]
        used[module] = paths + [tuple(path.split("::")) for path in PATH.findall(body)]

    def file_of(module: Module, path: Module) -> Module | None:
        at, rest = module, list(path)
        if rest[0] == "crate":
            at, rest = (), rest[1:]
        elif rest[0] == "self":
            rest = rest[1:]
        elif rest[0] != "super" and (*at, rest[0]) not in files:
            return None
        while rest and rest[0] == "super":
            at, rest = at[:-1], rest[1:]
        while rest and (*at, rest[0]) in files:
            at, rest = (*at, rest[0]), rest[1:]
        onward = handed[at].get(rest[0]) if rest else None
        return (onward and onward != path and file_of(at, onward)) or at

    found = {module: {file_of(module, path) for path in paths} for module, paths in used.items()}
    return {
        module: {each for each in others if each is not None} - {module} for module, others in found.items()
    }


def _module(path: Path, crate: Path) -> Module:
    parts = path.relative_to(crate).with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib") else parts


def _code(path: Path) -> str:
    """Return the text of a file without comments, texts, visibilities and tests."""
    if path.name in ("tests.rs", "golden.rs"):
        return ""
    text = re.split(r"#\[cfg\(test\)\]\s*mod \w+ \{", path.read_text(encoding="utf-8"))[0]
    return re.sub(r'//[^\n]*|\(in [\w:]+\)|"(?:[^"\\]|\\.)*"', "", text)


def _flat(tree: str) -> list[str]:
    """Return the paths of a tree of `use`."""
    tree = re.sub(r"\s+", "", re.sub(r"\s+as\s+\w+", "", tree))
    if "{" not in tree:
        return [tree]
    head, inner = tree.split("{", 1)
    parts, depth = [""], 0
    for letter in inner.rsplit("}", 1)[0]:
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [path for part in parts if part for path in _flat(head + part)]


def order(folder: Path) -> list[str]:
    """Return the files and folders of the table in a folder's `mod.rs`, from top to bottom."""
    rows = re.findall(r"^//! \|[^|`]+\|([^|]+)\|$", (folder / "mod.rs").read_text(encoding="utf-8"), re.M)
    return [name for row in rows for name in re.findall(r"`(\w+)`", row)]


def upward(name: str, crate: Path = CRATE) -> list[str]:
    """Return the imports of a folder of the crate that contradict the order of its table."""
    place = {module: number for number, module in enumerate(order(crate / name))}
    units = {path.stem for path in (crate / name).iterdir()} - {"mod"}
    wrong = [f"{name}/{unit} must be once in the table of {name}/mod.rs" for unit in units ^ set(place)]
    inside = [(file, other) for file, others in imports(crate).items() for other in others]
    for file, other in inside:
        if file[:1] == other[:1] == (name,) and file[1:2] != other[1:2] and len(file) > 1:
            below = place.get(other[1], -1) if len(other) > 1 else -1
            if place.get(file[1], -1) >= below:
                wrong.append(f"{'/'.join(file)} must not import {'/'.join(other)}")
    return sorted(wrong)


if __name__ == "__main__":
    sys.exit("\n".join(upward("network")) or None)
