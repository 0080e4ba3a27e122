"""Runs of many inputs: worker processes with limits, so that aborts and endless loops are seen and named."""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import time
import traceback
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory

from .case import Fuzzer, Outcome, kind_of

__all__ = ["Figures", "fuzz", "replay"]

CPU_SECONDS = 20
"""Of one input; more is a hang."""
WALL_SECONDS = 900
"""Of one input, for waits that use no processor."""
MEMORY = 4 << 30
"""Address space of a worker, bytes."""
TOLD = 60.0
"""Seconds between two lines about the progress of a run."""
IN_MEMORY = "/dev/shm"
"""Where the files go if it is there: the fuzzer tries the programs, not the disk."""


@dataclass
class Figures:
    """What a run found.

    Attributes
    ----------
    seed, inputs
        Of the run.
    endings
        How many inputs of a format ended in a way.
    reached, warned
        How many inputs of a format reached the computation, and how many made Python or NumPy warn.
    faults
        (number of the input, what became of it).
    warnings
        How often a warning was the first one of an input.
    cpu_seconds
        Of all workers.
    """

    seed: int
    inputs: int
    endings: Counter[tuple[str, str]] = field(default_factory=Counter)
    reached: Counter[str] = field(default_factory=Counter)
    warned: Counter[str] = field(default_factory=Counter)
    faults: list[tuple[int, Outcome]] = field(default_factory=list)
    warnings: Counter[str] = field(default_factory=Counter)
    cpu_seconds: float = 0.0

    def add(self, number: int, outcome: Outcome) -> None:
        """Count an input."""
        self.endings[outcome.format, outcome.ending] += 1
        self.reached[outcome.format] += outcome.reached
        if outcome.warned:
            self.warned[outcome.format] += 1
            self.warnings[outcome.warned] += 1
        if outcome.fault:
            self.faults.append((number, outcome))

    def of_format(self, name: str) -> int:
        """Return how many inputs there were of a format."""
        return sum(count for (kind, _), count in self.endings.items() if kind == name)


def fuzz(seed: int, inputs: int, jobs: int = 1, *, first: int = 0, told: bool = False) -> Figures:
    """Run inputs of a seed.

    Parameters
    ----------
    seed, inputs, first
        Which: `first` to `first + inputs`.
    jobs
        Worker processes.
    told
        Whether to tell on standard error how far the run is.
    """
    figures = Figures(seed, inputs)
    before = _children_seconds()
    with TemporaryDirectory(dir=IN_MEMORY if os.access(IN_MEMORY, os.W_OK) else None) as folder:
        workers = [
            _Worker(seed, range(first + job, first + inputs, jobs), Path(folder) / str(job))
            for job in range(jobs)
        ]
        running = {worker.start(): worker for worker in workers}
        shown = time.monotonic()
        while running:
            process, status = os.waitpid(-1, os.WNOHANG)
            if process:
                worker = running.pop(process)
                if not worker.ended(status):
                    running[worker.start()] = worker
            else:
                time.sleep(0.05)
            if told and time.monotonic() - shown > TOLD:
                shown = time.monotonic()
                print(f"{sum(worker.done() for worker in workers)} inputs", file=sys.stderr, flush=True)
        for worker in workers:
            worker.count(figures)
    figures.cpu_seconds = _children_seconds() - before
    figures.faults.sort(key=lambda fault: fault[0])
    return figures


def replay(seed: int, number: int, keep: Path | None = None) -> Outcome:
    """Run one input in this process, without limits.

    Parameters
    ----------
    seed, number
        Which.
    keep
        A directory to write its files to.
    """
    with TemporaryDirectory() as folder:
        fuzzer = Fuzzer(seed, Path(folder) / "case")
        if keep is not None:
            keep.mkdir(parents=True, exist_ok=True)
            for name, content in fuzzer.input_of(number)[1].items():
                (keep / name).write_bytes(content)
        return fuzzer.run(number)


def _children_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class _Worker:
    """A process that runs inputs one by one, and is started again behind one that ended it.

    Every input that is done has a line in its log: the one behind the last line is at work.
    """

    def __init__(self, seed: int, numbers: range, place: Path) -> None:
        self.seed = seed
        self.numbers = numbers
        self.place = place
        self.log = place / "log"
        place.mkdir()
        self.log.touch()

    def done(self) -> int:
        """Return how many inputs are done."""
        with self.log.open() as file:
            return sum(1 for _ in file)

    def start(self) -> int:
        """Start the process; return its identifier."""
        begin = self.done()
        process = os.fork()
        if process == 0:
            code = 1
            try:
                self._work(begin)
                code = 0
            except BaseException:  # whatever it is, this process must not go on as its parent
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(code)
        return process

    def ended(self, status: int) -> bool:
        """Note how the process ended; return whether all inputs are done."""
        done = self.done()
        if done == len(self.numbers):
            return True
        if not os.WIFSIGNALED(status):
            raise RuntimeError(f"the fuzzer itself failed at {self.seed}:{self.numbers[done]}")
        name = signal.Signals(os.WTERMSIG(status)).name
        hung = {
            "SIGPROF": f"more than {CPU_SECONDS} s of processor time",
            "SIGALRM": f"more than {WALL_SECONDS} s",
        }
        kind, _ = kind_of(self.seed, self.numbers[done])
        outcome = Outcome(kind, "failed", True, None, hung.get(name, name))
        with self.log.open("a") as file:
            file.write(json.dumps(asdict(outcome)) + "\n")
        return done + 1 == len(self.numbers)

    def count(self, figures: Figures) -> None:
        """Count what is in the log."""
        with self.log.open() as file:
            for number, line in zip(self.numbers, file, strict=True):
                figures.add(number, Outcome(**json.loads(line)))

    def _work(self, begin: int) -> None:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # They end the process: the parent sees by which signal.
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        fuzzer = Fuzzer(self.seed, self.place / "case")
        rmtree(fuzzer.place, ignore_errors=True)
        with self.log.open("a", buffering=1) as log:
            for number in self.numbers[begin:]:
                fuzzer.prepare(number)
                signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
                signal.setitimer(signal.ITIMER_REAL, WALL_SECONDS)
                outcome = fuzzer.run(number)
                signal.setitimer(signal.ITIMER_PROF, 0)
                signal.setitimer(signal.ITIMER_REAL, 0)
                log.write(json.dumps(asdict(outcome)) + "\n")
