"""What dead runs have left is removed by the next; what lives or belongs to others is not."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from photogram.io.writing import OutputSet, write_whole
from photogram.io.writing.outputs import deferred
from photogram.io.writing.staging import doubtful

DEATH = """\
import os, sys
from pathlib import Path
from photogram.io.writing import OutputSet, outputs
place = Path(sys.argv[1])
real, moved = os.replace, []
def replace(source, target):
    if "incomplete" not in target and len(moved) == 1:
        os.kill(os.getpid(), 9)
    if "incomplete" not in target:
        moved.append(target)
    real(source, target)
outputs.os.replace = replace
outputs.write_whole({place / "a": b"new", place / "b": b"new"})
"""
"""A run that is killed between the moves of two files."""


def staging(directory):
    return sorted(path.name for path in directory.iterdir() if path.name.startswith(".photogram-"))


def marks(directory):
    return sorted(directory.glob("photogram-incomplete-*.txt"))


@pytest.fixture
def half(tmp_path):
    """Leave a set of which one file was put in place."""
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"old")
    done = subprocess.run([sys.executable, "-c", DEATH, tmp_path], capture_output=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert ((tmp_path / "a").read_bytes(), (tmp_path / "b").read_bytes()) == (b"new", b"old")
    return tmp_path


def test_a_run_that_died_between_two_files_has_left_a_mark(half):
    (mark,) = marks(half)
    assert '"a"\n"b"\n' in mark.read_text()
    assert "some may be those of an earlier run" in mark.read_text()
    assert doubtful([half / "a", half / "c"]) == {half / "a": str(mark)}
    assert len(staging(half)) == 1


def test_the_next_run_removes_what_was_left(half):
    write_whole({half / "a": b"newer", half / "b": b"newer"})
    assert {path.name for path in half.iterdir()} == {"a", "b"}


def test_the_mark_stays_until_all_its_files_are_written_again(half):
    write_whole({half / "a": b"newer", half / "c": b"newer"})
    assert staging(half) == []
    assert len(marks(half)) == 1
    write_whole({half / "b": b"newer", half / "a": b"newer", half / "c": b"newer"})
    assert marks(half) == []


def test_a_command_remarks_on_inputs_of_an_incomplete_set(run, half):
    result = run("collection", half / "a")
    assert f"remark: {half / 'a'}: an interrupted run may have changed other files" in (result.stderr)
    assert str(marks(half)[0]) in result.stderr


def test_a_run_that_lives_is_let_alone(tmp_path):
    with OutputSet() as living:
        living.open(tmp_path / "slow").write(b"half")
        before = staging(tmp_path)
        done = subprocess.run(
            [
                sys.executable,
                "-c",
                "import sys; from pathlib import Path; from photogram.io.writing import write_whole;"
                "write_whole({Path(sys.argv[1]): b'quick'})",
                tmp_path / "quick",
            ],
            check=False,
        )
        assert done.returncode == 0
        assert staging(tmp_path) == before
        assert len(before) == 1
    assert {path.name for path in tmp_path.iterdir()} == {"slow", "quick"}


def test_what_only_looks_like_a_leftover_is_let_alone(tmp_path):
    looks = ".photogram-0123456789abcdef"
    others = tmp_path / "others"
    others.mkdir()
    (others / "lock").write_text("not ours")
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / looks).symlink_to(others)
    (tmp_path / "file").mkdir()
    (tmp_path / "file" / looks).write_text("a file")
    # Without a lock it may just have been begun: only an empty one is removed.
    (tmp_path / "full" / looks).mkdir(parents=True)
    (tmp_path / "full" / looks / "data").write_text("data")
    (tmp_path / "empty" / looks).mkdir(parents=True)
    for name in ("linked", "file", "full", "empty"):
        write_whole({tmp_path / name / "result": b"new"})
    assert (others / "lock").read_text() == "not ours"
    assert (tmp_path / "linked" / looks).is_symlink()
    assert (tmp_path / "file" / looks).read_text() == "a file"
    assert (tmp_path / "full" / looks / "data").exists()
    assert staging(tmp_path / "empty") == []


def test_leftovers_of_other_users_are_let_alone(tmp_path, monkeypatch):
    looks = tmp_path / ".photogram-0123456789abcdef"
    looks.mkdir()
    (looks / "lock").touch()
    monkeypatch.setattr(os, "geteuid", lambda: looks.stat().st_uid + 1)
    write_whole({tmp_path / "result": b"new"})
    assert looks.exists()
    monkeypatch.undo()
    write_whole({tmp_path / "result": b"new"})
    assert not looks.exists()


def test_a_temporary_is_open_to_nobody_else(tmp_path):
    with OutputSet() as outputs:
        outputs.open(tmp_path / "result")
        (name,) = staging(tmp_path)
        assert (tmp_path / name).stat().st_mode & 0o777 == 0o700


def test_where_there_are_no_links_a_set_that_cannot_be_undone_is_marked(tmp_path, monkeypatch):
    def unable(*_arguments, **_options):
        raise PermissionError(1, "Operation not permitted")

    real = os.replace

    def replace(source, target):
        if Path(target).name == "b":
            raise OSError(5, "Input/output error")
        real(source, target)

    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"old")
    monkeypatch.setattr(os, "link", unable)
    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(OSError, match="Input/output error"):
        write_whole({tmp_path / "a": b"new", tmp_path / "b": b"new"})
    assert len(marks(tmp_path)) == 1
    assert staging(tmp_path) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_ends_a_command_leaves_nothing(tmp_path, number):
    (tmp_path / "old").write_bytes(b"old")
    program = (
        "import os, sys\n"
        "from pathlib import Path\n"
        "from photogram.cli.process import end_by_signals\n"
        "from photogram.io.writing import OutputSet\n"
        "end_by_signals()\n"
        "with OutputSet() as outputs:\n"
        "    outputs.write(Path('made/deeper/new'), b'new')\n"
        "    outputs.open(Path('old')).write(b'new')\n"
        "    os.kill(os.getpid(), int(sys.argv[1]))\n"
    )
    command = [sys.executable, "-c", program, str(int(number))]

    def heed():
        # Shells start what runs in the background with SIGINT ignored, and what is ignored stays ignored.
        signal.signal(number, signal.SIG_DFL)

    done = subprocess.run(command, capture_output=True, cwd=tmp_path, check=False, preexec_fn=heed)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, b"", b"")
    assert list(tmp_path.rglob("*")) == [tmp_path / "old"]
    assert (tmp_path / "old").read_bytes() == b"old"


def test_signals_wait_while_files_are_put_in_place():
    seen = []

    def note(number, _frame):
        seen.append(number)

    former = signal.signal(signal.SIGTERM, note)
    try:
        with deferred():
            signal.raise_signal(signal.SIGTERM)
            assert seen == []
        assert seen == [signal.SIGTERM]
        assert signal.getsignal(signal.SIGTERM) is note
    finally:
        signal.signal(signal.SIGTERM, former)
