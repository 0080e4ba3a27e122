"""Adjustment of a project on disk in parts, without loading it completely."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from photogram.adjustment.adjustment import Progress, core_options
from photogram.adjustment.options import AdjustOptions
from photogram.distributed.adjust import Run, opened
from photogram.distributed.division import Division
from photogram.distributed.driver import Outcome
from photogram.distributed.files import alone
from photogram.distributed.plan import PartsPlan
from photogram.distributed.run import Manifest, result_folder
from photogram.formats.plain.batches import Streamed
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import dataclass
from photogram.results.network_tables import iteration_table
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Section
from photogram.show.quantity import Table


@dataclass(frozen=True)
class OnDisk(Documented):
    """The result of the adjustment of a project on disk."""

    outcome: Outcome  # History, sums and variance
    manifest: Manifest  # The tree, and the size of each node
    # One result folder per node, for :func:`photogram.read_result`; photos of higher nodes are repeated in
    # several, with equal values and covariances
    folders: list[Path]

    def document(self) -> Document:
        """Return the document: sizes, sums of squares, iterations."""
        outcome, variance = self.outcome, self.outcome.variance_of_unit_weight
        observations, weighted, unknowns = outcome.counts
        manifest = self.manifest
        photos, points, images = map(sum, (manifest.photos, manifest.points, manifest.images))
        groups = dict(
            zip(("camera", "ground", "plates", "observations"), outcome.sums_of_squares, strict=True)
        )
        groups["total"] = sum(outcome.sums_of_squares)
        iterations = Table("iterations", "Iterations", iteration_table(outcome.iterations))
        return Document(
            "Adjustment in parts",
            "",
            highlights=[
                Fact("Status", outcome.status, note=f"{len(outcome.iterations)} iterations"),
                *(
                    []
                    if variance is None
                    else [Fact.of("sigma0", variance**0.5, figures=6, note="a priori 1")]
                ),
                Fact.of("Photos", photos, note=f"in {len(self.folders)} nodes"),
                Fact.of("Points", points),
                Fact.of("Image points", images),
                Fact.of("Observations", observations, note=f"and {weighted} weighted unknowns"),
                Fact.of("Unknowns", unknowns),
                Fact.of("Degrees of freedom", outcome.degrees_of_freedom, decimals=0),
                *(
                    Fact.of(f"Weighted sum of squares, {name}", value, figures=6)
                    for name, value in groups.items()
                ),
            ],
            sections=[Section.of(iterations)],
        )


def adjusted_on_disk(
    path: Path,
    reading: ReadOptions,
    folder: Path,
    division: Division,
    *,
    change: Callable[[AdjustOptions], AdjustOptions] = lambda options: options,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> OnDisk:
    """Adjust a project in parts in a folder; its images are read in batches.

    `change` returns the options for the options of the project.
    """
    with _run(path, reading, folder, division, change, threads) as run:
        outcome = run.adjust(progress)
        found = [result_folder(folder, node) for node in range(len(run.manifest.tree))]
        return OnDisk(outcome, run.manifest, found)


def planned_on_disk(
    path: Path,
    reading: ReadOptions,
    folder: Path,
    division: Division,
    *,
    change: Callable[[AdjustOptions], AdjustOptions] = lambda options: options,
) -> PartsPlan:
    """Plan an adjustment and write its parts to the folder."""
    with _run(path, reading, folder, division, change, None) as run:
        return run.plan()


@contextmanager
def _run(
    path: Path,
    reading: ReadOptions,
    folder: Path,
    division: Division,
    change: Callable[[AdjustOptions], AdjustOptions],
    threads: int | None,
) -> Iterator[Run]:
    with ExitStack() as stack:
        stack.enter_context(alone(folder))
        streamed = Streamed(path, reading, folder)
        stack.callback(streamed.close)
        options = core_options(change(streamed.project.options), streamed.block)
        source = streamed.source(options)
        with opened(
            folder,
            source,
            len(streamed.block.photo_ids),
            lambda parts: streamed.counted(parts)[1],
            lambda parts: streamed.divided(folder, parts, options, source),
            division,
            threads,
        ) as run:
            yield run
