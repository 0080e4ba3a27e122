"""Messages are codes with fields: no program reads a sentence."""

import ast
import json
import pickle
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import photogram
from photogram import InputError, Message, words
from photogram.cli import app
from photogram.comparator import Place
from photogram.io.places import at_place
from photogram.results.statement import texts
from photogram.statistics.verdict import RULES
from photogram.words import Phrase, Words, on_command_line, phrase, table_of

EXAMPLES = Path(photogram.__file__).parent / "examples"
FORMATS = ("number.", "date")
"""Entries of the files of words that are no sentences."""
COMMANDS = {
    "adjust": (0, "adjust", "project", "--json", "o.json"),
    "snoop": (4, "adjust", "project", "--snoop", "--sd", "images=0.1", "--json", "o.json"),
    "weights": (4, "adjust", "project", "--sd", "images=5", "--json", "o.json"),
    "strict": (4, "adjust", "project", "--sd", "images=0.2", "--strict", "--json", "o.json"),
    "German statement": (0, "statement", "survey", "--language", "de"),
    "check": (0, "check", "project", "--json", "o.json"),
    "board": (0, "calibrate", "board"),
    "comparator": (0, "comparator", "calibrate", "comparator/comparator-3.txt"),
}
"""Exit code and arguments."""


def test_forms_of_fields():
    own = Words("en", {
        "a.number": "{n:.3g}", "a.list": "{names:2}", "a.numbered": "{names:#}", "a.or": "{names:|}",
        "a.parts": "before{parts:+;}", "a.capital": "{name:^}",
        "a.named": "{n:the point {names}/{n} points in {files} {files:file/files}}",
        "a.counted": "{n} {n:point is/points are} missing",
        "a.listed": "the {names:point/points} {names}",
    })  # fmt: skip
    assert own("a.number", n=2 / 3) == "0.667"
    assert own("a.list", names=["A", "B", "C"]) == "A, B and 1 more"
    assert own("a.numbered", names=["A", "B"]) == "1) A, 2) B"
    assert own("a.or", names=["A", "B"]) == "A or B"
    assert own("a.parts", parts=[]) == "before"
    assert own("a.parts", parts=["x", Phrase("named.photo", {"photo": "3"})]) == "before; x; photo 3"
    assert own("a.capital", name=Phrase("named.photo", {"photo": "3"})) == "Photo 3"
    assert own("a.named", n=1, files=1, names=["A"]) == "the point A"
    assert own("a.named", n=2, files=3, names=["A", "B"]) == "2 points in 3 files"
    assert own("a.listed", names=["A"]) == "the point A"
    assert own("a.listed", names=["A", "B"]) == "the points A, B"
    assert own("a.counted", n=1) == "1 point is missing"
    assert own("a.counted", n=2) == "2 points are missing"
    assert Words("de")("part.factor", factor=1.5, low=1.25, high=2.0) == "1,5 (95 Prozent: 1,25 bis 2)"


def test_names_with_braces_are_no_fields():
    assert str(Phrase("named.control", {"point": "{n}"})) == "control point {n}"


def test_a_phrase_is_a_value():
    name = Phrase("named.image", {"point": "7", "photo": "3"})
    assert pickle.loads(pickle.dumps(name)) == name
    assert {name: 1}[Phrase("named.image", {"photo": "3", "point": "7"})] == 1
    assert name.document() == {
        "code": "named.image",
        "fields": {"point": "7", "photo": "3"},
        "text": "image of point 7 on photo 3",
    }


def test_a_remark_has_a_code():
    remark = Message.of("read.repeated", n=2, names=["A on 1", "A on 2"], option=Phrase("option.repeated"))
    assert (remark.code, remark.phrase.fields["n"]) == ("read.repeated", 2)
    assert str(remark) == str(remark.phrase)
    assert Message("a text of a file").code == ""


FROM_DATA = ("kind.", "measured.", "member.", "reason.", "unit.")
"""Families whose codes are composed of names that the core returns, or of members of JSON documents."""


def strings_of(path):
    """Return strings of a file, patterns of its strings with fields, and codes of its messages."""
    strings, patterns, codes = set(), [], set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            strings.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            texts = [part.value if isinstance(part, ast.Constant) else None for part in node.values]
            if any(text and re.match(r"[a-z][a-z_-]+\.", text) for text in texts):
                patterns.append("".join(".+" if text is None else re.escape(text) for text in texts))
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "").lower() == "phrase" and node.args:
            codes.add(getattr(node.args[0], "value", ""))
    return strings, patterns, {code for code in codes if isinstance(code, str) and code}


