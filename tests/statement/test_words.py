"""Words of other modules on pages in another language: a key for each, and nothing in English is left."""

import html
import re
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import photogram
from photogram import Refraction, _photocore, formats
from photogram.formats import Frame
from photogram.formats.crs import axes_of
from photogram.network import Observation, Unknown
from photogram.network.refraction import Air, Water
from photogram.results import datum as datums
from photogram.results.covariance import adjusted
from photogram.results.features import KINDS as FORMS
from photogram.results.features import through
from photogram.results.grouping import observables
from photogram.results.parts import kind_words, named_observation, parts_of
from photogram.results.statement import budget
from photogram.results.statement.texts import LANGUAGES, Texts
from photogram.statistics.verdict import RULES
from photogram.words import Phrase, option_sd, phrase, table_of

PACKAGE = Path(photogram.__file__).parent
CRATE = Path(__file__).parents[2] / "crates" / "photocore" / "src"
ENGLISH, GERMAN = Texts("en"), Texts("de")
LETTERS = ("x", "y", "z", "X", "Y", "Z", "omega", "phi", "kappa")
"""Components with the same name in all languages."""


def source(module):
    return Path(module.__file__).read_text(encoding="utf-8")


def below(kind):
    for each in kind.__subclasses__():
        yield each
        yield from below(each)


def shipped(kind):
    return {each.KIND for each in below(kind) if each.KIND and each.__module__.startswith("photogram.")}


def lacking(family, names):
    return {name for name in names if f"{family}.{name}" not in table_of("de")}


def test_every_kind_of_observation_has_a_word(result):
    kinds = shipped(Observation) | shipped(Unknown)
    assert len(kinds) > 15
    names = {budget.kind_of(each) for each in kinds} | set(budget._PLURALS.values())
    names |= {"image", "images", "control", "camera", *observables(result).stations}
    assert not lacking("kind", names)
    assert GERMAN.text(kind_words("prior, distance")) == "Vorwert, Strecke"
    assert GERMAN.kind("prior, lever arm") == "Vorwerte, Hebelarm"
    assert GERMAN.kind("images, 2, x") == "Bildpunkte, 2, x"
    assert ENGLISH.kind("smoothness, 4 position coefficients") == "smoothness, 4 position coefficients"
    assert GERMAN.kind("smoothness, 4 position coefficients") == "Glattheit, 4 Positionskoeffizienten"


def test_every_component_has_a_word_or_is_a_letter():
    names = {name for each in below(Observation) for name in each.COMPONENTS}
    names |= {name for _, components in _photocore.UNKNOWNS for name, _ in components}
    names |= {
        name for crs in ("ENU:48,9", "EPSG:4978", "EPSG:25832", "EPSG:4979") for name in axes_of(crs)[0]
    }
    assert not lacking("axis", (names | {"column", "row"}) - set(LETTERS))


def test_every_verdict_datum_frame_and_reason_has_a_sentence(result):
    assert not lacking("verdict", {rule.code for rule in RULES})
    kinds = {"observations", "minimal control", "minimum constraints", "inner constraints", "relative"}
    assert not lacking("datum", kinds)
    assert not lacking("frame", ("cartesian", "topocentric", "geocentric", "geographic"))
    assert not lacking(
        "refraction", (*(f"air.{each}" for each in get_args(Air)), "water.giant", "water.snell")
    )
    assert set(get_args(Water)) == {"giant", "snell"}
    rust = "".join(path.read_text(encoding="utf-8") for path in (CRATE / "network").rglob("*.rs"))
    reasons = set(re.findall(r'Reason::\w+ => "([^"]+)"', rust))
    assert len(reasons) == 8
    assert not lacking("reason", reasons | {"rejected", "no-images", "left-out"})
    assert not lacking("quantity", (set(adjusted(result).things) - {"step"}) | {"distance", "linear"})


def test_every_test_of_a_verdict_has_a_name_in_the_language(result):
    tests = result.verdict.tests
    assert len(tests) > 8
    for test in tests:
        assert ENGLISH.text(test.kind) == str(test.kind)
        assert GERMAN.text(test.kind) != str(test.kind), test.kind


