"""What the verdict on an adjusted collection rests on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogram.collection.fixed_tests import collection_held
from photogram.collection.result import AdjustedCollection
from photogram.results.findings import network_findings
from photogram.results.patterns import CameraImages, patterns
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings

__all__ = ["collection_findings"]

NO_DATUM = (
    "Nothing gives the network a datum: shapes and relative precision can be used, absolute positions and the"
    " scale mean nothing."
)


@findings_of.register(AdjustedCollection)
def collection_findings(result: AdjustedCollection) -> Findings:
    """Return the tests of a collection.

    Standard deviations of pixels are guesses: single observations are tested against all others.
    """
    together = CameraImages("the cameras", np.ones(len(result.photo_parameters), dtype=bool), 0)
    return replace(
        network_findings(result, collection_held(result), patterns(result, [together])),
        check="`photogram.diagnose` of the collection",
        take_out="`--snoop` (`photogram.snoop`) takes gross errors out one after the other; `--loss huber`"
        " or `cauchy` lowers their weights.",
        if_usable=[NO_DATUM] if result.datum else [],
    )
