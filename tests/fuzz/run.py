"""Runs of many inputs: worker processes with limits, so that aborts and endless loops are seen and named."""

from __future__ import annotations

import faulthandler
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

from .case import Fuzzer, Outcome, kind_of, write_input

__all__ = ["Figures", "fuzz", "replay"]

CPU_SECONDS = 20
"""Of one input; more is a hang."""
WALL_SECONDS = 900
"""Of one input, for waits that use no processor."""
MEMORY = 8 << 30
"""Address space of a worker, bytes; pyarrow and the libraries of pyproj reserve several GiB of it."""
TOLD = 60.0
"""Seconds between two lines about the progress of a run."""
IN_MEMORY = "/dev/shm"
"""Where the files go if it is there: the fuzzer tries the programs, not the disk."""


@dataclass
class Figures:
    """What a run found.

    Attributes
    ----------
    seed
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

    @property
    def inputs(self) -> int:
        """How many there were."""
        return sum(self.endings.values())

    def of_format(self, name: str) -> int:
        """Return how many inputs there were of a format."""
        return sum(count for (kind, _), count in self.endings.items() if kind == name)


def fuzz(
    seed: int, inputs: int, jobs: int = 1, *, first: int = 0, logs: Path | None = None, told: bool = False
) -> Figures:
    """Run inputs of a seed.

    Parameters
    ----------
    seed, inputs, first
        Which: `first` to `first + inputs`.
    jobs
        Worker processes.
    logs
        A directory to keep what becomes of each input: a run that was stopped goes on where it was.
    told
        Whether to tell on standard error how far the run is.
    """
    figures = Figures(seed)
    with TemporaryDirectory(dir=IN_MEMORY if os.access(IN_MEMORY, os.W_OK) else None) as folder:
        numbers = [range(first + job, first + inputs, jobs) for job in range(jobs)]
        workers = [
            _Worker(seed, own, Path(folder) / str(job), (logs or Path(folder)) / f"{job}.log")
            for job, own in enumerate(numbers)
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
            write_input(keep, fuzzer.input_of(number)[1])
        return fuzzer.run(number)


def _line(outcome: Outcome, seconds: float) -> str:
    return (
        json.dumps([{name: value for name, value in asdict(outcome).items() if value}, round(seconds, 6)])
        + "\n"
    )


class _Worker:
    """A process that runs inputs one by one, and is started again behind one that ended it.

    Every input that is done has a line in its log: the one behind the last line is at work.
    """

    def __init__(self, seed: int, numbers: range, place: Path, log: Path) -> None:
        self.seed = seed
        self.numbers = numbers
        self.place = place
        self.log = log
        place.mkdir()
        log.parent.mkdir(parents=True, exist_ok=True)
        log.touch()

    def done(self) -> int:
        """Return how many inputs are done."""
        with self.log.open("rb") as file:
            return sum(line.endswith(b"\n") for line in file)

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
            file.write(_line(outcome, CPU_SECONDS))
        return done + 1 == len(self.numbers)

    def count(self, figures: Figures) -> None:
        """Count what is in the log."""
        with self.log.open() as file:
            for number, line in zip(self.numbers, file, strict=False):
                outcome, seconds = json.loads(line)
                figures.cpu_seconds += seconds
                figures.add(number, Outcome(**outcome))

    def _work(self, begin: int) -> None:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # They end the process: the parent sees by which signal, and nobody needs a trace of it.
        faulthandler.disable()
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        fuzzer = Fuzzer(self.seed, self.place / "case")
        rmtree(fuzzer.place, ignore_errors=True)
        before = time.process_time()
        with self.log.open("a", buffering=1) as log:
            for number in self.numbers[begin:]:
                fuzzer.prepare(number)
                signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
                signal.setitimer(signal.ITIMER_REAL, WALL_SECONDS)
                outcome = fuzzer.run(number)
                signal.setitimer(signal.ITIMER_PROF, 0)
                signal.setitimer(signal.ITIMER_REAL, 0)
                spent = time.process_time()
                log.write(_line(outcome, spent - before))
                before = spent