@pytest.mark.parametrize(
    ("name", "english", "german"),
    [
        (Phrase("named.image", {"point": "A on photo B", "photo": "C"}),
         "image of point A on photo B on photo C", "Bildpunkt A on photo B in Bild C"),
        (named_observation("distance", "A - B"), "distance A - B", "Strecke A - B"),
        (named_observation("prior, lever arm", "flight"),
         "prior, lever arm flight", "Vorwert, Hebelarm flight"),
        (named_observation("own kind", "A"), "own kind A", "own kind A"),
        (parts_of(["length"], named_observation("distance", "A - B")), "length of distance A - B",
         "Länge von Strecke A - B"),
        (parts_of("XY", Phrase("named.control", {"point": "R, which is held"})),
         "X, Y of control point R, which is held", "X, Y von Passpunkt R, which is held"),
        (Phrase("named.held", {"named": Phrase("named.position", {"photo": "3"})}),
         "position of photo 3 (fixed)", "Position von Bild 3, festgehalten"),
    ],
)  # fmt: skip
def test_names_of_observations_are_in_the_language_and_those_of_users_are_not(name, english, german):
    assert str(name) == ENGLISH.text(name) == english
    assert GERMAN.text(name) == german


def test_quantities_and_parameters_are_named_in_the_language(result):
    points = [Phrase("quantity.point", {"of": name}) for name in ("C01", "C02")]
    height, rotation = Phrase("axis.height"), Phrase("axis.rotation x")
    for name, english, german in (
        (
            Phrase("quantity.point", {"of": phrase("named.component", name="C08", axis=height)}),
            "point C08 height",
            "Punkt C08 Höhe",
        ),
        (Phrase("quantity.distance", {"of": "C01 C30"}), "distance C01 C30", "Strecke C01 C30"),
        (phrase("named.component", name="rig 1", axis=rotation), "rig 1 rotation x", "rig 1 Drehung x"),
        (
            Phrase("quantity.linear", {"quantities": points}),
            "linear function of point C01, point C02",
            "lineare Funktion von Punkt C01, Punkt C02",
        ),
    ):
        assert ENGLISH.text(name) == english
        assert GERMAN.text(name) == german
    assert GERMAN.observation(("image", "3", "7", "row")) == "Bildpunkt 3 7 Zeile"
    gradient = {("point", "C01"): [0, 0, 1], ("point", "C02"): [0, 0, -1]}
    found = result.statement(language="de", budgets=(gradient,), standards=("plain",))
    assert any(each["text"].startswith("lineare Funktion von Punkt C01") for each in found.sentences)


@pytest.mark.parametrize(
    ("datum", "german"),
    [
        (datums.ResultDatum("observations"), "durch die Beobachtungen gegeben"),
        (datums.ResultDatum("minimal control"), "durch gerade so viele Passpunkte gegeben, wie nötig sind"),
        (
            datums.ResultDatum("minimum constraints", (("1", "X"), ("1", "height"), ("2", "X"))),
            "minimale Bedingungen: festgehalten sind X von 1, 2; Höhe von 1",
        ),
        (
            datums.ResultDatum("inner constraints", points=("1", "2"), photos=("a",), scale=True),
            "innere Bedingungen über 2 Punkte und 1 Bild, mit dem Maßstab",
        ),
        (
            datums.ResultDatum("inner constraints", attitudes=tuple(map(str, range(9)))),
            "innere Bedingungen über 9 Drehungen",
        ),
        (
            datums.ResultDatum("relative", photos=tuple(map(str, range(14)))),
            "relativ zu 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 und noch 2",
        ),
    ],
)
def test_the_datum_is_told_in_the_language(datum, german):
    assert ENGLISH.text(datum.phrase) == str(datum)
    assert GERMAN.text(datum.phrase) == german


def test_frame_and_refraction_are_told_in_the_language():
    frame = Frame("topocentric", "EPSG:4979", (48.5, 9.25, 500.0))
    assert ENGLISH.text(frame.phrase) == str(frame)
    assert GERMAN.text(frame.phrase) == "topozentrisch in Breite 48,5, Länge 9,25, Höhe 500 (EPSG:4979)"
    for own in (
        Refraction("standard", "snell", 3.25),
        Refraction("giant"),
        Refraction(None, "giant"),
        Refraction(),
    ):
        assert ENGLISH.text(own.phrase("m")) == own.describe("m")
    said = GERMAN.text(Refraction("standard", "snell", 3.25).phrase("m"))
    assert said == (
        "Luft: Normalatmosphäre; Wasser unter 3,250 m: Brechungsgesetz von Snellius, Brechzahl 1,34"
    )
    assert GERMAN.text(Refraction().phrase("m")) == "keine"


