"""Runs that are killed or told to end at random moments, and what they leave.

`python tests/fuzz/kills.py` prints as a table how 200 trials of each kind ended; another number as argument.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

TRIALS = 200
SEED = 12
RESULTS = ("out/FRAMES", "out/GROUND", "out/RESTART", "out/report.txt", "result.json")
COMMAND = ("-m", "photogram.cli", "giant", "block", "--out", "out", "--json", "result.json", "--quiet")
WRITER = """\
import sys
from itertools import count
from pathlib import Path
from photogram.io.writing import write_whole
print("ready", flush=True)
for version in count(1):
    write_whole({Path(name): str(version).encode() * 2000 for name in sys.argv[1:]})
"""
"""A program that does nothing but write one set of files again and again."""
SIMULATE = ("-m", "photogram.cli", "simulate", "block", "--strips", "1", "--photos-per-strip", "3")
ENV = {**os.environ, "NO_COLOR": "1"}


class Trials:
    """A place with a project, in which the same command is started again and again.

    Parameters
    ----------
    place
        An empty directory.
    seed
        Of the moments.
    further
        Words of the command.
    """

    def __init__(self, place: Path, seed: int = SEED, *further: str) -> None:
        self.place = place
        self.command = (*COMMAND, *further)
        self.random = random.Random(seed)
        self.counts: Counter[str] = Counter()
        self._run(*SIMULATE)
        start = time.monotonic()
        self._run(*self.command)
        self.duration = time.monotonic() - start

    def killed(self) -> None:
        """Kill the command at a random moment of its life; see that each result is complete."""
        self._put_old()
        process = self._start(*self.command)
        time.sleep(self.random.uniform(0, self.duration))
        process.kill()
        process.communicate()
        ended = "was through" if process.returncode == 0 else "killed"
        self.counts[f"{ended}, results {self._state()}"] += 1

    def told_to_end(self, number: signal.Signals) -> None:
        """Send the command a signal, from when it has taken the signals over to its end; check its end."""
        self._put_old()
        process = self._start(*self.command)
        wait_until_caught(process, number)
        time.sleep(self.random.uniform(0, self.duration))
        process.send_signal(number)
        _, errors = process.communicate()
        assert "Traceback" not in errors, errors
        assert not errors, errors
        assert process.returncode in (0, 128 + number), (process.returncode, errors)
        assert not leftovers(self.place), leftovers(self.place)
        state = self._state()
        assert state in ("all old", "all new"), state
        self.counts[f"exit {process.returncode}, results {state}"] += 1

    def writer_killed(self) -> None:
        """Kill a program that does nothing but write, where more moments are those of writing."""
        names = ("one/a", "one/b", "two/c", "d")
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, *names], cwd=self.place, stdout=subprocess.PIPE, env=ENV
        )
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(self.random.uniform(0.0, 0.3))
        process.kill()
        process.communicate()
        found = {name: (self.place / name).read_bytes() for name in names if (self.place / name).exists()}
        for content in found.values():
            # Each file is whole: one version, all of it.
            version = content[: len(content) // 2000]
            assert content == version * 2000, content[:20]
        same = len(set(found.values())) <= 1 and len(found) in (0, len(names))
        state = "of one run" if same else "of two runs"
        self.counts[f"{state}; {'with' if leftovers(self.place) else 'no'} temporary files"] += 1

    def put_in_order(self) -> None:
        """Remove temporary files of killed runs, and write all files again."""
        for path in leftovers(self.place):
            path.unlink()
        self._run(*self.command)
        self._run("-c", WRITER.replace("count(1)", "[0]"), "one/a", "one/b", "two/c", "d")
        assert not leftovers(self.place), leftovers(self.place)

    def _run(self, *command: str) -> None:
        done = subprocess.run(
            [sys.executable, *command], cwd=self.place, capture_output=True, text=True, env=ENV, check=False
        )
        assert done.returncode == 0, done.stderr

    def _start(self, *command: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, *command],
            cwd=self.place,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=ENV,
            preexec_fn=heed_signals,
        )

    def _put_old(self) -> None:
        (self.place / "out").mkdir(exist_ok=True)
        for name in RESULTS:
            (self.place / name).write_bytes(b"old")

    def _state(self) -> str:
        """Return which results are old; each is complete."""
        old = [name for name in RESULTS if (self.place / name).read_bytes() == b"old"]
        for name in set(RESULTS) - set(old):
            assert (self.place / name).read_bytes().endswith((b"\n", b"}")), name
        if old and len(old) < len(RESULTS):
            return "of two runs"
        return "all old" if old else "all new"


def heed_signals() -> None:
    """Undo that signals are ignored, as a shell does for what it starts in the background."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def leftovers(place: Path) -> list[Path]:
    """Return the temporary files."""
    return list(place.rglob(".photogram-*"))


def wait_until_caught(process: subprocess.Popen[str], number: int) -> None:
    """Wait until a process has a handler of its own for a signal (and Python's own SIGINT is replaced)."""
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        caught = re.search(r"^SigCgt:\s*(\w+)", status.read_text(), re.MULTILINE)
        # SIGHUP is taken over last, and Python by itself takes only SIGINT.
        if caught and int(caught[1], 16) >> (signal.SIGHUP - 1) & 1:
            return
        time.sleep(0.001)
    raise AssertionError(f"ended before it took signal {number} over")


def kinds(trials: Trials) -> Iterator[tuple[str, Callable[[], None]]]:
    """Return the kinds of trials with their titles."""
    yield "SIGKILL to `photogram giant`", trials.killed
    yield "SIGKILL to a program that does nothing but write four files", trials.writer_killed
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        yield f"{number.name} to `photogram giant`", lambda number=number: trials.told_to_end(number)


def main() -> None:
    """Make the trials and print how they ended."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else TRIALS
    place = Path(tempfile.mkdtemp())
    try:
        trials = Trials(place)
        print("| what was done | how it ended | times |\n|---|---|---:|", flush=True)
        for title, trial in kinds(trials):
            trials.counts.clear()
            for _ in range(count):
                trial()
            trials.put_in_order()
            for ended, times in sorted(trials.counts.items()):
                print(f"| {title} | {ended} | {times} |", flush=True)
    finally:
        shutil.rmtree(place)


if __name__ == "__main__":
    main()
