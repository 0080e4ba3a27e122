"""The pages list every command, every option and every message of the program."""

import re
import tomllib
from html import unescape
from pathlib import Path

import generated
import pytest

from files.test_guards import COMMANDS
from photogram.cli.options import declarations
from photogram.formats.plain.schema import TABLES
from photogram.formats.plain.settings import KEYS, read_settings
from photogram.statistics.verdict import RULES

REPLACED = ["out", "as_published"]  # Every command has a text of its own
DOCS = Path(__file__).parents[2] / "docs"


def made(page):
    """Return the lines of a page as the site shows them."""
    return unescape(generated.on_page_markdown((DOCS / page).read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def commands():
    return made("command-line.md")


@pytest.fixture(scope="module")
def messages():
    return made("messages.md")


def test_the_page_has_every_command_with_its_usage(commands):
    usages = re.findall("^### (photogram .*)\n\n```text\n(.*?) \\[", commands, re.MULTILINE)
    names = {name for pair in usages for name in pair}
    assert {f"photogram {name}" for name in COMMANDS} <= names
    assert len(names) - len(usages) == 6  # Groups, whose first command needs no name


def test_the_page_has_every_option_with_its_meaning(commands):
    plain = re.sub("`|</?code>", "", commands)
    texts = {
        name: text.replace("`", "")
        for name, (panel, _, text) in declarations().items()
        if panel != "Commands"
    }
    assert [name for name, text in texts.items() if f"<td>{text}" not in plain] == REPLACED


def test_no_generated_line_is_broken(commands, messages):
    for text in (commands, messages):
        assert "generated:" not in text
        assert "<td></td>" not in text
    assert "│" not in commands
    assert len(re.findall("<tr><td><code>-", commands)) > 300


def test_the_page_has_every_message_once(messages):
    codes = re.findall("<td><code>([^<]*)</code></td></tr>", messages)
    assert sorted(codes) == sorted(generated.sentences())


def test_the_page_has_every_table_with_its_columns_once():
    page = made("formats/plain-tables.md")
    sections = dict(re.findall(r"^### `(\w+)`\n(.*?)(?=^##|\Z)", page, re.MULTILINE | re.DOTALL))
    assert list(sections) == list(TABLES)
    for name, table in TABLES.items():
        declared = [column for column in table.all_columns if column.content]
        for column in declared:
            assert sections[name].count(f"| {' | '.join(column.described())} |") == 1, (name, column)
        described = {each for column in declared for each in column.names} | {"trajectory", "level"}
        described |= {"strip", "frame"} if name == "photos" else {table.columns[0], "to"}
        texts = {*table.columns} - {*table.numbers}
        assert {*table.needed(()), *texts} <= described, name


def test_the_page_has_every_key_and_its_examples_are_valid(tmp_path):
    text = made("formats/plain.md").split("```toml\n")[1].split("```")[0]
    assert text.count(" = ") >= len(KEYS)
    written = re.sub(r"^(directory|certificate|text) = .*\n", "", text, flags=re.MULTILINE)
    (tmp_path / "project.toml").write_text(written)
    settings = read_settings(tmp_path / "project.toml")
    examples = tomllib.loads(text)
    assert {(key.section, key.name) for key in KEYS} == {
        (name, key) for name in examples for key in examples[name]
    }
    assert settings.statement["limit"] == tuple(examples["statement"]["length_limit"])


def test_verdicts_have_exit_codes_and_next_steps(messages):
    table, _ = messages.split("## Notes below a verdict")
    for rule in RULES:
        assert re.search(rf"<td>(0 or )?{rule.exit}</td><td>.*<code>verdict\.{rule.code}\b", table)
    assert "<code>--snoop</code> removes gross errors" in table


def test_fields_are_variables_and_both_readers_have_their_sentence():
    assert generated.cell("a {name:'} < `b`") == "a <var>name</var> &lt; <code>b</code>"
    sentence = generated.sentences()["advice.iterate"]
    python, command = sentence.split(generated.COMMAND)
    assert "max_iterations" in python
    assert "--iterations" in command
