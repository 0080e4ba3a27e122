"""Scanned films in parts: their unknowns go up with their photos, rolls, marks and scanners to the root."""

from dataclasses import replace

import numpy as np
import pytest
from test_blocks import agrees
from test_datum_in_parts import in_both

import photogram
from photogram import Camera, _photocore, adjust, adjust_in_parts
from photogram.distributed import Division
from photogram.distributed.cut import photos_of_unknowns
from photogram.distributed.run import read_manifest, read_node
from photogram.network import (
    Fiducial,
    Film,
    FilmBend,
    FilmPlacement,
    FilmSize,
    KnownFilm,
    KnownTogether,
    Mark,
    Mount,
    Pattern,
    Readings,
    Reseau,
    Roll,
    Scan,
    Scanner,
    Sensor,
    Weights,
)

HALF = 113.0


def readings(film, size, q):
    """Return (n, 2) what a film of some size has of places."""
    vectors = [each.position for each in film.unknowns]
    vectors[1] = size
    return _photocore.film_readings(film.numbers(), np.array(vectors), q)[0]


def of_films(strips=4, photos_per_strip=10):
    """Return a block on two rolls, of which the second bends, and one photo on a roll of its own."""
    block = photogram.simulate(
        strips=strips, photos_per_strip=photos_per_strip, points_per_photo=30, seed=7
    ).block
    random = np.random.default_rng(1)
    places = HALF * np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y])
    marks = [Mark(f"mark {k}", place) for k, place in enumerate(places.tolist())]
    scanner, counted = Scanner("scanner", sd=(4e-6, 4e-6, 6e-6)), Readings(0.02, (6000.0, 6000.0), down=True)
    patterns = [Pattern("w1 w2", HALF, [Weights(f"roll {k}", (0.0, 0.0), sd=0.006)]) for k in range(2)]
    rolls = [Roll(f"roll {k}", 0.0, 5e-4) for k in range(3)]
    xy, scans, observations = block.image_xy.copy(), [], [KnownTogether("certificate", marks, sd=0.002)]
    for row, name in enumerate(block.photo_ids):
        roll = 2 if row == 5 else row % 2
        placement = FilmPlacement(name, random.normal(0.0, [0.6, 0.6, 0.002]))
        film = Film(
            placement,
            FilmSize(name),
            scanner,
            counted,
            bend=FilmBend(name, (0.0, 0.0), 5e-7) if roll else None,
            roll=rolls[roll],
            pattern=patterns[roll % 2],
        )
        size = random.normal(0.0, 1e-4, 3)
        own = block.image_photos == row
        xy[own] = readings(film, size, block.image_xy[own])
        read = readings(film, size, places) + random.normal(0.0, 0.2, places.shape)
        scans.append(Scan(name, film))
        observations.append(KnownFilm(name, placement, film.size, film.roll, ("m", "b1", "b2"), 0.0, sd=1e-4))
        observations += [
            Fiducial(name, mark, film, each, sd=0.2) for mark, each in zip(marks, read.tolist(), strict=True)
        ]
    c = float(block.known_distances("the test")[0])
    camera = Camera("brown_forward", {"c": c, "A1": 0.0}, {"c": 0.01, "A1": 1e-8}, unit="mm")
    return block.replace(
        passages=scans,
        observations=observations,
        image_xy=xy,
        image_sd=0.5,
        cameras=[camera],
        photo_cameras=[0] * len(block.photo_ids),
        principal_distances=None,
    )


@pytest.fixture(scope="module")
def block():
    return of_films()


@pytest.fixture(scope="module")
def whole(block):
    return adjust(block)


@pytest.mark.parametrize("parts", [2, 5])
def test_films_in_parts_are_those_of_one_process(block, whole, parts):
    found = adjust_in_parts(block, Division(parts=parts))
    # Photos share an unknown camera: where one process takes a chord, parts do not.
    agrees(found, whole, 1e-7, tied=True)
    assert found.sums_of_squares.total == pytest.approx(whole.sums_of_squares.total, rel=1e-11)
    sd = whole.film_sd
    assert np.nanmax(np.abs(found.film - whole.film)[sd > 0] / sd[sd > 0]) < 1e-7
    scale = np.einsum("pi,pj->pij", sd, sd) / whole.covariance_scale
    # NaN of an m that is that of its roll, too.
    assert np.nanmax(np.abs((found.film_cofactors - whole.film_cofactors) / scale)) < 1e-7
    for one, other in zip(found.unknowns, whole.unknowns, strict=True):
        deviations = np.sqrt(np.diag(other.cofactors))
        at = np.outer(deviations, deviations)
        assert np.abs((one.cofactors - other.cofactors)[at > 0] / at[at > 0]).max(initial=0.0) < 1e-7
        np.testing.assert_allclose(one.redundancy, other.redundancy, rtol=0, atol=1e-7)
        assert one.observations == other.observations
    for name in ("residuals", "redundancy"):
        both = (getattr(each.kinds["fiducial"], name) for each in (found, whole))
        np.testing.assert_allclose(*both, rtol=0, atol=1e-6)
    assert [str(each) for each in found.messages] == [str(each) for each in whole.messages]


def test_a_node_hands_up_no_film_that_is_not_its_photos(block):
    films = photos_of_unknowns(block)
    assert len(films) == sum(2 + (each.film.bend is not None) for each in block.passages)
    shared = block.passages[0].film.scanner
    assert id(shared) not in films


