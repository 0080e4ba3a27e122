"""What verdicts on data snooping and on variance components rest on: the adjustment, and more."""

from __future__ import annotations

import math
from dataclasses import replace

from photogram.results.components import VarianceComponents
from photogram.results.snooped import Snooped
from photogram.show.ways import findings_of
from photogram.statistics.findings import Findings, GroupFactor, Removed

__all__ = ["components_findings", "snooped_findings"]


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
        ),
        remarks=[*rest.remarks, *kept],
    )


@findings_of.register(VarianceComponents)
def components_findings(found: VarianceComponents) -> Findings:
    """Return the findings on the network as it was given, and the components of its groups."""
    factors = [
        GroupFactor(
            group=each.name,
            factor=each.factor_of_sd,
            interval=(math.sqrt(each.interval[0]), math.sqrt(each.interval[1])),
            significant=each.worth_changing,
        )
        for each in found.components
        if not each.held
    ]
    return replace(findings_of(found.first), components=factors)
