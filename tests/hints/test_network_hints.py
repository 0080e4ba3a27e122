"""Hints: every mistake of the specification made on purpose, and good data that get none."""

import mistakes
import numpy as np
import pytest

from example_scripts import load
from message_codes import as_check, nested_codes
from photogram import Camera, Distance, InputError, RankError, Spheroid, adjust, diagnose, simulate
from photogram.diagnosis.after_adjustment import errors_explained
from photogram.diagnosis.conventions import hints, verdicts
from photogram.diagnosis.predictions import eligible, misfits, regressions, spread, view
from photogram.giant import Project, write_project
from photogram.network import project
from photogram.network.rays import image_directions, seen_without_lenses
from photogram.words import Phrase

IDENTITY = [[1, 0], [0, 1]]
Y_DOWN, TURNED, MIRRORED = [[1, 0], [0, -1]], [[-1, 0], [0, -1]], [[-1, 0], [0, 1]]
EXCHANGED, QUARTER = [[0, 1], [1, 0]], [[0, -1], [1, 0]]

TABLE = {
    "none": ((1.00, IDENTITY, 0.007, 0.04), (1.01, IDENTITY, 0.03, 0.19)),
    "pixels": ((166, Y_DOWN, 0.007, None), (169, Y_DOWN, 0.03, None)),
    "y down": ((1.00, Y_DOWN, 0.007, 1.5), (1.01, Y_DOWN, 0.03, 1.4)),
    "sign of c": ((1.00, TURNED, 0.007, 2.1), (1.01, TURNED, 0.03, 2.0)),
    "mirrored": ((1.00, MIRRORED, 0.007, 1.6), (1.01, MIRRORED, 0.03, 1.4)),
    "x, y exchanged": ((1.00, EXCHANGED, 0.007, 1.5), (1.01, EXCHANGED, 0.03, 1.5)),
    "kappa + 90": ((1.00, QUARTER, 0.007, 1.5), (1.01, QUARTER, 0.03, 1.4)),
    "degrees as radians": ((0.01, None, 0.95, 41), (0.3, None, 0.25, 9.6)),
    "radians as degrees": ((1.01, IDENTITY, 0.014, 0.10), (0.9, None, 0.07, 2.7)),
    "photo-to-ground": ((1.02, IDENTITY, 0.026, 0.21), (0.9, None, 0.08, 2.7)),
    "feet": ((3.4, IDENTITY, 0.03, 1.3), (3.3, IDENTITY, 0.06, 0.74)),
    "feet in heights": ((3.3, IDENTITY, 0.02, 0.74), (2.8, IDENTITY, 0.08, 1.6)),
    "t in photo axes": ((1.1, TURNED, 0.08, 3.3), (0.8, TURNED, 0.18, 3.3)),
    "X, Y exchanged": ((1.0, IDENTITY, 0.06, 2.0), (0.85, IDENTITY, 0.10, 2.0)),
}
"""k, V, e, m of the specification on aerial.json and selfcal.json, the median of five photos."""

LOOKED_AT = {"aerial": [0, 1, 2, 3, 4], "selfcal": [0, 1, 9, 10, 11]}
"""The first five in the alphabet."""


@pytest.mark.parametrize("network", LOOKED_AT)
@pytest.mark.parametrize("mistake", TABLE)
def test_the_table_of_the_specification(network, mistake):
    block = mistakes.mistakes(mistakes.golden_block(network), mistakes.HALF[network])[mistake]
    photos = np.array(LOOKED_AT[network])
    scales, turns, _, rests = regressions(view(block, photos), photos)
    scale, turn, rest, misfit = TABLE[mistake][network == "selfcal"]
    assert np.median(scales) == pytest.approx(scale, rel=0.08, abs=0.05)
    assert np.median(rests) == pytest.approx(rest, rel=0.08, abs=0.006)
    if turn is not None:
        assert np.array_equal(np.round(np.median(turns, axis=0)), turn)
    if misfit is not None:
        assert np.median(misfits(view(block, photos), photos)) == pytest.approx(misfit, rel=0.08, abs=0.006)


NAMED = {
    "pixels": "unit, origin, y down",
    "corner": "origin, y down",
    "y down": "y down",
    "sign of c": "c or kappa",
    "mirrored": "mirrored",
    "x, y exchanged": "exchanged",
    "kappa + 90": "kappa + 90",
    "kappa - 90": "kappa - 90",
    "degrees as radians": "degrees for radians",
    "feet": "feet in positions of photos",
    "feet in heights": "feet in heights of photos",
    "t": "t for C",
    "t in photo axes": "t for C",
    "X, Y exchanged": "X and Y of photos",
    "principal distance": "principal distance",
    "control in feet": "feet in positions of points",
    "control, X and Y": "X and Y of points",
}


@pytest.mark.parametrize("network", LOOKED_AT)
@pytest.mark.parametrize("mistake", NAMED)
def test_mistakes_are_named(network, mistake):
    block = mistakes.mistakes(mistakes.golden_block(network), mistakes.HALF[network])[mistake]
    found = verdicts(block)
    assert [verdict.names for verdict in found] == [[NAMED[mistake]]]
    (hint,) = hints(block)
    assert hint.code == "convention.likely"


