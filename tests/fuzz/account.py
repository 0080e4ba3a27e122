"""What runs on several days and machines have found together: their figures, in a file of the repository."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from .case import Outcome
from .run import Figures

__all__ = ["add_to"]


def add_to(account: Path, figures: Figures, numbers: range) -> tuple[Figures, list[range]]:
    """Add a run to an account.

    Parameters
    ----------
    account
        A JSON file, written anew; it need not be there.
    figures, numbers
        What a run has found, and of which inputs.

    Returns
    -------
    figures, numbers
        Of all runs.

    Raises
    ------
    ValueError
        The account is of another seed, or has some of these inputs already.
    """
    kept: dict[str, Any] = json.loads(account.read_text(encoding="utf-8")) if account.exists() else {}
    if kept.get("seed", figures.seed) != figures.seed:
        raise ValueError(f"{account} is of seed {kept['seed']}")
    done = [range(*ends) for ends in kept.get("numbers", [])]
    if any(own.start < numbers.stop and numbers.start < own.stop for own in done):
        raise ValueError(f"{account} has some of the inputs from {numbers.start} to {numbers.stop} already")
    both = Figures(figures.seed, Counter(figures.endings), Counter(figures.reached))
    both.faults = list(figures.faults)
    both.warnings = figures.warnings
    both.cpu_seconds = figures.cpu_seconds + kept.get("cpu_seconds", 0.0)
    for name, own in kept.get("formats", {}).items():
        both.reached[name] += own["reached"]
        for ending, count in own["endings"].items():
            both.endings[name, ending] += count
    both.faults += [(number, Outcome(*own)) for number, *own in kept.get("faults", [])]
    both.faults.sort(key=lambda fault: fault[0])
    done = _joined([*done, numbers])
    account.write_text(json.dumps(_as_json(both, done), indent=1) + "\n", encoding="utf-8")
    return both, done


def _as_json(figures: Figures, numbers: list[range]) -> dict[str, Any]:
    formats = {
        name: {
            "reached": figures.reached[name],
            "endings": {
                ending: count for (kind, ending), count in sorted(figures.endings.items()) if kind == name
            },
        }
        for name in sorted(figures.reached)
    }
    faults = [
        [number, outcome.format, outcome.ending, outcome.reached, outcome.warned, outcome.fault]
        for number, outcome in figures.faults
    ]
    return {
        "seed": figures.seed,
        "numbers": [[own.start, own.stop] for own in numbers],
        "cpu_seconds": round(figures.cpu_seconds, 1),
        "formats": formats,
        "faults": faults,
    }


def _joined(parts: list[range]) -> list[range]:
    """Return the parts in order, those that follow each other as one."""
    found: list[range] = []
    for own in sorted(parts, key=lambda part: part.start):
        if found and found[-1].stop == own.start:
            found[-1] = range(found[-1].start, own.stop)
        else:
            found.append(own)
    return found
