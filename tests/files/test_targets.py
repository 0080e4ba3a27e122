"""Links are followed, what is no file is written through, and errors name what the user named."""

import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from photogram import InputError
from photogram.io.writing import OutputSet, check_outputs, write_whole


def names(directory):
    return {path.name for path in directory.iterdir()}


@pytest.mark.parametrize("exists", [True, False])
def test_a_symbolic_link_stays_and_its_target_is_replaced(tmp_path, exists):
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / "target"
    if exists:
        target.write_bytes(b"old")
    (tmp_path / "second").symlink_to("there/target")
    (tmp_path / "first").symlink_to(tmp_path / "second")
    write_whole({tmp_path / "first": b"new"})
    assert (tmp_path / "first").is_symlink()
    assert (tmp_path / "second").is_symlink()
    assert not target.is_symlink()
    assert target.read_bytes() == b"new"
    assert names(tmp_path / "there") == {"target"}


def test_a_link_planted_at_the_temporary_name_of_former_versions_is_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_bytes(b"old")
    (tmp_path / f".result.{os.getpid()}.tmp").symlink_to("victim")
    write_whole({tmp_path / "result": b"new"})
    assert victim.read_bytes() == b"old"


def test_a_fifo_is_written_through(tmp_path):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    read = []
    reader = threading.Thread(target=lambda: read.append(fifo.read_bytes()))
    reader.start()
    write_whole({fifo: b"through", tmp_path / "file": b"new"})
    reader.join()
    assert read == [b"through"]
    assert stat.S_ISFIFO(fifo.stat().st_mode)
    assert (tmp_path / "file").read_bytes() == b"new"


def test_a_device_is_written_through(tmp_path):
    write_whole({Path("/dev/null"): b"gone"})
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    with OutputSet() as outputs:
        outputs.open(Path("/dev/null")).write(b"gone")
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        write_whole({tmp_path / "file": b"new", Path("/dev/full"): b"no"})
    assert names(tmp_path) == set()


def test_a_socket_refuses_with_its_name(tmp_path, monkeypatch):
    import socket

    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("socket")
        with pytest.raises(OSError, match="'socket'"):
            write_whole({Path("socket"): b"no"})
    assert stat.S_ISSOCK(Path("socket").stat().st_mode)


@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "link"])
def test_standard_output_gets_the_document_in_its_place(tmp_path, name):
    """Also where it is a file, which is not replaced: what is printed before and after is kept."""
    (tmp_path / "link").symlink_to("/dev/stdout")
    program = (
        "import sys; from pathlib import Path; from photogram.io.writing import write_whole\n"
        "print('before'); write_whole({Path(sys.argv[1]): b'document\\n'}); print('after')"
    )
    command = [sys.executable, "-c", program, name]
    piped = subprocess.run(command, capture_output=True, cwd=tmp_path, check=False)
    assert (piped.stdout, piped.stderr) == (b"before\ndocument\nafter\n", b"")
    with (tmp_path / "file").open("wb") as file:
        subprocess.run(command, stdout=file, cwd=tmp_path, check=True)
    assert (tmp_path / "file").read_bytes() == b"before\ndocument\nafter\n"


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755, 0o666])
def test_the_permissions_of_a_file_stay(tmp_path, mode):
    path = tmp_path / "file"
    path.write_bytes(b"old")
    path.chmod(mode)
    write_whole({path: b"new"})
    assert stat.S_IMODE(path.stat().st_mode) == mode


def test_a_new_file_has_the_permissions_of_the_user(tmp_path):
    (tmp_path / "usual").touch()
    write_whole({tmp_path / "new": b""})
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_directories_are_refused_and_loops_and_names_that_are_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("loop")
    Path("a").symlink_to("b")
    Path("b").symlink_to("a")
    before = names(tmp_path)
    for path in (".", "..", "/", "missing/.."):
        with pytest.raises(InputError, match="is a directory"):
            write_whole({Path("new"): b"", Path(path): b""})
    for path in ("loop", "a", "loop/x", "a/x"):
        with pytest.raises(OSError, match=f"symbolic links: '{path}'"):
            write_whole({Path("new"): b"", Path(path): b""})
    for path in ("x" * 300, "y" * 300 + "/x"):
        with pytest.raises(OSError, match=f"File name too long: '{path}'"):
            write_whole({Path("new"): b"", Path(path): b""})
    with pytest.raises(InputError, match="must not contain a NUL character"):
        write_whole({Path("new"): b"", Path("nul\0"): b""})
    assert names(tmp_path) == before


def test_names_of_any_bytes_and_of_full_length(tmp_path):
    files = {tmp_path / os.fsdecode(name): name for name in (b"\xff\xfe", "Höhe".encode(), b"n" * 255, b" ")}
    write_whole(files)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == files


def test_two_names_of_one_file_are_known(tmp_path):
    (tmp_path / "file").write_bytes(b"old")
    os.link(tmp_path / "file", tmp_path / "hard")
    (tmp_path / "soft").symlink_to("file")
    for one, other in (("file", "hard"), ("soft", "file"), ("new", "New"), ("new", "./x/../new")):
        with pytest.raises(InputError, match="another result has this name"):
            write_whole({tmp_path / one: b"1", tmp_path / other: b"2"})
    assert (tmp_path / "file").read_bytes() == b"old"
    # What is written through may be named twice.
    write_whole({Path("/dev/null"): b"1", Path("/dev/../dev/null"): b"2"})


def test_an_exception_leaves_everything_as_it_was(tmp_path):
    (tmp_path / "old").write_bytes(b"old")

    def interrupted():
        with OutputSet() as outputs:
            outputs.open(tmp_path / "old").write(b"ne")
            outputs.write(tmp_path / "made" / "new", b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert names(tmp_path) == {"old"}
    assert (tmp_path / "old").read_bytes() == b"old"


def test_an_input_that_is_not_there_spares_nothing(tmp_path):
    check_outputs([tmp_path / "new"], [tmp_path / "missing", Path("nul\0")])
