"""Write parts of pages from the program while mkdocs builds them.

Lines of pages that are replaced:

* `<!-- generated: columns TABLE [FIRST LAST] -->`: all columns of a table of the plain project, or some;
* `<!-- generated: headings KIND ... -->`: the words of some kinds of headings, by their meaning;
* `<!-- generated: jigsaw [otherwise] -->`: the settings of jigsaw, or those that photogram replaces;
* `<!-- generated: keys -->`: the keys of `project.toml` by section;
* `<!-- generated: commands -->`: all commands with their options;
* `<!-- generated: verdicts -->`: all verdicts with their exit codes and next steps;
* `<!-- generated: messages FAMILY ... -->`: all messages of some families, the first words of their codes;
* `<!-- generated: messages -->`: those of all families that the page has not named.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator
from html import escape
from typing import Any

MARK = re.compile(r"^<!-- generated: (\w+) ?(.*?) ?-->$", re.MULTILINE)
WIDTH = "500"  # Columns of the help, so that no line is wrapped
CODE = 110  # Characters of a line of code on a page
PANEL = re.compile(r"^╭─ (.*?) ─+╮\n(.*?)^╰", re.DOTALL | re.MULTILINE)
FIELD = re.compile(r"\{(\w+)[^}]*\}")
REMEDY = re.compile(
    r"(\(<var>option</var>[^)]*\)|(?<=[;.:,] )(?:(?:so|then|and) )?(?:"
    "add|adjust|assign|calibrate|change|check|choose|close|combine|compare|convert|copy|correct|count|create|define"
    "|describe|divide|enter|estimate|exchange|export|extend|fill|find|fix|fly|free|give|group|ignore|improve|increase"
    "|install|keep|leave|list|look|make|measure|move|name|observe|omit|put|read|reduce|remove|rename|repeat|replace"
    "|restore|resume|reverse|rotate|run|save|see|select|separate|set|shorten|simulate|solve|sort|specify|split|start|store"
    r"|transform|use|wait|widen|write)\b.*?)(?=<br>|$)",
    re.IGNORECASE,
)
"""The part of a message that begins with an imperative, or an option in parentheses."""
APPENDED = re.compile(
    r"(?=\{\w+:\+[;&]?\})"
)  # Before fields that begin with a semicolon if they are not empty
COMMAND = "\x1f"  # Between the sentences of Python and of the command line
# Usual case of next steps that the program decides
DECIDED = {"take-out": "snoop", "lens": "calibrate", "lens-in-common": "calibrate"}


def cell(text: str) -> str:
    """Return text for a cell of an HTML table: backquotes are code, the fields of messages are variables."""
    text = FIELD.sub(
        lambda field: f"<var>{field[1].replace('_', ' ')}</var>",
        escape(APPENDED.sub("; ", text), quote=False),
    )
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    return text.replace(COMMAND, "<br><em>On the command line:</em> ")


def code(text: str) -> str:
    """Return text as code."""
    return f"<code>{escape(text, quote=False)}</code>"


def table(heads: Iterable[str], rows: Iterable[tuple[str, ...]]) -> str:
    """Return an HTML table, which needs no escapes of Markdown; a row of one cell is a heading."""
    head = "".join(f"<th>{each}</th>" for each in heads)
    body = "\n".join(
        f'<tr><th colspan="2">{row[0]}</th></tr>'
        if len(row) == 1
        else f"<tr>{''.join(f'<td>{each}</td>' for each in row)}</tr>"
        for row in rows
    )
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>\n"


def helps() -> Iterator[tuple[str, str]]:
    """Yield each command with its help text."""
    from typer.testing import CliRunner

    from photogram.cli import app
    from photogram.cli.commands import COMMANDS

    for name, home in COMMANDS.items():
        _, *others = [home] if isinstance(home, str) else home
        for words in [[name], *([name, part] for part in others)]:
            environment = {"COLUMNS": WIDTH, "TERMINAL_WIDTH": WIDTH, "NO_COLOR": "1"}
            shown = CliRunner().invoke(app, [*words, "--help"], env=environment).output
            yield " ".join(words), "\n".join(line.rstrip() for line in shown.splitlines())


def options_of(help_text: str) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a table of options: panels, and options with their meaning."""
    for panel, lines in PANEL.findall(help_text):
        yield (panel,)
        for line in lines.splitlines():
            *words, meaning = re.split(r"\s{2,}", line.strip("│").strip().removeprefix("*").strip())
            names = [word for word in words if word.startswith("-")] or words[:1]
            kinds = [word for word in words if word not in names and word != "<path>"]
            option = ", ".join(code(name) for name in names)
            yield " ".join([option, *(escape(kind).replace("|", "|<wbr>") for kind in kinds)]), cell(meaning)


def columns(words: str) -> str:
    """Return a Markdown table of the columns of a table of the plain project, from one to another one."""
    from photogram.formats.plain.schema import TABLES

    name, *ends = words.split()
    declared = [each for each in TABLES[name].all_columns if each.content]
    rows = [row for row, each in enumerate(declared) if set(ends) & set(each.names)]
    first, last = (rows[0], rows[-1]) if ends else (0, len(declared))
    lines = [f"| {' | '.join(each.described())} |" for each in declared[first : last + 1]]
    return "\n".join(["| column | content | default |", "| --- | --- | --- |", *lines])


