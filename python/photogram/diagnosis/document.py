"""The document of a check: findings, then sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogram.diagnosis.findings import Finding, Section
from photogram.lazy_dataclasses import asdict
from photogram.messages import counted, listed
from photogram.plots.accessor import drawings
from photogram.results.result import Result
from photogram.show import page, quantity
from photogram.show.judgement import judged, verdict_table
from photogram.show.page import Document, Fact, Facts, Text
from photogram.show.quantity import Quantity, records
from photogram.statistics.verdict import Verdict

LEVELS = {"grave": "grave", "look": "to look at"}
MAX_NAMES = 6  # photos and points that a row names
MAX_FINDINGS = 200  # rows of the table of findings


def check_document(title: str, verdict: Verdict, parts: Sequence[Section], result: Result | None) -> Document:
    findings = [(finding, part.title) for part in parts for finding in part.findings]
    grave = sum(finding.level == "grave" for finding, _ in findings)
    look = len(findings) - grave
    texts = {str(finding.text) for finding, _ in findings}
    lines = [line for line in verdict.lines if str(line) not in texts]  # the table has the findings
    plan = [] if result is None else [drawings(result)["network"]]
    about = (
        "Grave findings make results wrong or impossible. Look at the others. The check corrects a mistake"
        " in memory before its next step, so that each mistake is reported once. The files are unchanged."
    )
    tests = "The tests of the adjustment without the observations that the check rejects."
    return Document(
        what="Check of a network before its adjustment",
        title=title,
        judgements=[replace(judged(verdict), lines=[*map(str, lines)])],
        advice=verdict.next,
        highlights=[
            Fact("Grave", f"{grave}", tone="bad" if grave else ""),
            Fact("To look at", f"{look}", tone="look" if look else ""),
        ],
        sections=[
            page.Section("findings", "Findings", [_findings_table(findings)] if findings else [], about),
            page.Section("network", "Plan of the network", plan),
            *(_section(number, section) for number, section in enumerate(parts)),
            page.Section("tests", "Tests", [verdict_table(verdict)] if verdict.tests else [], tests),
        ],
        members={
            "title": title,
            "grave": grave,
            "verdict": verdict.document(),
            "sections": [_members(section) for section in parts],
        },
    )


def _members(section: Section) -> dict[str, object]:
    parts = section.parts
    return {
        "title": section.title,
        "why": section.why,
        "facts": [asdict(fact) for part in parts if isinstance(part, Facts) for fact in part.facts],
        "tables": [
            {"title": part.title, "rows": records(part.columns)}
            for part in parts
            if isinstance(part, quantity.Table)
        ],
        "findings": [_finding_members(finding) for finding in section.findings],
    }


def _finding_members(finding: Finding) -> dict[str, object]:
    members = asdict(replace(finding, phrase=None))
    del members["phrase"]
    code, fields = (finding.phrase.code, finding.phrase.fields) if finding.phrase else ("", {})
    return members | {"code": code, "fields": fields}


def _section(number: int, section: Section) -> page.Section:
    count = len(section.findings)
    end = Text(f"{counted(count, 'finding')} of this part: see the table of findings.")
    parts = [*section.parts, end if count else Text("Nothing found.")]
    return page.Section(f"part-{number}", section.title, parts, section.why)


def _findings_table(findings: Sequence[tuple[Finding, str]]) -> quantity.Table:
    """Return the table of findings with section titles, grave findings first."""
    ordered = sorted(findings, key=lambda row: row[0].level != "grave")
    shown = [finding for finding, _ in ordered[:MAX_FINDINGS]]
    texts = {
        "Level": [LEVELS[each.level] for each in shown],
        "Finding": [each.text for each in shown],
        "Photos and points": [listed([*each.photos, *each.points], MAX_NAMES) for each in shown],
        "Part": [title for _, title in ordered[:MAX_FINDINGS]],
    }
    columns = [Quantity(values, kind="name", head=head) for head, values in texts.items()]
    columns[0] = replace(columns[0], marked=np.array([each.level == "grave" for each in shown]))
    rest = len(ordered) - len(shown)
    return quantity.Table("", "Findings", columns, f"The JSON document has {rest} more." if rest else "")
