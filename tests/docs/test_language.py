"""Text for readers is plain English: few patterns hide the subject of sentences, old terms are gone.

The patterns are an indicator: a sentence without them that must be read twice is still wrong.
"""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PATTERNS = {
    "what": r"\bwhat\b",
    "picture, place, turn, head": r"\b(pictures?|places?|turns?|heads?)\b",
    "where for if": r"\bwhere (it|they|there|that|nothing|no|none|a|the|one)\b|, where\b(?! [X$\\])",
    "say, tell": r"\b(says?|said|tells?|told)\b",
    "take with a particle": r"\b(takes?|taken|taking|took) (up|off|in|out|away|over|for|part|the place)\b",
    "is no, has none": r"\b(is|are|has|have) (no|none)\b",
    "stand, lie, held, kept": r"\b(stands?|stood|lies?|lay|held|unheld|kept|keeps?)\b",
    "that of, those of": r"\b(that|those) of\b",
    "alike, apart, aside, anew, whoever": r"\b(alike|apart|aside|anew|nobody|somebody|whoever)\b"
    r"|\bonce more\b|\bat the most\b|\bso many\b",
    "go, come": r"\b(goes|gone|going|went|comes?|came|coming)\b",
    "beside, in the place of, but for": r"\bbeside\b|\bin (the )?place of\b|\bbut for\b",
    "sentence that begins with Of, That, Those": r"(?m-i:(?:(?<=[.;:] )|^)(?:Of|That|Those) [a-z])",
}
RULES = {name: re.compile(rule, re.IGNORECASE) for name, rule in PATTERNS.items()}
GIANT_TERMS = "stand, lie, held, kept"  # "held" and "unheld" are terms of GIANT
CEILINGS = {"pages": 4.0, "help": 4.0, "errors": 4.0, "words": 4.0, "docstrings": 5.0, "Rust": 4.0}
"""Patterns per 1,000 words. They may only fall."""
TERMS = {
    "at fault": "invalid",
    "beside images": "additional observations",
    "error that is found": "minimal detectable bias",
    "first values": "initial values",
    "foretells?|foretold": "predicts, predicted",
    "good to [0-9]": "accurate to",
    "guilty": "most probable gross error",
    "harms? the whole": "ill-conditioned point",
    "largest T may be": "critical value",
    "lens of knots": "B-spline lens model",
    "mended": "corrected",
    "own point effect": "influence on its own point",
    "set aside": "rejected, excluded",
    "start values": "initial values",
    "(taken?|takes) out": "removed, removes",
    "the house": "package layers",
    "unheld": "free",
    "what lacks": "missing data",
}
"""Terms that must not return in pages, help, errors and words, with their replacement, except for GIANT."""


def texts(value):
    """Yield the sentences of a file of words."""
    if isinstance(value, str):
        yield value
    for part in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from texts(part)


def python_texts(path):
    """Yield the texts of a module: corpus and text."""
    kind = "help" if "cli" in path.parts else "docstrings"
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield kind, node.value.value
        elif isinstance(node, ast.Call):
            yield from (("help", key.value.value) for key in node.keywords
                        if key.arg == "help" and isinstance(key.value, ast.Constant))  # fmt: skip
        elif isinstance(node, ast.Raise) and node.exc is not None:
            parts = [part.value for part in ast.walk(node.exc) if isinstance(part, ast.Constant)]
            yield from (("errors", part) for part in parts if isinstance(part, str) and " " in part)


@cache
def corpora():
    """Return the texts of each corpus with their files."""
    found = {name: [] for name in CEILINGS}
    documents = [*(ROOT / "docs").rglob("*.md"), *(ROOT / "crates").rglob("*.md"), *ROOT.glob("[CR]*.md")]
    for path in documents:
        if path.name != "CHANGELOG.md":
            text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
            found["pages"] += [(path, line) for line in re.sub(r"`[^`\n]*`", "X", text).splitlines()]
    package = ROOT / "python" / "photogram"
    for path in [*package.rglob("*.py"), *package.rglob("*.pyi")]:
        for corpus, text in python_texts(path):
            if isinstance(text, str):
                found[corpus].append((path, text))
    for path in package.rglob("*.toml"):
        if "examples" not in path.parts and "de" not in path.name.split("."):
            found["words"] += [
                (path, text) for text in texts(tomllib.loads(path.read_text(encoding="utf-8")))
            ]
    for path in (ROOT / "crates").rglob("*.rs"):
        comments = re.findall(r"^\s*//[/!]? ?(.*)", path.read_text(encoding="utf-8"), re.MULTILINE)
        found["Rust"] += [(path, re.sub(r"`[^`]*`", "X", comment)) for comment in comments]
    return found


def hits(corpus):
    """Return the pattern, the file and the line of each hit in a corpus."""
    return [
        (name, path.relative_to(ROOT).as_posix(), text[max(0, match.start() - 40) : match.end() + 40])
        for path, text in corpora()[corpus]
        for name, rule in RULES.items()
        if not (name == GIANT_TERMS and "giant" in path.as_posix())
        for match in rule.finditer(text)
    ]


def rate(corpus):
    """Return the patterns per 1,000 words of a corpus."""
    words = sum(len(re.findall(r"[A-Za-z']+", text)) for _, text in corpora()[corpus])
    return 1000 * len(hits(corpus)) / words


@pytest.mark.parametrize("corpus", CEILINGS)
def test_patterns_that_hide_the_subject_are_rare(corpus):
    assert rate(corpus) <= CEILINGS[corpus], "\n".join(map(str, hits(corpus)[-20:]))


@pytest.mark.parametrize("term", TERMS)
def test_old_terms_do_not_return(term):
    found = [
        (path.relative_to(ROOT).as_posix(), text[:120])
        for corpus in ("pages", "help", "errors", "words")
        for path, text in corpora()[corpus]
        if not re.search("giant", path.as_posix()) and re.search(rf"\b({term})\b", text, re.IGNORECASE)
    ]
    assert found == [], f"write {TERMS[term]!r}"
