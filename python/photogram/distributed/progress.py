"""How far the iterations of a run have come: what one that died goes on from."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from photogram.distributed.files import read_json, write_json
from photogram.distributed.tasks import Job
from photogram.errors import InputError
from photogram.lazy_dataclasses import asdict, dataclass, field
from photogram.results.iteration import Iteration

__all__ = ["Course"]

PROGRESS = "progress.json"


@dataclass
class Course:
    """How far the iterations have come.

    `curved`: whether the second-order term of a loss is taken in at the state; `near`: whether from there on.
    `chord`: the length of the chord that followed the last step, where one did. `ending`, when they are over:
    the status, the state whose equations give cofactors, and the state reached.
    """

    state: str = "0"
    before: str = "0"
    damping: float = 0.0
    curved: bool = False
    near: bool = False
    best: float = math.nan
    initial: float = math.nan
    refused: float | None = None
    chord: float | None = None
    ending: tuple[str, str, str] | None = None
    trials: int = 0
    formations: int = 0
    iterations: list[Iteration] = field(default_factory=list)

    def write(self, job: Job) -> None:
        """Write it into the folder of the run."""
        document = {name: each for name, each in vars(self).items() if name != "iterations"}
        document["iterations"] = [asdict(each) for each in self.iterations]
        document["source"] = job.source
        write_json(job.folder / PROGRESS, document)

    @classmethod
    def read(cls, job: Job) -> Course:
        """Return what the folder of the run has; the beginning where it has nothing.

        Raises
        ------
        InputError
            It is damaged, or the progress of another run.
        """
        if not (job.folder / PROGRESS).is_file():
            return cls()
        document = read_json(job.folder / PROGRESS)
        if document.pop("source", None) != job.source:
            raise InputError("is the progress of another run", file=job.folder / PROGRESS)
        rows: Iterable[dict[str, Any]] = document.pop("iterations")
        ending = document.pop("ending")
        iterations = [Iteration(**row) for row in rows]
        return cls(**document, ending=None if ending is None else tuple(ending), iterations=iterations)
