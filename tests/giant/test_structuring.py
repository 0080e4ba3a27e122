"""Data structuring: GIANT guide, Appendix A; specification, section 8."""

import json
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from photogram import adjust, simulate
from photogram.network import structure

GOLDEN = json.loads((Path(__file__).parents[1] / "data" / "giant" / "golden_cases.json").read_text())
SIX = GOLDEN["bandwidth_six_photos"]


def images_of(photos):
    """Photo and point of each image, for the points on each photo."""
    pairs = [(photo, point) for photo, points in enumerate(photos) for point in points]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2).T


def literal_sets(photos):
    """Order the parameter sets by the guide's two rules, read literally."""
    sets = []
    for points in photos:
        for point in points:
            observing = [photo for photo, own in enumerate(photos) if point in own]
            wanted = [(kind, photo) for photo in observing for kind in ("position", "attitude")]
            sets += [each for each in [*wanted, ("point", point)] if each not in sets]
    return sets


def literal_bandwidths(photos):
    """Naive and effective bandwidth by following every set through the matrix."""
    sets = literal_sets(photos)
    seen = {point: {p for p, own in enumerate(photos) if point in own} for own in photos for point in own}

    def correlated(one, other):
        if "point" == one[0] == other[0]:
            return one == other
        if one[0] == "point":
            return other[1] in seen[one[1]]
        if other[0] == "point":
            return one[1] in seen[other[1]]
        return any({one[1], other[1]} <= observing for observing in seen.values())

    last = [max(j for j, other in enumerate(sets) if correlated(one, other)) for one in sets]
    naive = max(end - start + 1 for start, end in enumerate(last))
    effective = 0
    for at in range(len(sets)):
        stored = [i for i in range(at + 1) if last[i] >= at and sets[i][0] != "point"]
        effective = max(effective, len(stored) + (sets[at][0] == "point"))
    return naive, effective


@pytest.mark.giant("8", "parameter sets of three")
def test_section_8_the_order_of_the_parameter_sets():
    photos = list(SIX["photos"].values())
    sets = structure(*images_of(photos)).sets()
    names = [f"P{index}" if kind == "point" else f"C{index + 1} {kind}" for kind, index in sets]
    assert names == SIX["order"]


@pytest.mark.giant("8", "six photos: naive bandwidth 9")
@pytest.mark.giant("8", "six photos: effective bandwidth 7")
@pytest.mark.giant("15", "six-photo bandwidth")
def test_section_8_the_bandwidths_of_six_photographs():
    structured = structure(*images_of(list(SIX["photos"].values())))
    assert structured.naive_bandwidth == SIX["naive_bandwidth"] == 9
    assert structured.effective_bandwidth == SIX["effective_bandwidth"] == 7


@pytest.mark.giant("8", "photos 1 and 6 exchanged: 17 and 11")
def test_section_8_two_photographs_exchanged():
    expected = SIX["photos_1_and_6_exchanged"]
    first, *middle, last = SIX["photos"].values()
    for structured in (
        structure(*images_of([last, *middle, first])),
        structure(*images_of([first, *middle, last]), order=np.array([5, 1, 2, 3, 4, 0])),
    ):
        assert structured.naive_bandwidth == expected["naive_bandwidth"] == 17
        assert structured.effective_bandwidth == expected["effective_bandwidth"] == 11


@pytest.mark.giant("8", "K sets: (K-1)/2 photographs")
@pytest.mark.parametrize("span", [1, 2, 5])
def test_section_8_what_fits_into_k_sets(span):
    # Every point lies on `span` + 1 consecutive photographs: ties with `span` photographs on either side.
    photos = [[100 * first for first in range(photo - span, photo + 1)] for photo in range(20)]
    structured = structure(*images_of(photos))
    k = structured.effective_bandwidth
    assert (k - 1) // 2 == span + 1
    assert structured.overflow(k) is None
    assert structured.overflow(k - 1) is not None


@pytest.mark.giant("8", "frames in FRAMES order, points in input order")
@pytest.mark.giant("8", "effective bandwidth: open station sets + 1")
@settings(max_examples=200, deadline=None)
@given(st.lists(st.lists(st.integers(0, 7), unique=True, min_size=1, max_size=5), min_size=1, max_size=6))
def test_section_8_bandwidths_are_those_of_the_literal_rules(photos):
    structured = structure(*images_of(photos))
    assert structured.sets() == literal_sets(photos)
    assert (structured.naive_bandwidth, structured.effective_bandwidth) == literal_bandwidths(photos)


@pytest.mark.giant("8", "the span between first and last appearance of a point counts")
def test_section_8_one_name_for_two_points_widens_the_band():
    photos = [[10 * photo, 10 * photo + 10, 10 * photo + 20] for photo in range(40)]
    assert structure(*images_of(photos)).effective_bandwidth == 7
    photos[0].append(7), photos[39].append(7)
    structured = structure(*images_of(photos))
    assert structured.effective_bandwidth == 9
    overflow = structured.overflow(7)
    assert (overflow.point, overflow.photos, overflow.photo) == (7, [0, 1, 2], 39)


def test_nothing_has_no_bandwidth():
    structured = structure(*images_of([]))
    assert (structured.naive_bandwidth, structured.effective_bandwidth, structured.sets()) == (0, 0, [])
    assert structured.overflow(1) is None


@pytest.mark.speed
def test_a_million_images_are_structured_in_two_seconds():
    rng = np.random.default_rng(4)
    photos = np.repeat(np.arange(5000), 200)
    points = np.repeat(np.arange(5000) * 67, 200) + np.tile(rng.permutation(200), 5000)
    start = time.process_time()
    structured = structure(photos, points)
    assert structured.effective_bandwidth == 2 * 3 + 1
    assert time.process_time() - start < 2


@pytest.mark.giant("8", "automatic order and the bandwidth of the input order")
def test_section_8_the_program_finds_a_better_order_by_itself():
    block = simulate(strips=1, photos_per_strip=30, points_per_photo=20, seed=2).block
    shuffled = np.random.default_rng(6).permutation(30)
    block = block.replace(
        image_photos=shuffled[block.image_photos],
        **{
            name: getattr(block, name)[np.argsort(shuffled)]
            for name in ("photo_positions", "photo_attitudes", "photo_position_sd", "photo_attitude_sd")
        },
    )
    result = adjust(block)
    assert result.ordering == "rcm"
    assert sorted(result.photo_order.tolist()) == list(range(30))
    given = structure(block.image_photos, block.image_points)
    chosen = structure(block.image_photos, block.image_points, result.photo_order)
    assert chosen.effective_bandwidth < given.effective_bandwidth / 2


@pytest.mark.giant("8", "automatic order and the bandwidth of the input order")
def test_section_8_the_report_shows_both_bandwidths(small_block):
    result = adjust(small_block)
    work = result.report().split("\nWork\n")[1]
    for name, order in (("of the input", None), ("chosen", result.photo_order)):
        found = structure(small_block.image_photos, small_block.image_points, order)
        line = next(line for line in work.splitlines() if f"in the order {name}" in line)
        assert f" {found.effective_bandwidth} effective, {found.naive_bandwidth} without sharing" in line