@pytest.mark.parametrize(
    ("mistake", "cause"),
    [
        ("radians as degrees", "radians for degrees"),
        ("photo-to-ground", "sense"),
        ("sign of phi", "sign of phi"),
    ],
)
def test_readings_of_angles_in_convergent_photos(mistake, cause):
    block = mistakes.mistakes(mistakes.golden_block("selfcal"), mistakes.HALF["selfcal"])[mistake]
    (hint,) = hints(block)
    assert f"mistake.{cause}" in nested_codes(hint)


def test_small_angles_hide_what_they_mean():
    """Near the vertical the sign of phi and the order of angles cannot be told, and nothing is said."""
    made = mistakes.mistakes(mistakes.golden_block("aerial"), mistakes.HALF["aerial"])
    assert hints(made["sign of phi"]) == hints(made["phi-omega-kappa"]) == []


def test_what_cannot_be_told_is_said():
    """Of vertical photos the other sense of the angles is the other sign of kappa."""
    block = aerial(12)
    known = np.isfinite(block.point_positions).all(axis=1)
    points = np.where(known[:, np.newaxis], block.point_positions, 0.0)
    angles = np.tile([0.0, 0.0, 0.8], (len(block.photo_ids), 1))
    seen = known[block.image_points]
    photos, of_points = block.image_photos[seen], block.image_points[seen]
    distances = np.full(len(photos), block.principal_distances[0])
    vertical = block.replace(
        photo_attitudes=angles,
        image_photos=photos,
        image_points=of_points,
        image_xy=project(points[of_points], block.photo_positions[photos], angles[photos], distances),
        image_sd=0.005,
    )
    assert hints(vertical) == []
    (verdict,) = verdicts(vertical.replace(photo_attitudes=-angles))
    assert sorted(verdict.names) == ["sense", "sign of kappa"]
    assert verdict.message.code == "convention.one-of"


@pytest.mark.parametrize("network", LOOKED_AT)
def test_start_values_without_mistakes(network):
    assert hints(mistakes.golden_block(network)) == []


# Blocks whose points are intersected from the poses that are wrong


def aerial(seed, **options):
    block = simulate(strips=2, photos_per_strip=5, seed=seed, **options).block
    return block.replace(
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
    )


FROM_RAYS = {
    "pixels": "unit, origin, y down",
    "corner": "origin, y down",
    "y down": "y down",
    "sign of c": "c or kappa",
    "mirrored": "mirrored",
    "x, y exchanged": "exchanged",
    "degrees as radians": "degrees for radians",
    "t in photo axes": "t for C",
}


@pytest.mark.parametrize("mistake", FROM_RAYS)
@pytest.mark.parametrize("control", ["perimeter", "none"])
def test_intersected_points(mistake, control):
    block = mistakes.mistakes(aerial(5, control=control, tilt=0.03), [120.0, 120.0])[mistake]
    found = verdicts(block)
    assert [verdict.names for verdict in found] == [[FROM_RAYS[mistake]]]


def test_good_blocks_get_no_hints():
    for seed in range(12):
        assert hints(aerial(seed, relief=float(20 + 50 * seed))) == []
    geographic = simulate(strips=2, photos_per_strip=4, spheroid=Spheroid.wgs84(), seed=1).block
    assert hints(geographic) == []


def test_a_single_photo():
    block = aerial(7)
    xy = block.image_xy.copy()
    xy[block.image_photos == 4] *= [-1, 1]
    (hint,) = hints(block.replace(image_xy=xy))
    assert "mistake.mirrored" in nested_codes(hint)
    assert hint.phrase.fields["photos"].fields["photos"] == [block.photo_ids[4]]


@pytest.mark.parametrize(
    "mistake", ["none", "pixels", "y down", "mirrored", "feet", "t", "principal distance"]
)
def test_cameras_with_lenses(mistake):
    """A camera in millimetres with a principal point and distortion sees like one without."""
    given = mistakes.golden_block("selfcal")
    made = mistakes.mistakes(given, mistakes.HALF["selfcal"])[mistake]
    distance = made.principal_distances[0]
    lens = {"c": float(distance), "xp": 0.05, "yp": -0.03, "K1": -1e-4}
    found = verdicts_of(made.replace(principal_distances=None, cameras=[Camera("brown", lens)]))
    assert found == ([[NAMED[mistake]]] if mistake != "none" else [])


def test_cameras_in_pixels():
    block = aerial(6)
    camera = Camera("radial", {"f": 25000, "cx": 19000, "cy": 19000, "k1": 0.01})
    directions = image_directions(block)
    pixels = block.replace(
        principal_distances=None, cameras=[camera], image_xy=camera.project(directions), image_sd=1.0
    )
    assert hints(pixels) == []
    upward = pixels.replace(image_xy=pixels.image_xy * [1, -1] + [0, 38000])
    assert verdicts_of(upward) == [["y down"]]


