"""Every end of the command line is an exit code: odd paths and numbers, full and closed streams, signals."""

import ast
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from test_guards import COMMANDS, RUNS, outputs, place, words  # noqa: F401  # the fixture

import photogram
from fuzz.kills import Trials, kinds
from photogram.cli.options import Writes

SOURCES = Path(photogram.__file__).parent
COMMAND = [sys.executable, "-m", "photogram.cli"]
DOCS = Path(__file__).parents[2] / "docs" / "command-line.md"
ODD = {
    "loop": "Too many levels of symbolic links",
    "x" * 300: "File name too long",
}
INPUTS = [
    (name, number)
    for name, (line, sources) in RUNS.items()
    for number, word in enumerate(line)
    if word in sources or word in ("galveston", "second")
]


@pytest.mark.parametrize(("name", "number"), INPUTS)
def test_odd_names_of_inputs(run, place, name, number):  # noqa: F811
    (place / "loop").symlink_to("loop")
    for word, said in ODD.items():
        line = list(RUNS[name][0])
        line[number] = word
        for option in outputs(name)[:1]:
            line = [*line, *words(name, **{option: "new"})[len(line) :]]
        result = run(*line)
        assert result.exit_code == 1, (word, result.output)
        assert isinstance(result.exception, SystemExit)
        assert said in result.stderr
        assert not (place / "new").exists()


@pytest.mark.parametrize("name", RUNS)
def test_odd_names_of_outputs(run, place, name):  # noqa: F811
    (place / "loop").symlink_to("loop")
    for option in [*outputs(name), *outputs(name, Writes.DIRECTORY)]:
        for word, said in ODD.items():
            result = run(*words(name, **{option: word}))
            assert result.exit_code == 1, (option, word, result.output)
            assert isinstance(result.exception, SystemExit)
            assert said in result.stderr


def test_names_that_are_no_text(tmp_path):
    """File names are bytes: they are read, written and shown, whatever the encoding of the terminal."""
    made = subprocess.run(
        [*COMMAND, "absolute-orientation", "--example", "--points-out", b"o\xff.csv", "--json", b"\xfe"],
        cwd=tmp_path,
        capture_output=True,
        env={**os.environ, "LC_ALL": "C", "PYTHONIOENCODING": "ascii"},
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert b"written: o" in made.stdout
    assert {os.fsencode(path.name) for path in tmp_path.iterdir()} == {
        b"o\xff.csv",
        b"\xfe",
        b"example-oriented",
    }
    points = tmp_path / os.fsdecode(b"p\xff.csv")
    points.write_bytes((SOURCES / "examples" / "absolute_orientation" / "points.csv").read_bytes())
    again = subprocess.run(
        [*COMMAND, "absolute-orientation", "transform", b"\xfe", b"p\xff.csv", b"\xfd"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert again.returncode == 0, again.stderr
    missing = subprocess.run(
        [*COMMAND, "collection", b"\xfd-missing"], cwd=tmp_path, capture_output=True, check=False
    )
    assert missing.returncode == 1
    assert b"No such file or directory" in missing.stderr
    assert b"Traceback" not in missing.stderr


@pytest.mark.parametrize("value", ["99999999999999999999", "9" * 5000, "0", "-1", "x", "1e3"])
@pytest.mark.parametrize(
    "command", ["giant", "collection", ["giant", "check"], ["stellar-camera", "exposures"]]
)
def test_threads_that_are_no_number_of_threads_are_usage_errors(run, command, value):
    line = [command] if isinstance(command, str) else command
    result = run(*line, "x", "--threads", value)
    assert result.exit_code == 2, result.output
    assert "--threads" in result.stderr


@pytest.mark.parametrize(
    "option", ["--strips", "--photos-per-strip", "--blunders", "--check-points", "--seed"]
)
def test_integers_beyond_all_counts_are_usage_errors(run, tmp_path, option):
    result = run("simulate", "block", option, "9" * 20)
    assert result.exit_code == 2
    assert f"Invalid value for {option}: must be at most" in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "line", [["--help"], ["giant", "--help"], ["--version"], ["giant", "--example", "--no-html"]]
)
def test_a_full_device_and_a_closed_pipe(tmp_path, line):
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [*COMMAND, *line], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path, check=False
        )
    assert (done.returncode, done.stderr.splitlines()[-1]) == (
        1,
        "error: standard output: No space left on device",
    )
    assert "Traceback" not in done.stderr
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [*COMMAND, *line], stdout=writer, stderr=subprocess.PIPE, text=True, cwd=tmp_path, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "")


