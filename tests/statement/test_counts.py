"""Sentences with a count of one: another form in every language."""

import re

import numpy as np
import pytest

import photogram
from photogram.results.statement.texts import LANGUAGES, Texts, fields_of, table_of

COUNTS = ("n", "lines", "beyond", "least", "f")
"""Fields that count, and may be one."""
PLURALS = {
    "en": r"\b1 (check points|lengths|lines|observations|degrees)\b|\b1 [\w ]+ (agree|lie|were|exceed)\b",
    "de": r"\b1 (Kontrollpunkten?|Längen|Messlinien|Beobachtungen|Freiheitsgraden?)\b|\b1 \w+ liegen\b",
}
NEVER_ONE = ("asprs.tested.h", "asprs.tested.v", "asprs.tested.3d", "asprs.tested.vva")
"""Thirty points or more."""


def sentences(language):
    """Return the sentences of a language, without the families that only English has: errors of input."""
    families = {key.partition(".")[0] for key in table_of("de")}
    return {key: text for key, text in table_of(language).items() if key.partition(".")[0] in families}


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_sentence_counts_one_of_several(language):
    texts, tried = Texts(language), 0
    for key, sentence in sentences(language).items():
        fields = fields_of(sentence)
        counts = sorted(fields & set(COUNTS))
        if key in NEVER_ONE or not counts:
            continue
        # One length is on one line, whatever else is counted.
        for ones in [counts, *([name] for name in counts if name != "n")]:
            values = {name: 1 if name in ones else 7 for name in counts}
            said = texts(key, **(dict.fromkeys(fields, "x") | values))
            assert not re.search(PLURALS[language], said), (key, said)
            tried += 1
    assert tried > 20


def test_a_firms_sentence_holds_for_every_count():
    own = Texts("en", {"honest.yes": "Points: {n}."})
    assert own("honest.yes", n=1, factor=1.0, low=1.0, high=1.0) == "Points: 1."
    both = Texts("en", {"honest.yes": "{n:One point/Points: {n}}."})
    values = {"factor": 1.0, "low": 1.0, "high": 1.0}
    assert both("honest.yes", n=1, **values) == "One point."
    assert both("honest.yes", n=2, **values) == "Points: 2."


@pytest.fixture(scope="module")
def with_one(result):
    """Adjust the golden block with one check point, which hardly tests the scale."""
    block = result.block
    kept = np.isfinite(block.point_sd).any(axis=1) | (np.array(block.point_ids) == "C08")
    positions = np.where(kept[:, np.newaxis], block.point_positions, np.nan)
    sd = np.where(kept[:, np.newaxis], block.point_check_sd, np.nan)
    block = block.replace(point_positions=positions, point_check_sd=sd)
    return photogram.adjust(block, unit_variance="unity").with_max_bias_ratio(50.0)


@pytest.mark.parametrize(
    ("language", "said", "headline"),
    [
        (
            "en",
            [
                "With only 1 check point, fewer than the 30 of the standard, it is not decided",
                "Tested by 1 check point: vertical accuracy",
                "1 check point agrees with the standard deviations",
                "The standard asks for 30 check points; at hand: 1.",
                "1 check point; diagonal of the block",
                "The only length has an error of",
            ],
            "Accuracy as found with 1 check point",
        ),
        (
            "de",
            [
                "Mit nur 1 Kontrollpunkt, weniger als den 30 des Standards, ist nicht entschieden",
                "Mit 1 Kontrollpunkt geprüft: Höhengenauigkeit",
                "1 Kontrollpunkt stimmt mit den Standardabweichungen überein",
                "Der Standard verlangt 30 Kontrollpunkte; vorhanden: 1.",
                "1 Kontrollpunkt; Diagonale des Blocks",
                "Die einzige Länge hat eine Abweichung von",
            ],
            "Genauigkeit, wie sie sich an 1 Kontrollpunkt ergab",
        ),
    ],
)
def test_one_check_point_and_one_length_are_told_in_the_singular(with_one, language, said, headline):
    one, other = (with_one.point_positions[with_one.block.point_ids.index(name)] for name in ("G01", "G02"))
    length = float(np.linalg.norm(one - other))
    found = with_one.statement(
        language=language,
        standards=("asprs-2023", "nssda", "vdi-2634"),
        classes={"h": 0.1},
        lengths=[{"line": "a", "from": "G01", "to": "G02", "length": length, "sd": 0.01}],
        budgets=(),
    )
    told = [text for _, text in (*found.judged.sentences, *found.judged.assumptions)] + found.judged.remarks
    for each in said:
        assert any(each in text for text in told), (each, told)
    assert not any(re.search(PLURALS[language], text) for text in told)
    plain = with_one.statement(language=language, standards=("plain",), budgets=())
    assert plain.headline == headline
