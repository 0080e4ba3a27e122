"""Tables and plots mark the outliers of the verdict, and no other observations."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import photogram
from photogram import collection, formats
from photogram.results import tables as table
from photogram.words import Phrase

PLOT = import_module("photogram.plots.tests")  # the package has a function with this name
EXAMPLES = Path(photogram.__file__).parent / "examples"
SINGLE = {"test.images": "test.image_coordinates", "test.control": "test.components_of_control"}
"""Kinds of components by kinds of groups."""


def disturbed(block, factor):
    """Return a block with errors of ten standard deviations in ten images and scaled standard deviations."""
    xy = block.image_xy.copy()
    xy[5 :: max(len(xy) // 10, 1), 0] += 10 * factor * block.image_sd[5 :: max(len(xy) // 10, 1), 0]
    return block.replace(image_xy=xy, image_sd=factor * block.image_sd)


def of_project(name, change=lambda block: block):
    return photogram.adjust(change(formats.read(EXAMPLES / name).block))


RESULTS = {
    "project": lambda: of_project("project"),
    "survey": lambda: of_project("survey"),
    "rolling shutter": lambda: of_project("rolling"),
    "gross errors": lambda: of_project("project", lambda block: disturbed(block, 1.0)),
    "gross errors, small standard deviations": lambda: of_project(
        "project", lambda block: disturbed(block, 0.3)
    ),
    "small standard deviations": lambda: of_project(
        "project", lambda block: block.replace(image_sd=block.image_sd / 3)
    ),
    "robust": lambda: photogram.adjust(
        disturbed(formats.read(EXAMPLES / "project").block, 1.0), loss="huber"
    ),
    "collection": lambda: collection.adjust(collection.simulate(seed=1).collection),
}


@pytest.fixture(scope="module", params=RESULTS)
def result(request):
    return RESULTS[request.param]()


def assert_counts(verdict):
    """Compare the counts in messages with the outliers of the verdict."""
    assert {line.fields["kind"]: line.fields["n"] for line in verdict.outliers} == {
        kind: len(places) for kind, places in verdict.outlying.items()
    }
    if verdict.code == "gross-errors":
        suspects = verdict.message.fields["suspects"][-1].fields
        assert len(suspects["tests"]) == sum(map(len, verdict.outlying.values()))


def assert_marks(result):
    """Compare the marked rows of the table of the worst observations with the outliers of the verdict."""
    tests_of = table.Tests(result)
    every = {each.kind: each for each in tests_of.components}
    marked = dict(zip(every, tests_of.outliers, strict=True))
    tests = next(each for each in result.document().table("worst").columns if each.marked is not None)
    sizes = np.concatenate([np.nan_to_num(np.abs(each.values)).ravel() for each in every.values()])
    flags = np.concatenate([each.ravel() for each in marked.values()])
    order = np.argsort(-sizes, kind="stable")
    assert tests.marked.sum() == flags[order[: len(tests.values)]].sum()
    for kind, own in marked.items():
        groups = next((group for group, single in SINGLE.items() if single == kind.code), None)
        if groups is not None:
            rows = {place[0] for place in result.verdict.outlying.get(Phrase(groups), ())}
            rows |= {place[0] for place in result.verdict.outlying.get(kind, ())}
            assert set(np.flatnonzero(own.any(axis=1)).tolist()) == rows


def test_a_message_counts_the_outliers_of_its_kind(result):
    assert_counts(result.verdict)


def test_the_table_of_the_worst_marks_outliers_only(result):
    assert_marks(result)


def test_simulated_errors_are_judged_once():
    """In 200 blocks with up to three errors in images, and some in control, all marks are outliers."""
    codes = set()
    for seed in range(200):
        rng = np.random.default_rng(seed)
        block = photogram.simulate(strips=2, photos_per_strip=3, points_per_photo=12, seed=seed).block
        xy, positions = block.image_xy.copy(), block.point_positions.copy()
        for row in rng.integers(len(xy), size=seed % 4):
            xy[row, rng.integers(2)] += rng.uniform(5, 30) * block.image_sd[row, 0]
        if seed % 5 == 0:
            control = rng.choice(np.flatnonzero(np.isfinite(block.point_sd).all(axis=1)))
            positions[control, rng.integers(3)] += 1.0
        result = photogram.adjust(block.replace(image_xy=xy, point_positions=positions))
        assert_counts(result.verdict)
        assert_marks(result)
        codes.add(result.verdict.code)
    assert {"accepted", "gross-errors"} <= codes


def test_the_plot_of_tests_marks_outliers_only(result):
    drawn = result._plot_data()
    masks = zip(table.Tests(result).outliers, drawn.tested, strict=True)
    count = sum(int((own & np.isfinite(each.values)).sum()) for own, each in masks)
    labels = [getattr(mark, "label", "") for mark in PLOT.tests(result).panels[1].marks]
    assert (f"outliers of the verdict ({count:,})" in labels) == (count > 0)


def test_the_table_of_tests_has_all_columns_for_every_type(result):
    rows = result.test_table()
    statistic = "w" if "w" in rows else "t"
    assert np.isfinite(rows[["residual", "sd", "redundancy"]]).all(axis=None)
    tested = rows[np.isfinite(rows[statistic])]
    assert ((tested.p >= 0) & (tested.p <= 1) & np.isfinite(tested.detectable)).all()
    if statistic == "w":
        assert np.allclose(tested.w, tested.residual / tested.sd / np.sqrt(tested.redundancy), rtol=1e-6)
        assert np.allclose(tested.detectable, tested.sd * np.sqrt(17.0746 / tested.redundancy), rtol=1e-4)
    tests = table.Tests(result)
    marked = zip(tests.outliers, tests.components, strict=True)
    assert rows.outlier.sum() == sum(own[each.observed].sum() for own, each in marked)