def test_closed_streams(tmp_path):
    """Without standard streams no file is opened in their place."""
    done = subprocess.run(
        ["sh", "-c", '"$@" >&- 2>&- <&-', "sh", *COMMAND, "giant", "--example", "--json", "j"],
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 0
    assert (tmp_path / "j").read_bytes().endswith(b"}\n")
    assert (tmp_path / "j").read_bytes().startswith(b"{")


def test_a_document_that_its_reader_leaves_changes_nothing(tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [*COMMAND, "giant", "--example", "--json", "/dev/stdout", "--quiet"],
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "error: /dev/stdout: Broken pipe\n")
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    # Without pictures, which take longer than all else and write nothing: most moments would be theirs.
    return Trials(tmp_path_factory.mktemp("trials"), random.Random(7).randrange(1000), "--no-html")


@pytest.mark.parametrize("kind", range(5))
def test_random_moments_of_death(trials, kind):
    """A few of the trials of `tests/fuzz/kills.py`, which check themselves what is left."""
    title, trial = list(kinds(trials))[kind]
    trials.counts.clear()
    for _ in range(4):
        trial()
    trials.put_in_order()
    assert sum(trials.counts.values()) == 4, title


def test_an_ignored_signal_stays_ignored(tmp_path):
    """As under nohup."""
    program = (
        "import os, signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from photogram.cli.process import end_by_signals\n"
        "end_by_signals(); os.kill(os.getpid(), signal.SIGHUP); print('alive')"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "alive\n")


def test_nothing_heavy_is_imported_before_signals_are_taken_over():
    program = "import sys; from photogram.cli import main; print(len(sys.modules), 'typer' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    bare = subprocess.run(
        [sys.executable, "-c", "import ast, sys, typing, signal, lazy_loader; print(len(sys.modules))"],
        capture_output=True,
        text=True,
        check=True,
    )
    modules, typer = done.stdout.split()
    assert typer == "False"
    assert int(modules) <= int(bare.stdout) + 8


def test_the_names_of_the_package_are_there():
    for name in photogram.__all__:
        assert getattr(photogram, name) is not None
        assert name in dir(photogram)
    with pytest.raises(AttributeError, match="No photogram attribute nothing"):
        photogram.nothing  # noqa: B018


WRITERS = ("write_bytes", "write_text", "mkdir", "makedirs", "tofile", "savetxt", "mkstemp")


def writes(program):
    """Return the calls of a module by which it would write files itself."""
    # Parsing takes long: most modules contain none of these names.
    tree = ast.parse(program if any(name in program for name in (*WRITERS, "open")) else "")
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        modes = [
            each.value for each in node.args if isinstance(each, ast.Constant) and isinstance(each.value, str)
        ]
        if name in WRITERS:
            yield name, node.lineno
        if name == "open" and any(set(mode) & set("wax+") and set(mode) <= set("rwaxbt+") for mode in modes):
            yield name, node.lineno


IN_RUNS = {f"distributed/{name}.py" for name in ("executors", "files", "nodes", "run", "tasks")} | {
    "formats/in_parts.py",
}
"""These make folders of a run in parts, which is taken up again after whatever happens. One file writes
there, under another name first; another one into a temporary folder."""


def test_there_is_one_writer():
    found = {
        path.relative_to(SOURCES).as_posix(): list(writes(path.read_text(encoding="utf-8")))
        for path in SOURCES.rglob("*.py")
    }
    writers = {path for path, calls in found.items() if calls}
    assert writers - IN_RUNS == {"io/writing.py"}
    opens = {path for path in IN_RUNS if any(name != "mkdir" for name, _ in found[path])}
    assert opens == {"distributed/files.py", "distributed/executors.py"}


def test_every_exit_code_stands_in_the_table_of_the_docs():
    table = DOCS.read_text().partition("## Exit codes")[2].partition("\n## ")[0]
    codes = {line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")}
    assert {"0", "1", "2", "3", "129", "130", "143"} <= codes
    assert COMMANDS


@pytest.mark.parametrize(
    ("group", "others"),
    [
        ("giant", ["check"]),
        ("comparator", ["correct", "compare"]),
        ("absolute-orientation", ["transform"]),
        ("stellar-camera", ["exposures"]),
    ],
)
def test_the_help_of_a_group_names_its_other_commands(run, group, others):
    shown = run(group, "--help").output
    assert "Other commands:" in shown
    assert all(f"photogram {group} {each}:" in shown for each in others)
    assert "Other commands" not in run(group, others[0], "--help").output


@pytest.mark.parametrize("command", ["giant", "adjust", "collection"])
def test_an_example_names_its_report_last_and_no_path_of_the_package(run, command):
    done = run(command, "--example", *(["--out", "out"] if command == "collection" else []))
    assert done.exit_code == 0
    assert done.stdout.splitlines()[-1].startswith("open in a browser: ")
    assert done.stdout.splitlines()[-1].endswith("report.html")
    assert str(Path(photogram.__file__).parent) not in done.output