def headings(kinds: str) -> str:
    """Return a Markdown table of the words of some kinds of headings, by their meaning."""
    from photogram.formats.column_words import WORDS

    meanings: dict[str, list[str]] = {}
    for kind in kinds.split():
        for word, meaning in WORDS[kind].items():
            meanings.setdefault(meaning, []).append(f"`{word}`")
    lines = [f"| `{name}` | {', '.join(words)} |" for name, words in meanings.items() if name]
    return "\n".join(["| meaning | words |", "| --- | --- |", *lines])


def jigsaw(kind: str) -> str:
    """Return a Markdown table of the settings of jigsaw, or of those that photogram replaces."""
    from photogram.formats.isis.solving import DECLARED

    otherwise = kind == "otherwise"
    heads = ("name", "in photogram") if otherwise else ("name", "values", "default")
    lines = ["".join(f"| {each} " for each in heads) + "|", "| --- " * len(heads) + "|"]
    for own in (each for each in DECLARED if (each.kind == "otherwise") is otherwise):
        names = ", ".join(f"`{name}`" for name in own.names)
        lines.append(f"| {names} | {own.content} |{'' if otherwise else f' {own.default} |'}")
    return "\n".join(lines)


def keys(_: str) -> str:
    """Return the declared keys of the settings of a plain project as TOML."""
    from photogram.formats.plain.settings import KEYS

    sections: dict[str, list[str]] = {}
    for key in KEYS:
        sections.setdefault(key.section, []).extend(wrapped(key.described()))
    lines = [line for name, own in sections.items() for line in (f"[{name}]", *own)]
    return "\n".join(["```toml", *lines, "```"])


def wrapped(line: str) -> list[str]:
    """Return a line of TOML with its comment in several lines if it is wider than a page."""
    start, mark, comment = line.partition("# ")
    parts = textwrap.wrap(comment, CODE - len(start)) if len(line) > CODE else [comment]
    return [start + mark + parts[0], *(" " * len(start) + mark + part for part in parts[1:])]


def commands(_: str) -> str:
    """Return the commands with their options as Markdown."""
    parts = []
    for name, text in helps():
        before, *_ = text.split("╭─", 1)
        usage, *paragraphs = [" ".join(each.split()) for each in before.strip().split("\n\n")]
        parts += [f"### photogram {name}", f"```text\n{usage.removeprefix('Usage: ')}\n```"]
        parts += [cell(each) for each in paragraphs]
        parts.append(table(("Option", "Meaning"), options_of(text)))
    return "\n\n".join(parts)


def sentences() -> dict[str, str]:
    """Return the sentence of each message by code, for counts of several, and that of the command line."""
    from photogram.words import CHOICE, table_of

    def chosen(text: str, reader: int) -> str:
        while CHOICE.search(text):
            text = CHOICE.sub(lambda found: found[reader if found[1] == "cli" else 3], text)
        return text

    return {
        name: COMMAND.join(dict.fromkeys(chosen(text, reader) for reader in (2, 3)))
        for name, text in table_of("en").items()
    }


def verdicts(_: str) -> str:
    """Return a table of all verdicts."""
    from photogram.statistics.verdict import RULES

    texts = sentences()
    steps: dict[str, list[str]] = {}
    exits: dict[str, set[int]] = {}
    for rule in RULES:
        steps.setdefault(rule.code, []).extend(
            f"advice.{DECIDED.get(name, name)}" for name in rule.advice.split()
        )
        exits.setdefault(rule.code, set()).update({0, rule.exit} if rule.warning else {rule.exit})
    rows = []
    for name in [name for name in texts if name.startswith("verdict.")]:
        rule_code = name.split(".")[1]
        advice = "".join(
            f"<li>{cell(texts[step])}</li>" for step in dict.fromkeys(steps[rule_code] or ["advice.nothing"])
        )
        end = " or ".join(map(str, sorted(exits[rule_code])))
        rows.append((cell(texts[name]), end, f"<ul>{advice}</ul>", code(name)))
    return table(("Message", "Exit code", "Next steps", "Code"), rows)


def messages(families: str) -> str:
    """Return a table of the messages of some families."""
    names = families.split()
    rows = [
        (REMEDY.sub(r"<strong>\1</strong>", cell(text)), code(name))
        for name, text in sentences().items()
        if name.partition(".")[0] in names
    ]
    return table(("Message, with the remedy in bold", "Code"), rows)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put generated parts into a page."""
    named = " ".join(["verdict", *(words for _, words in MARK.findall(markdown))]).split()
    rest = " ".join(dict.fromkeys(name.partition(".")[0] for name in sentences()).keys() - set(named))
    parts = {
        "columns": columns,
        "commands": commands,
        "headings": headings,
        "jigsaw": jigsaw,
        "keys": keys,
        "messages": messages,
        "verdicts": verdicts,
    }
    return MARK.sub(lambda mark: parts[mark[1]](mark[2] or rest), markdown)
