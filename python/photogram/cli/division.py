"""Options of a command that adjusts in parts: on a cluster, or one after the other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.job import Writes
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.distributed import Division

__all__ = ["WHOLE", "Parts"]

Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS|local",
        help="Adjust in parts on a Dask cluster: its scheduler, or `local` for workers on this machine.",
        show_default=False,
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(metavar="N", help="Workers of a local cluster; one for each processor.", show_default=False),
]
Count = Annotated[
    int | None,
    typer.Option(
        "--parts", metavar="P", help="Parts. Default: some for each worker, that fit.", show_default=False
    ),
]
Memory = Annotated[
    str | None,
    typer.Option(
        metavar="SIZE",
        help="Memory of a worker, or of this process (4GB, 1.5GiB): what takes more goes in parts.",
        show_default=False,
    ),
]
RunFolder = Annotated[
    Path | None,
    Writes.DIRECTORY,
    typer.Option(
        "--run",
        metavar="DIR",
        help="Keep parts and states there, for all workers: the same command takes up a run that died.",
        show_default=False,
    ),
]
PlanOnly = Annotated[
    bool, typer.Option("--plan", help="Print parts, work, memory, traffic and time, and adjust nothing.")
]


@dataclass(frozen=True)
class Parts:
    """How a user divides an adjustment, with the options that say it."""

    cluster: Cluster = None
    workers: Workers = None
    parts: Count = None
    memory: Memory = None
    run: RunFolder = None
    plan: PlanOnly = False

    @property
    def division(self) -> Division | None:
        """As :func:`photogram.adjust_in_parts` takes it; None where nothing is asked for."""
        if replace(self, plan=False) == WHOLE:
            return None
        from photogram.distributed import Division

        return Division(
            parts=self.parts,
            cluster=self.cluster,
            workers=self.workers,
            memory=self.memory,
            folder=self.run,
        )


WHOLE = Parts()
"""One process, one part."""