def test_refraction_and_what_is_held_are_assumptions(result):
    block = result.block.replace(refraction=Refraction("standard"))
    sd = np.where(np.array(block.point_ids)[:, np.newaxis] == "G01", 0.0, block.point_sd)
    found = photogram.adjust(block.replace(point_sd=sd), unit_variance="unity")
    said = {
        language: {
            each["key"]: each["text"] for each in found.statement(language=language, budgets=()).assumptions
        }
        for language in LANGUAGES
    }
    assert said["en"]["assume.refraction"] == "Refraction: air: standard atmosphere."
    assert said["de"]["assume.refraction"] == "Refraktion: Luft: Normalatmosphäre."
    assert said["en"]["assume.held"] == "Assumed to be free of errors: point G01."
    assert said["de"]["assume.held"] == "Als fehlerfrei angenommen: Punkt G01."


def test_features_are_told_in_the_language(result):
    names = [f"C{k:02}" for k in range(1, 13)]
    wanted = {kind: (kind, names[:2] if kind == "distance" else names) for kind in FORMS}
    measured = []
    for name, definition in wanted.items():
        measured += photogram.features(result, {name: definition})
    assert len(measured) == len(FORMS)
    for each in measured:
        assert ENGLISH.text(through(each)) == str(through(each))
        assert not lacking("measured", [own.name for own in each.quantities])
    said = GERMAN.text(through(measured[2]))
    assert said == "Ebene durch 12 Punkte: C01, C02, C03, C04 und noch 8"


def test_a_point_that_says_nothing_has_its_reason_in_the_language(result):
    block = result.block
    images = block.image_points != block.point_ids.index("C05")
    names = ("image_photos", "image_points", "image_xy", "image_sd")
    fewer = block.replace(**{name: getattr(block, name)[images] for name in names})
    found = photogram.adjust(fewer, unit_variance="unity").statement(language="de", budgets=())
    assert "Kontrollpunkt C05 sagt nichts aus: keine Bildpunkte." in found.judged.remarks


def test_a_verdict_has_the_same_fields_in_both_languages(result, monkeypatch):
    check = Phrase("part.check", {"name": "C04", "difference": 0.3, "unit": "m", "axis": "Z", "sd": 0.1})
    message = Phrase("verdict.check-points", {"points": [check]})
    monkeypatch.setitem(
        vars(result), "verdict", replace(result.verdict, code="check-points", message=message, exit=4)
    )
    removed = Phrase("named.control", {"point": "G01"})
    found = {each: result.statement(language=each, budgets=(), removed=(removed,)) for each in LANGUAGES}
    assert found["en"].headline.endswith("1) C04, +0.3 m in Z (sd 0.1)")
    assert found["de"].headline.endswith("1) C04, +0,3 m in Z (Standardabweichung 0,1)")
    assert "Passpunkt G01" in found["de"].to_html().decode()


def test_assumptions_of_readers_are_in_the_language():
    assumed = Phrase("read.images", {"number": 0.5, "unit": "px", "option": option_sd("images")})
    for texts, number in ((ENGLISH, "0.5 px"), (GERMAN, "0,5 px")):
        assert number in texts.text(assumed)


STANDARDS = "ASPRS Positional Accuracy Standards, Edition 2"
USERS = ("a site from 100 m", "Gravel and Sand Ltd", "Survey Office", "A. Surveyor")
"""Of the packaged survey: not to be said in another language."""


def visible(page):
    """Return the text of a page, with that of its pictures."""
    bare = re.sub(r"<(script|style)[^>]*>.*?</\1>", " ", page, flags=re.DOTALL)
    labels = " ".join(re.findall(r'aria-label="([^"]*)"', bare))
    return html.unescape(re.sub(r"<[^>]+>", " ", bare)) + " " + labels


def letters(text):
    return set(re.findall(r"[a-zäöüß]{2,}", text.lower()))


def test_no_english_word_is_left_on_a_german_page():
    project = formats.read(PACKAGE / "examples" / "survey")
    adjusted_survey = photogram.adjust(project.block, unit_variance="unity")
    asked = {**project.statement, "language": "de"}
    page = visible(adjusted_survey.statement(**asked, strict=True).to_html().decode())
    for own in (*USERS, STANDARDS):
        page = page.replace(own, " ")
    known = letters(" ".join(table_of("de").values()))
    english = letters(" ".join(table_of("en").values()))
    english |= letters(source(datums))
    # What the survey calls its camera, its lever arm and its files is its own.
    own = {"drone", "flight", "photogram", "program", "cm", "cx", "cy"}
    assert not (letters(page) & english) - known - own
    assert "0.05" not in page
