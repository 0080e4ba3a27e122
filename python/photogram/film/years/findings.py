"""What the verdict on cameras over years rests on."""

from __future__ import annotations

import numpy as np

from photogram.film.years.comparison import CameraComparison
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.history import changed_of, unchanged_of

__all__ = ["comparison_findings"]


@findings_of.register(CameraComparison)
def comparison_findings(comparison: CameraComparison) -> Findings:
    """Return the tests of what should not have changed."""
    histories = comparison.histories
    # What changes explain is not tested once more.
    quiet = [
        (whose, history, own)
        for whose, history in histories.items()
        for own in history.series
        if not own.changes
    ]
    places = [
        f"{own.name} of {whose} on {occasion}"
        for whose, history, own in quiet
        for occasion in history.occasions
    ]
    values = np.concatenate([own.off / own.off_sd for *_, own in quiet] or [np.zeros(0)])
    return Findings(
        status="converged",
        observations=[Tested("values beside those of the others", values, lambda at: places[at[0]], "w")],
        degrees_of_freedom=sum(own.constancy.degrees_of_freedom for own in histories.values()),
        untested="each camera has a test of constancy of its own",
        changed=changed_of(histories),
        systematic=[own.systematic(whose) for whose, own in histories.items()],
        remarks=[*unchanged_of(histories), *comparison.remarks],
        if_withheld=[
            "Take each photo with the certificate of its time: what lies between must be found out."
        ],
    )
