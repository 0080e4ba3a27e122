"""`photogram features`: distances, lines, planes, circles, spheres, cylinders through adjusted points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.adjust import result_at
from photogram.cli.console import print_document
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, OutputFolder, Threads, misuse
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import dataclass, fields

if TYPE_CHECKING:
    from photogram.results.features import Definition


@dataclass(frozen=True)
class FeatureOptions:
    """Definitions of features; all options can be repeated."""

    distance: list[str] | None = None
    line: list[str] | None = None
    plane: list[str] | None = None
    circle: list[str] | None = None
    sphere: list[str] | None = None
    cylinder: list[str] | None = None

    def definitions(self) -> dict[str, Definition]:
        """Return the requested features by name."""
        found: dict[str, Definition] = {}
        for each in fields(self):
            for given in getattr(self, each.name) or ():
                name, equals, points = (part.strip() for part in given.partition("="))
                if not (name and equals and points):
                    raise misuse(f"--{each.name}", "form", form="NAME=POINT,...", value=given)
                if name in found:
                    raise misuse(f"--{each.name}", "feature-repeated", name=name)
                found[name] = (each.name, [point.strip() for point in points.split(",")])
        return found


@with_job("features", example=("flange",))
def features(
    job: Job,
    *,
    path: Input,
    wanted: FeatureOptions,
    k: Annotated[float, typer.Option("-k", min=0.01)] = 2.0,
    coverage: Annotated[float | None, typer.Option(min=0.01, max=0.999999)] = None,
    out: OutputFolder = None,
    reading: ReadOptions,
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Fit distances, lines, planes, circles, spheres and cylinders to adjusted points, with k and U.

    PATH is a result of `photogram adjust --parquet`, or a project that is adjusted first. Features of the
    project are fitted if no option defines features. --example is the project of `photogram new --kind
    metrology`.
    """
    from photogram import features as fitted
    from photogram.formats.results import feature_files
    from photogram.results.features import features_members, features_section
    from photogram.show.judgement import verdict_document

    definitions = wanted.definitions()
    result, project = result_at(job, path, reading, threads, fitted=False)
    if project is not None:
        declared = dict(project.features)
    else:
        declared = {} if result.features is None else result.features.definitions
    if not (definitions or declared):
        raise misuse("PATH", "no-features")
    found = fitted(result, definitions or declared, k=k, coverage=coverage)
    verdict = result.verdict
    sections, members = [features_section(found)], features_members(found)
    document = verdict_document(verdict, "Features", "", sections=sections, members=members)
    job.finish(
        {} if out is None else {out / name: each for name, each in feature_files(found).items()},
        document=document,
        summary=lambda: print_document(document, "--json FILE", "features"),
        code=verdict.exit_code(strict=strict),
    )