def test_free_films_in_parts(block):
    """Without control the datum is that of the same photos."""
    free = block.replace(point_sd=np.full_like(block.point_sd, np.inf))
    one, other = adjust(free), adjust_in_parts(free, Division(parts=3))
    assert other.datum == one.datum
    agrees(other, one, 1e-5, tied=True)


def test_inner_constraints_of_films_in_parts(block):
    free = block.replace(point_sd=np.full_like(block.point_sd, np.inf))
    found, one = in_both(free, 3, 1e-6, datum=photogram.InnerConstraints())
    assert np.nanmax(np.abs(found.film - one.film) / one.film_sd) < 1e-6


def with_reseaus(block):
    """Return a block in which every other photo has a reseau of its own, the others the pattern of a roll."""
    grid = [-HALF, -HALF, HALF, HALF, 3, 3]
    scans, known = [], []
    for row, scan in enumerate(block.passages):
        if row % 2 == 0:
            own = Reseau(scan.photo, grid, (0.006, 0.004), 0.005)
            known.append(KnownTogether("reseau", own.weights, covariance=own.covariance))
            scan = replace(scan, film=replace(scan.film, pattern=own))
        scans.append(scan)
    return block.replace(passages=scans, observations=[*block.observations, *known])


@pytest.mark.parametrize("halves", [(), (0, 22)])
def test_reseaus_of_single_photos_in_parts(block, halves):
    """Their nodes go up as far as their photos do, and no farther."""
    changed = with_reseaus(with_halves(block, halves) if halves else block)
    one, other = adjust(changed), adjust_in_parts(changed, Division(parts=5))
    assert one.degrees_of_freedom == other.degrees_of_freedom
    assert other.sums_of_squares.total == pytest.approx(one.sums_of_squares.total, rel=1e-9)
    assert np.nanmax(np.abs(other.film_sd - one.film_sd) / one.film_sd) < 1e-6
    nodes = [pair for pair in zip(one.unknowns, other.unknowns, strict=True) if "node" in pair[0].name]
    assert len(nodes) == 9 * len(changed.passages[::2])
    for mine, parted in nodes:
        sd = np.sqrt(np.diag(mine.cofactors))
        assert np.abs((parted.position - mine.position)[:2] / sd).max() < 1e-6
        np.testing.assert_allclose(np.sqrt(np.diag(parted.cofactors)), sd, rtol=1e-6)
        assert parted.observations == mine.observations
    kinds = [each.kinds["reseau"] for each in (one, other)]
    np.testing.assert_allclose(kinds[1].redundancy, kinds[0].redundancy, rtol=0, atol=1e-7)


def test_reseaus_are_no_matter_of_the_root(block, tmp_path):
    changed = with_reseaus(block)
    adjust_in_parts(changed, Division(parts=5, folder=tmp_path))
    manifest = read_manifest(tmp_path)
    rows = [row for below in manifest.tree.children[-1] for row in manifest.outer[below].unknowns]
    names = [changed.unknowns[row].name for row in rows]
    of_root = {name.split(" node ")[0] for name in names if " node " in name}
    part = read_node(tmp_path, manifest, manifest.tree.root)
    assert 0 < len(of_root) < len(changed.passages[::2]) / 2
    assert of_root <= set(part.block.photo_ids)


def with_halves(block, rows):
    """Return a block in which the right half of some scans is a film of its own."""
    joined, own = Sensor("joined scans", np.zeros(3), np.eye(3), 0.0), list(range(len(block.photo_ids)))
    names, of = [*block.photo_ids], block.image_photos.copy()
    mounts, scans = [], [*block.passages]
    for row in rows:
        half, film = f"{names[row]} half 2", block.passages[row].film
        of[(of == row) & (block.image_xy[:, 0] >= 6000.0)] = len(names)
        mounts.append(Mount(half, names[row], joined))
        placement, size = FilmPlacement(half, film.placement.position), FilmSize(half, (0.0, 0.0, 0.0), 1e-4)
        scans.append(Scan(half, replace(film, placement=placement, size=size)))
        names.append(half)
        own.append(row)
    arrays = ("photo_positions", "photo_attitudes", "photo_position_sd", "photo_attitude_sd", "photo_cameras")
    changes = {name: np.array(getattr(block, name))[own] for name in arrays}
    return block.replace(photo_ids=names, image_photos=of, mounts=mounts, passages=scans, **changes)


def test_halves_of_joined_scans_in_parts(block):
    changed = with_halves(block, (0, 22))
    one, other = adjust(changed), adjust_in_parts(changed, Division(parts=3))
    assert one.degrees_of_freedom == other.degrees_of_freedom
    assert other.sums_of_squares.total == pytest.approx(one.sums_of_squares.total, rel=1e-9)
    assert np.nanmax(np.abs(other.film - one.film) / one.film_sd) < 1e-6
    assert np.nanmax(np.abs(other.film_sd - one.film_sd) / one.film_sd) < 1e-6


def test_films_in_parts_are_scaled_by_their_redundancy_numbers(block):
    options = {"unit_variance": "redundancy", "tolerance": 1e-8}
    one, other = adjust(block, **options), adjust_in_parts(block, Division(parts=3), **options)
    assert other.variance_of_unit_weight == pytest.approx(one.variance_of_unit_weight, rel=1e-9)
    assert np.nanmax(np.abs(other.film_sd - one.film_sd) / one.film_sd) < 1e-6
