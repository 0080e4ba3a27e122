"""What is told of one step beside two: text, JSON document, page."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.film.steps import StepsCompared
from photogram.io import json
from photogram.messages import counted
from photogram.show.cells import page_table
from photogram.show.judgement import judged
from photogram.show.lines import fact_lines, field, table_lines
from photogram.show.methods import document_of, page_of, report_of
from photogram.show.page import Fact, Page, Section
from photogram.show.quantity import Axis, Quantity, records
from photogram.show.sections import composed, headline, verdict_sections

__all__ = ["steps_document", "steps_page", "steps_text"]

WHAT = "Films inside the adjustment, and fitted before"
_WHY = (
    "Fitted before, films are taken as errorless, and so are marks, certificate and scanner: standard"
    " deviations leave these errors out, and tests of marks there are none. The figures are a priori."
)


def _said(found: StepsCompared) -> str:
    return found.sentence[:1].upper() + found.sentence[1:]


def _axes(found: StepsCompared) -> list[Quantity]:
    """Return what of each coordinate is compared."""
    unit = (Axis.of("", found.inside.block.linear_unit),)
    own = found.sd[0]
    size = found.difference / own
    worst = np.abs(size).argmax(axis=0)
    names = [found.inside.block.point_ids[found.rows[row]] for row in worst.tolist()]
    rms = np.sqrt(np.mean(found.difference**2, axis=0))
    return [
        Quantity([*"XYZ"], kind="name", member="axis", head="Axis"),
        Quantity(found.median_sd[0], unit, "value", member="sd_inside", head="sd, one step"),
        Quantity(found.median_sd[1], unit, "value", member="sd_before", head="sd, two steps"),
        Quantity(found.percent, member="percent", head="Two steps, %", decimals=2),
        Quantity(rms, unit, "value", member="rms_difference", head="rms difference"),
        Quantity(
            size[worst, range(3)], member="largest_in_sd", head="Largest, in sd of one step", decimals=2
        ),
        Quantity(names, kind="name", member="largest_at", head="At"),
    ]


def _facts(found: StepsCompared) -> list[Fact]:
    facts = []
    for name, result in (("one step", found.inside), ("two steps", found.before)):
        test = result.global_test
        if test is not None:
            low, high = test.limits
            expected = f"expected {low:.3g} to {high:.3g}"
            facts.append(Fact(f"Unit variance, {name}", f"{test.variance:.4g}", note=expected))
    return [*facts, Fact("Points compared", counted(len(found.rows), "point"))]


@report_of.register(StepsCompared)
def steps_text(found: StepsCompared) -> str:
    """Return the comparison as text."""
    axes, one, two, percent, rms, largest, at = _axes(found)
    form = {"form": ".5g"}
    lines = table_lines(
        [
            *field(axes, 6, head="axis"),
            *field(one, 14, **form, head="one step {unit}"),
            *field(two, 15, **form, head="two steps {unit}"),
            *field(percent, 9, ".2f", "%"),
            *field(rms, 15, **form, head="differ rms {unit}"),
            *field(largest, 14, ".2f", "most, in sd"),
            *field(at, 0, head="at", gap="  "),
        ]
    )
    said = f"{_said(found)}."
    sections = [
        *verdict_sections(found.inside.verdict)[:1],
        (WHAT, [said, "", "medians of standard deviations; by how much two steps differ from one", *lines]),
        ("Both", fact_lines(_facts(found))),
    ]
    return composed(headline("film", found.inside.block.title), sections)


@document_of.register(StepsCompared)
def steps_document(found: StepsCompared) -> bytes:
    """Return the comparison as JSON."""
    sums = {"inside": found.inside, "before": found.before}
    document = {
        "program": f"photogram {_photocore.__version__}",
        "kind": "film",
        "verdict": found.inside.verdict.document(),
        "said": found.sentence,
        "unit": found.inside.block.linear_unit,
        "points": len(found.rows),
        "axes": records(_axes(found)),
        "sums": {
            name: dict(zip(("sum_of_squares", "degrees_of_freedom"), own.sum_and_freedom, strict=True))
            for name, own in sums.items()
        },
    }
    return json.to_json(document)


@page_of.register(StepsCompared)
def steps_page(found: StepsCompared) -> Page:
    """Return the comparison for the browser."""
    verdict = found.inside.verdict
    return Page(
        what=WHAT,
        title=found.inside.block.title,
        judgements=[judged(verdict, "films inside the adjustment")],
        advice=[],
        highlights=_facts(found),
        sections=[Section("points", "Points", [page_table(_said(found), _axes(found))], _WHY)],
    )
