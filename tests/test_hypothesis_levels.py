"""Levels of all hypotheses without an error, by Monte Carlo: their p-values have a uniform distribution."""

from collections import defaultdict

import numpy as np
import pytest
from scipy.stats import kstest

from dense_network import Survey
from photogram import adjust
from test_dense_hypotheses import SETS, SINGLE

RUNS = 150
OF_WEIGHTED = frozenset({"position", "attitude", "camera", "camera-radial"})
OF_OBSERVED = frozenset({"camera-f", "camera-term", "camera-size", "camera-f-single"})
"""Codes of networks with weighted photos and camera only, and with observed poses and fixed cameras only."""


@pytest.mark.parametrize(
    ("weighted", "few", "known"),
    [
        (False, False, True),
        (False, False, False),
        (True, False, True),
        (False, True, False),
        (True, True, False),
    ],
)
def test_p_values_are_uniform_without_an_error(weighted, few, known):
    """The unit weight is known or estimated, with `few` of fewer than fifty degrees of freedom."""
    found, rng = defaultdict(list), np.random.default_rng(2)
    survey = Survey(weighted=weighted, **({"photos_per_strip": 2, "points": 11, "rays": 2} if few else {}))
    for _ in range(RUNS):
        block = survey.block(rng)
        result = adjust(block)
        trial = result._trial()
        trial.stand()
        omega, freedom = result.sum_and_freedom
        estimated = None if known else (omega, freedom)
        tested = trial.core.hypotheses(**survey.facts(block, estimated=estimated, effects=0))
        for place in np.flatnonzero((tested["rank"] > 0) & (tested["redundancy"] > 1e-6)).tolist():
            found[tested["code"][place], place].append(tested["probability"][place])
    assert (freedom < 50) is few
    others = OF_OBSERVED if weighted else OF_WEIGHTED
    assert {code for code, _ in found} == {*SETS, *SINGLE, "observation"} - others
    least = min(kstest(values, "uniform").pvalue for values in found.values())
    assert least > 0.01 / len(found), (least, len(found))
