"""The words of statements: one table a language, the same keys and fields in all."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import photogram.results.statement as package
from photogram import words
from photogram.results.statement.texts import LANGUAGES, Texts, fields_of
from photogram.show.page import decimals_of
from photogram.words import table_of

SOURCES = Path(package.__file__).parent


@pytest.mark.parametrize("language", LANGUAGES)
def test_languages_have_the_same_keys_and_fields(language):
    english, own = table_of("en"), table_of(language)
    families = {key.partition(".")[0] for key in own}
    # Only the statement has other languages: they lack whole families, such as input errors.
    assert sorted(own) == sorted(key for key in english if key.partition(".")[0] in families)
    for key, sentence in own.items():
        # A type may have one word for any count in one of the languages.
        counted = {"n"} if key.startswith("kind.") else set()
        assert fields_of(sentence) | counted == fields_of(english[key]) | counted, key
    assert Texts(language).missing == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_file_of_words_is_toml(language):
    source = Path(words.__file__).with_name(f"{language}.toml")
    assert tomllib.loads(source.read_text(encoding="utf-8")) == table_of(language)


def test_every_key_that_is_said_stands_in_the_table():
    """Keys in the sources, with what is put into them as a pattern; and no sentence that nobody says."""
    text = "".join(path.read_text(encoding="utf-8") for path in SOURCES.glob("*.py"))
    said = set(re.findall(r'"((?:[a-z]+\.)[a-z_{}. +()\w]*)"', text)) | set(
        re.findall(r'f"([a-z]+\.\{.*?\}.*?)"', text)
    )
    for key in re.findall(r'texts\("([a-z0-9_.]+)"', text):
        assert key in table_of("en"), key
    assert len(said) > 20


def test_numbers_are_those_of_the_language():
    english, german = Texts("en"), Texts("de")
    assert english.number(-1234567.891, 2) == "−1 234 567.89"
    assert german.number(1234.5, 1) == "1234,5"
    assert german.number(0.05, 3) == "0,050"
    assert german.number(float("nan"), 1) == "–"
    assert english.length(0.034) == "3.4 cm"
    assert english.length(0.0052) == "5.2 mm"
    assert english.size(0.05) == "5 cm"
    assert Texts("en", unit="ft").length(0.1) == "0.10 ft"
    assert german.day("2026-11-25") == "25.11.2026"
    assert german.day("im Herbst") == "im Herbst"


def test_a_firm_puts_its_own_sentence_in_the_place_of_one():
    own = Texts("de", {"honest.yes": "Faktor {factor}."})
    assert own("honest.yes", n=3, factor="1,1", low="1", high="2") == "Faktor 1,1."


def test_tables_keep_two_figures_of_the_smallest_deviation_or_of_the_median():
    deviations = np.array([0.0012, 0.034, 5.6, np.nan, 0.0])
    assert decimals_of(deviations) == 3
    assert decimals_of(deviations, smallest=True) == 4
    assert decimals_of(1e-9 * deviations, smallest=True, most=6) == 6
    assert decimals_of(np.array([np.nan, 0.0]), unknown=3) == 3
