"""If a call of the system fails, either all files are old or all files are new."""

import errno
import resource
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from faults import faulty

from photogram.io.writing import MOST_PENDING, OutputSet, write_whole

NAMES = ("a", "b", "made/new/c", "there/d")
EXAMPLE = Path(str(files("photogram") / "examples" / "absolute_orientation"))


def put_old(directory):
    (directory / "there").mkdir(parents=True)
    for name in ("a", "there/d"):
        (directory / name).write_bytes(b"old")


def write_new(directory, how):
    if how == "at once":
        write_whole({directory / name: b"new" for name in NAMES})
        return
    with OutputSet() as outputs:
        opened = [outputs.open(directory / name) for name in NAMES]
        for file in opened:
            file.write(b"ne")
        for file in opened:
            file.write(b"w")


def state(directory):
    """Return "old", "new" or "mixed"."""
    found = {name: (directory / name).read_bytes() for name in NAMES if (directory / name).exists()}
    if found == {"a": b"old", "there/d": b"old"}:
        return "old"
    return "new" if found == dict.fromkeys(NAMES, b"new") else f"mixed: {found}"


def leftovers(directory):
    return [path for path in directory.rglob("*") if path.name.startswith(".photogram")]


def test_more_files_than_wait_for_the_disk_are_written_or_none(tmp_path, monkeypatch):
    files = {tmp_path / str(number): b"new" for number in range(3 * MOST_PENDING)}
    with faulty(monkeypatch, 5 * MOST_PENDING) as system, pytest.raises(OSError, match="space"):
        write_whole(files)
    assert system.failed in {"open", "write", "fsync"}
    assert not [*tmp_path.iterdir()]
    write_whole(files)
    assert {path.read_bytes() for path in files} == {b"new"}


@pytest.mark.parametrize("how", ["at once", "piece by piece"])
@pytest.mark.parametrize(("lasting", "number"), [(False, errno.ENOSPC), (True, errno.EROFS)])
def test_every_call_fails_in_turn(tmp_path, monkeypatch, how, lasting, number):
    at, ends, failed = 0, set(), set()
    while True:
        at += 1
        place = tmp_path / str(at)
        put_old(place)
        error = None
        with faulty(monkeypatch, at, lasting=lasting, number=number) as system:
            try:
                write_new(place, how)
            except OSError as caught:
                error = caught
        if system.failed is None:
            break
        failed.add(system.failed)
        told = (at, system.failed, error, state(place), system.calls[at - 4 : at])
        if error is None:
            assert state(place) == "new", told
            assert not leftovers(place) or system.failed == "unlink", told
        else:
            assert error.errno == number, told
            assert str(place) in error.filename, told
            assert ".photogram-" not in str(error), told
            # Only a system that moves no file cannot restore moved files.
            assert state(place) in ("old", "new") or (lasting and system.failed == "replace"), told
        if error and not lasting:
            assert state(place) == "old", told
            assert not leftovers(place), told
            assert not (place / "made").exists(), told
        ends.add((error is None, state(place)[:3]))
        with faulty(monkeypatch, 0):
            write_new(place, how)
        assert state(place) == "new", told
    assert failed == {"open", "write", "fsync", "replace", "mkdir", "link", "unlink"}
    assert (False, "old") in ends
    assert (True, "new") in ends
    assert at > 25


@pytest.mark.parametrize("lasting", [False, True])
def test_every_call_fails_in_turn_under_a_command(run, tmp_path, monkeypatch, lasting):
    made = {"o.csv", "r.json", "l.txt", "report.txt"}
    for at in range(1, 200):
        for name in made:
            (tmp_path / name).write_text("old")
        with faulty(monkeypatch, at, lasting=lasting) as system:
            result = run(
                "absolute-orientation",
                EXAMPLE / "stations.csv",
                "--points",
                EXAMPLE / "points.csv",
                "--points-out",
                "o.csv",
                "--json",
                "r.json",
                *("--method", "report", "--trace", "l.txt", "--out", ".", "--no-html"),
            )
        if system.failed is None:
            break
        told = (at, system.failed, result.output)
        old = {name for name in made if (tmp_path / name).read_text() == "old"}
        if result.exit_code == 0:
            assert not old, told
        else:
            assert result.exit_code == 1, told
            assert "No space left on device" in result.stderr, told
            assert any(name in result.stderr for name in made) or str(tmp_path) in result.stderr, told
            assert "None" not in result.stderr, told
            assert old in (made, set()) or (lasting and system.failed == "replace"), told
    assert at > 20


def test_a_disk_that_is_full(tmp_path):
    """The limit of the size of a file stands for the disk: after it the system writes no more."""
    target, other = tmp_path / "large", tmp_path / "small"
    other.write_bytes(b"old")
    program = (
        "import sys; from pathlib import Path; from photogram.io.writing import write_whole\n"
        "write_whole({Path(sys.argv[1]): b'new', Path(sys.argv[2]): bytes(1 << 20)})"
    )
    limit = (1 << 16, 1 << 16)
    done = subprocess.run(
        [sys.executable, "-c", program, other, target],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
    )
    assert f"File too large: '{target}'" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["small"]
    assert other.read_bytes() == b"old"


def test_a_directory_that_is_read_only(tmp_path):
    """A process without privileges, whoever runs the tests."""
    (tmp_path / "old").write_bytes(b"old")
    (tmp_path / "old").chmod(0o444)
    program = (
        "import os, secrets, sys\n"
        "from pathlib import Path\n"
        "from photogram.io.writing import write_whole\n"
        "os.getuid() or os.setuid(65534)\n"
        "for name in ('new', 'old'):\n"
        "    try: write_whole({Path(name): b'x'})\n"
        "    except PermissionError as error: print(error.filename, error.strerror)\n"
    )
    tmp_path.chmod(0o555)
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    tmp_path.chmod(0o755)
    assert done.stdout.splitlines() == ["new Permission denied", "old is write-protected"], done.stderr
    assert (tmp_path / "old").read_bytes() == b"old"
