"""What the verdict on data snooping rests on: that of the network without gross errors, and what is out."""

from __future__ import annotations

from dataclasses import replace

from photogram.results.snooping_result import Snooped
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Removed

__all__ = ["snooped_findings"]


@findings_of.register(Snooped)
def snooped_findings(found: Snooped) -> Findings:
    """Return the findings on the network without gross errors, and what was taken out."""
    document = found.document()
    out = [entry.is_out for entry in found.log]
    removed = [member for member, is_out in zip(document["log"], out, strict=True) if is_out]
    kept = [f"suspect, but kept: {entry.name} ({entry.kept})" for entry in found.log if entry.kept]
    rest = findings_of(found.result)
    return replace(
        rest,
        snooped=Removed(
            removed,
            images=found.share_removed("image"),
            control=found.share_removed("control"),
            rivals=found.rivals,
            exchanged=[each.sentence for each in found.exchanged],
        ),
        remarks=[*rest.remarks, *kept],
    )