def test_every_code_has_a_sentence_and_every_sentence_is_printed():
    files = [strings_of(path) for path in Path(photogram.__file__).parent.rglob("*.py")]
    strings = set().union(*(each[0] for each in files))
    patterns = [re.compile(pattern) for each in files for pattern in each[1]]
    sentences = table_of("en").keys()
    assert set().union(*(each[2] for each in files)) <= sentences

    def is_printed(code):
        return code in strings or any(pattern.fullmatch(code) for pattern in patterns)

    unused = [code for code in sentences if not is_printed(code)]
    assert [code for code in unused if not code.startswith(FROM_DATA)] == []


def test_an_error_has_a_code_at_each_place():
    error = InputError(phrase("error.at", what="b", message=phrase("error.document")), file=Path("a.json"))
    assert (error.code, error.message, str(error)) == (
        "error.at",
        "b: the document",
        "a.json: b: the document",
    )
    again = pickle.loads(pickle.dumps(error))
    assert (again.phrase, again.file, str(again)) == (error.phrase, error.file, str(error))
    with pytest.raises(InputError) as raised, at_place(Place(Path("b.csv"), 3)):
        raise InputError(phrase("error.document"))
    assert (raised.value.code, raised.value.record) == ("error.document", 3)
    assert Words()("error.at", what=Phrase("error.document"), message="") == "the document: "


def test_a_quoted_field_is_escaped_and_short():
    assert (
        Words("en", {"a": "{value:'}"})("a", value="x\n" * 30)
        == repr(("x\n" * 30)[:40]) + "... (60 characters)"
    )


def test_advice_names_functions_in_python_and_options_on_the_command_line():
    advice = [code for code, sentence in table_of("en").items() if "{cli:" in sentence]
    assert len(advice) > 15
    fields = {"n": 3, "names": ["c"], "kind": "images", "sd": 0.3, "models": ["opencv8"]}
    for code in advice:
        with on_command_line():
            command = str(Phrase(code, fields))
        python = str(Phrase(code, fields))
        assert python != command
        assert "--" not in python


def test_rules_have_a_code_an_exit_code_and_advice():
    steps = {f"advice.{name}" for rule in RULES for name in rule.advice.split()}
    of_program = {"advice.take-out", "advice.lens", "advice.lens-in-common"}
    assert steps - of_program <= table_of("en").keys()
    assert {rule.exit for rule in RULES} == {0, 3, 4}
    assert all(f"verdict.{rule.code}" in table_of("en") for rule in RULES)


def run(folder, arguments):
    """Return exit code, names of files and JSON documents of a command."""
    folder.mkdir()
    done = CliRunner().invoke(app, arguments)
    documents = sorted(folder.rglob("*.json"))
    assert documents or done.exit_code == 0, done.output
    files = sorted(path.name for path in folder.rglob("*"))
    return done.exit_code, files, [without_sentences(json.loads(each.read_bytes())) for each in documents]


def without_sentences(member):
    """Return a document without times, and whether a member is a text in place of the text."""
    if isinstance(member, dict):
        return {name: without_sentences(each) for name, each in member.items() if name != "seconds"}
    if isinstance(member, list):
        return [without_sentences(each) for each in member]
    return isinstance(member, str) if isinstance(member, str) else member


@pytest.mark.parametrize("command", COMMANDS)
def test_sentences_decide_nothing(command, tmp_path, monkeypatch):
    """With codes in place of sentences exit codes, files, numbers and members of documents are equal."""
    code, name, *rest = COMMANDS[command]
    ends = []
    for number in range(2):
        if number:
            codes = {
                language: {
                    key: sentence if key.startswith(FORMATS) else key
                    for key, sentence in table_of(language).items()
                }
                for language in ("en", "de")
            }
            monkeypatch.setattr(words, "table_of", codes.__getitem__)
            monkeypatch.setattr(texts, "table_of", codes.__getitem__)
            words.words_of.cache_clear()
        folder = tmp_path / str(number)
        own = [str(EXAMPLES / word) if (EXAMPLES / word).exists() else word for word in rest]
        own = [str(folder / word) if word == "o.json" else word for word in own]
        try:
            ends.append(run(folder, [name, *own, "--out", str(folder / "o")]))
        finally:
            words.words_of.cache_clear()
    assert ends[0] == ends[1]
    assert ends[0][0] == code
    assert ends[0][1]