def verdicts_of(block):
    return [verdict.names for verdict in verdicts(seen_without_lenses(block)[0])]


def explained(block):
    return diagnose(block, adjust(block))


def test_standard_deviations_that_are_wrong():
    right = aerial(11)
    good = explained(right)
    assert good.findings == []
    assert good.verdict.code == "accepted"
    small = explained(right.replace(image_sd=right.image_sd / 3)).verdict
    assert (small.code, small.exit) == ("weights", 4)
    assert small.message.fields["factor"].fields["factor"] == pytest.approx(3, rel=0.1)
    large = explained(right.replace(image_sd=right.image_sd * 4)).verdict
    assert (large.code, large.exit) == ("weights-of-types", 4)
    (images,) = large.message.fields["types"]
    assert images.fields["factor"] == pytest.approx(1 / 4, rel=0.1)
    xy = right.image_xy.copy()
    xy[100] += 0.5
    wrong = explained(right.replace(image_xy=xy))
    assert [finding.kind for finding in wrong.grave] == [wrong.verdict.code] == ["gross-errors"]


def test_longitude_and_latitude():
    block = simulate(strips=2, photos_per_strip=4, spheroid=Spheroid.wgs84(), seed=1).block
    free = {"photo_position_sd": np.inf, "photo_positions_observed": None}
    exchanged = block.replace(photo_positions=block.photo_positions[:, [1, 0, 2]], **free)
    assert any("mistake.exchanged-axes" in nested_codes(hint) for hint in hints(exchanged))


def test_scale_bars_in_millimetres():
    block = aerial(8)
    known = np.flatnonzero(np.isfinite(block.point_positions).all(axis=1))[:3]
    names, places = [block.point_ids[k] for k in known], block.point_positions[known]
    lengths = [float(np.linalg.norm(places[k + 1] - places[k])) for k in range(2)]
    pairs = list(zip(names, names[1:], lengths, strict=False))
    good = [Distance(p, q, length, sd=1.0) for p, q, length in pairs]
    wrong = [Distance(p, q, 1000 * length, sd=1.0) for p, q, length in pairs]
    assert hints(block.replace(observations=good)) == []
    (hint,) = hints(block.replace(observations=wrong))
    assert hint.code == "convention.distances.mm"


# Where hints are told


def test_adjustments_that_fail_are_explained_when_asked():
    block = aerial(9)
    down = block.replace(image_xy=block.image_xy * [1, -1])
    found = explained(down)
    assert not found.result.converged
    assert "mistake.y down" in nested_codes(found.result.messages[0])
    assert "mistake.y down" in nested_codes(found.grave[0])
    sign = block.replace(principal_distances=-block.principal_distances)
    with pytest.raises(RankError) as raised:
        adjust(sign)
    assert raised.value.points
    assert raised.value.code == "adjust.no-intersection"
    with pytest.raises(RankError) as raised, errors_explained(sign):
        adjust(sign)
    assert f"\n  hint: probably {Phrase('mistake.c or kappa')}" in str(raised.value)
    assert any(each.kind == "sign-of-principal-distance" for each in diagnose(sign).grave)


def test_the_command_line_tells_them(run, tmp_path):
    block = aerial(9)
    for name, changed, said in (
        ("down", {"image_xy": block.image_xy * [1, -1]}, str(Phrase("mistake.y down"))),
        (
            "sign",
            {"principal_distances": -block.principal_distances},
            f"hint: probably {Phrase('mistake.c or kappa')}",
        ),
    ):
        write_project(Project.from_block(block.replace(**changed)), tmp_path / name)
        done = run("giant", "adjust", tmp_path / name)
        assert done.exit_code != 0
        assert said in " ".join(done.output.split())


def test_good_adjustments_are_not_looked_at(monkeypatch):
    def looked(_block):
        raise AssertionError

    monkeypatch.setattr("photogram.diagnosis.conventions.hints", looked)
    assert explained(aerial(9)).verdict.usable
    bad = aerial(9)
    with pytest.raises(AssertionError):
        explained(bad.replace(image_xy=bad.image_xy * [1, -1]))


def test_the_check_of_a_project_tells_them():
    block = aerial(10)
    feet = block.replace(photo_positions=block.photo_positions / 0.3048)
    (found,) = [each for each in diagnose(Project.from_block(feet)).findings if each.kind == "convention"]
    assert "mistake.feet.photos" in nested_codes(found)


def test_the_example(capsys):
    example = load("hints")
    example.main()
    said = capsys.readouterr().out
    assert "no mistake:\n    nothing\n" in said
    assert "nothing\n" not in said.split("pixels from", 1)[1]
    assert str(Phrase("mistake.format.y down")) in said
    assert "positions of the photos are in feet" in said


def test_what_is_no_block():
    with pytest.raises(InputError) as raised:
        hints("block")
    assert raised.value.code == "error.at"
    with pytest.raises(InputError, check=as_check("error.at result: error.kind")):
        diagnose(aerial(1), 3)
    assert len(spread(np.arange(100), 12)) == 12
    assert len(eligible(aerial(1))) == 10
