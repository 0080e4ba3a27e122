"""Signals, and temporary files of runs that were killed."""

import signal
import subprocess
import sys

import pytest

DEATH = """\
import os, sys
from pathlib import Path
from photogram.io import writing
place, number = Path(sys.argv[1]), int(sys.argv[2])
real, moved = os.replace, []
def replace(source, target):
    if len(moved) == 1:
        moved.append(target)
        os.kill(os.getpid(), number)
    moved.append(target)
    real(source, target)
if number != 9:
    from photogram.cli.process import end_by_signals
    end_by_signals()
writing.os.replace = replace
writing.write_whole({place / name: b"new" for name in ("a", "b", "made/c")})
"""
"""A run that gets a signal between the moves of two files."""


def heed():
    # Shells start programs in the background with ignored signals, and Python does not change that.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_signal_between_the_moves_of_two_files(tmp_path, number):
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"old")
    command = [sys.executable, "-c", DEATH, tmp_path, str(int(number))]
    done = subprocess.run(command, capture_output=True, check=False, preexec_fn=heed)
    killed = number == signal.SIGKILL
    assert done.returncode == (-number if killed else 128 + number), done.stderr
    assert (tmp_path / "a").read_bytes() == (b"new" if killed else b"old")
    assert (tmp_path / "b").read_bytes() == b"old"
    assert {each.name for each in tmp_path.iterdir()} == {"a", "b"} or killed


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

    done = subprocess.run(command, capture_output=True, cwd=tmp_path, check=False, preexec_fn=heed)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, b"", b"")
    assert list(tmp_path.rglob("*")) == [tmp_path / "old"]
    assert (tmp_path / "old").read_bytes() == b"old"
