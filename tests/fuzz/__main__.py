"""The fuzzer's command line.

python -m tests.fuzz --inputs 1000000 --seed 12 --page docs/reliability.md
python -m tests.fuzz --inputs 50000 --first 250000 --seed 14 --account tests/fuzz/account.json
python -m tests.fuzz --replay 12:345 --keep damaged
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import programs, run
from .account import add_to
from .case import Outcome
from .page import lines, table, write_section
from .run import fuzz, replay

SHOWN = 5
"""Failing inputs of one cause that are named."""


def cause(outcome: Outcome) -> str:
    """Return where and why an input failed, without what differs from input to input."""
    text = (outcome.fault or "").strip().splitlines()
    places = [line.strip() for line in text if line.strip().startswith("File ")]
    return f"{outcome.format}: {text[-1]} ({places[-1] if places else ''})"


def main() -> int:
    """Run inputs, or one again; return 1 when one fails."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000, help="how many (5000)")
    parser.add_argument("--seed", type=int, default=0, help="of the run (0)")
    parser.add_argument("--first", type=int, default=0, help="number of the first input (0)")
    parser.add_argument("--jobs", type=int, default=1, help="worker processes (1)")
    parser.add_argument(
        "--logs", type=Path, help="directory of logs: the same command goes on where it stopped"
    )
    parser.add_argument(
        "--account", type=Path, help="JSON file that the figures are added to: a run in parts, on any machine"
    )
    parser.add_argument("--page", type=Path, help="page whose section on the fuzzer gets the figures")
    parser.add_argument(
        "--pages", type=float, default=0.0, help="part of them that have a report for the browser (0)"
    )
    parser.add_argument("--replay", metavar="SEED:NUMBER", help="run one input again and say how it ends")
    parser.add_argument("--keep", type=Path, help="with --replay: directory for the files of the input")
    asked = parser.parse_args()
    if asked.pages:
        programs.PAGES = asked.pages
        run.MEMORY *= 2  # matplotlib takes address space
    if asked.replay:
        outcome = replay(*map(int, asked.replay.split(":")), asked.keep)
        print(f"{outcome.format}: {outcome.ending}\n{outcome.fault or outcome.warned or ''}")
        return int(outcome.fault is not None)
    figures = fuzz(asked.seed, asked.inputs, asked.jobs, first=asked.first, logs=asked.logs, told=True)
    numbers = [range(asked.first, asked.first + asked.inputs)]
    if asked.account:
        figures, numbers = add_to(asked.account, figures, numbers[0])
    print("\n".join([*lines(figures, numbers), "", *table(figures)]))
    told: dict[str, list[int]] = {}
    for number, outcome in figures.faults:
        told.setdefault(cause(outcome), []).append(number)
    for what, failed in sorted(told.items(), key=lambda each: -len(each[1])):
        again = ", ".join(f"{asked.seed}:{number}" for number in failed[:SHOWN])
        print(f"\n{len(failed)} failed ({again}): {what}")
    for warning, count in figures.warnings.most_common():
        print(f"{count} warnings: {warning}")
    if asked.page:
        write_section(asked.page, "fuzz", [*lines(figures, numbers), "", *table(figures)])
    return int(bool(figures.faults))


sys.exit(main())
