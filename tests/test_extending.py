"""The worked extensions: quoted as they stand in the tree, and found in one file and one line each."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extending.md").read_text()
CAMERAS = Path("crates/photocore/src/geometry/camera")
KINDS = Path("crates/photocore/src/network/observations")
BASES = Path("crates/photocore/src/geometry/trajectory")
FORMATS = Path("python/photogram/collection/formats")
PACKAGE = [
    path
    for path in (ROOT / "python" / "photogram").rglob("*.py*")
    if path.suffix in (".py", ".pyi") and ROOT / "python" / "photogram" / "formats" not in path.parents
]
"""Without the files of other programs, which say what lenses and formats are called."""
CRATE = [path for path in (ROOT / "crates" / "photocore" / "src").rglob("*.rs") if path.name != "golden.rs"]
BINDING = [*(ROOT / "crates" / "photogram-py" / "src").rglob("*.rs")]
EXTENSIONS = {
    "lens": (
        CAMERAS / "equirectangular.rs",
        CAMERAS / "mod.rs",
        "equirectangular::Equirectangular;",
        r"\bEquirectangular\b|\"equirectangular\"",
        [*CRATE, *BINDING, *PACKAGE],
    ),
    "format": (FORMATS / "bundler.py", FORMATS / "__init__.py", '"bundler",', r"bundler", PACKAGE),
    # What Python can say of an observation is another matter.
    "observation": (
        KINDS / "equal_height.rs",
        KINDS / "mod.rs",
        'equal_height { EqualHeight = "equal height", sd; }',
        r"EqualHeight|equal.height",
        [*CRATE, *BINDING],
    ),
    # What Python can say of a basis is another matter, too; five points have polynomials of another sort.
    "motion": (
        BASES / "polynomial.rs",
        BASES / "mod.rs",
        "polynomial::Polynomial;",
        r"\bPolynomial\b|\"polynomial\"",
        [
            *(path for path in CRATE if path.name not in ("tests.rs", "on_trajectory.rs", "five_points.rs")),
            *BINDING,
        ],
    ),
}
"""Its file, the file that registers it, the line there, its name, and the sources that do not know it."""


def code(path):
    """Return the lines of a file, those of Rust without their comments."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return [re.sub(r"//.*", "", line) for line in lines] if path.suffix == ".rs" else lines


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_the_page_quotes_the_file_and_the_line(extension):
    own, registry, line, *_ = EXTENSIONS[extension]
    language = {".rs": "rust", ".py": "python"}[own.suffix]
    assert f"<!-- quote: {own} -->\n```{language}\n{(ROOT / own).read_text()}```\n<!-- end -->" in PAGE
    said = re.search(
        rf"<!-- quote: {registry} \| .*? -->\n```{language}\n(.*?)```\n<!-- end -->", PAGE, re.DOTALL
    )
    assert said is not None
    assert line in [each.strip() for each in said[1].splitlines()]


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_an_extension_is_one_file_and_one_line(extension):
    own, registry, line, called, sources = EXTENSIONS[extension]
    places = [
        (path.relative_to(ROOT), text.strip())
        for path in sources
        for text in code(path)
        if re.search(called, text)
    ]
    elsewhere = [place for place in places if place[0] != own]
    assert len(elsewhere) < len(places)
    assert elsewhere == [(registry, line)]


def test_the_page_is_what_its_sources_make_of_it():
    command = [sys.executable, ROOT / "docs" / "regenerate.py", "--check", "extending.md"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_lines_of_sources_are_found_whatever_their_indentation(tmp_path):
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        from regenerate import quoted
    finally:
        sys.path.pop(0)
    path = tmp_path / "source.py"
    path.write_text("def f():\n    names = (\n        1,\n    )\n    return names\n")
    assert quoted(path, "names = (") == ["names = (", "    1,", ")"]
    assert quoted(path, None) == path.read_text().splitlines()
