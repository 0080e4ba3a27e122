"""What stands on top of the report of a check, and what does not belong there."""

import numpy as np
import pytest

import photogram
from photogram.show.page import Facts
from photogram.show.quantity import Table


@pytest.mark.parametrize("feet", [False, True])
def test_the_page_says_what_the_verdict_says(feet):
    block = photogram.simulate(strips=2, photos_per_strip=5, seed=3).block
    if feet:
        block = block.replace(point_positions=block.point_positions * [1, 1, 1 / 0.3048])
    found = photogram.diagnose(block)
    page = found.document()
    (judgement,) = page.judgements
    assert judgement.headline == found.verdict.headline
    assert judgement.tone == ("bad" if feet else "look" if found.verdict.warning else "good")
    assert (found.verdict.exit == 3) == feet
    (tests,) = [section for section in page.sections if section.key == "tests"]
    (table,) = tests.parts
    assert isinstance(table, Table)
    assert len(table.columns[0].values) == len(found.verdict.tests) > 3


def test_iterations_are_no_findings():
    block = photogram.simulate(strips=2, photos_per_strip=5, seed=3).block
    found = photogram.diagnose(block)
    (numbers,) = [section for section in found.sections if section.title == "Key numbers"]
    squares = [each.weighted_sum_of_squares for each in found.result.iterations]
    facts = [fact for part in numbers.parts if isinstance(part, Facts) for fact in part.facts]
    (fact,) = [fact for fact in facts if fact.name.lower().startswith("weighted sum of squares")]
    assert np.allclose(
        [float(part) for part in fact.value.split(",")],
        [found.result.initial_weighted_sum_of_squares, squares[-1]],
        rtol=1e-3,
    )
