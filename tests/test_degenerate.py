"""Set-ups that leave something open are named, with what would help; none is accepted."""

import re

import numpy as np
import pytest

import degenerate as of
from message_codes import nested_codes
from photogram import Camera, LeverArm, Position, RankError, adjust, formats, read_result
from photogram.network import Drift, EqualHeight, OnPlumbLine, PlumbLine, Shift
from photogram.words import Phrase

STRIP = np.array([[200.0 * k, 0.0, of.HEIGHT] for k in range(6)])
BELOW = np.array([[200.0 * k, y, 40 * np.sin(3 * k + y)] for k in range(-1, 8) for y in (-400.0, 0.0, 400.0)])
LINE = (4, 13, 22)
BELOW[list(LINE)] = [[0.0, 0.0, 0.0], [500.0, 0.0, 0.0], [1000.0, 0.0, 0.0]]
SURE = (0.05, 0.05, 0.05)
ALIKE = of.drawn(9).uniform(-4, 4, (6, 3)) + np.array([0.0, 0.0, 12.0]), np.tile([0.1, -0.2, 0.3], (6, 1))
PAIR = np.array([[-2.0, 0.0, 10.0], [2.0, 0.0, 10.0]])


def strip(control, observations=()):
    return of.block(
        STRIP, np.zeros((6, 3)), BELOW, (), dict.fromkeys(control, SURE), observations=observations
    )


def two_strips(control):
    """Return the strip with one beside it that sees the same points."""
    beside = np.array([0.0, 400.0, 0.0])
    centres = np.concatenate([STRIP, STRIP + beside])
    return of.block(centres, np.zeros((12, 3)), BELOW, (), dict.fromkeys(control, SURE))


def gnss(centres, arm=(0.0, 0.0, 0.0), drift=None):
    shift = Shift("s")
    return [
        Position(f"p{k}", at, lever_arm=arm, shift=shift, drift=drift, time=float(k), sd=0.02)
        for k, at in enumerate(centres)
    ]


def flight(turns=0.0):
    centres, angles = of.vertical(turns)
    observed = gnss(centres, LeverArm("l"))
    return of.block(centres, angles, of.flat_field(200.0), (), of.IN_SPACE, observations=observed)


def one_place(base=0.0):
    random = of.drawn(4)
    stations = base * np.eye(5, 3)
    views = [0.0, 0.0, 1.0] + 0.3 * random.standard_normal((5, 3))
    angles = of.looking(views, [0.0, 0.0, 0.0], random.uniform(-3, 3, 5))
    return of.block(stations, angles, of.cloud(15, 0.5) - [0.0, 0.0, 5.0])


def vertical(free, control, relief=0.0):
    return of.block(*of.vertical(), of.flat_field(relief), free, control)


def ring(free, elevation=0.0):
    return of.block(*of.ring(elevation), of.cloud(), free)


def two_rings():
    rings = [of.ring(elevation) for elevation in (0.0, 0.6)]
    centres, angles = (np.concatenate(each) for each in zip(*rings, strict=True))
    return of.block(centres, angles, of.cloud(), ["c", "xp", "yp", "b1", "b2"])


def pair(free, meeting=True):
    angles = of.looking(PAIR, [0.0, 0.0, 0.0]) if meeting else np.zeros((2, 3))
    return of.block(PAIR, angles, of.cloud(25), free)


def text(code, **fields):
    return re.escape(str(Phrase(code, fields)))


HIGHER = text("weak.height")
POINT = "principal point and position or tilt of all photos are inseparable"
SAME_WAY = text("weak.parallel")
ROLL = text("weak.roll")
NOT_TURNED = text("weak.ring")
ONE_PLACE = text(
    "adjust.points.one-place", photos=[f"p{k}" for k in range(5)], points=[f"P{k}" for k in range(15)]
)
TOGETHER = text("weak.lever-arm")
TAKES = text("weak.drift")
TWO = text("weak.two-photos")
SET_UPS = {
    "1 flat field, plan": (lambda: vertical(["c"], of.IN_PLAN), 4, [HIGHER, "no height is known"]),
    "1 with heights": (lambda: vertical(["c"], of.IN_SPACE), 1, ["c of camera and flying heights", HIGHER]),
    "1 relief, plan": (lambda: vertical(["c"], of.IN_PLAN, 200.0), 2, ["c of camera", HIGHER]),
    "2 c, xp, yp": (lambda: vertical(["c", "xp", "yp"], of.IN_SPACE), 3, [HIGHER, f"xp of.*{POINT}"]),
    "3 translation, c": (lambda: of.block(*ALIKE, of.cloud(), ["c"]), 1, [f"c of camera.*{SAME_WAY}"]),
    "3 c, xp, yp": (lambda: of.block(*ALIKE, of.cloud(), ["c", "xp", "yp"]), 3, [f"yp of.*{SAME_WAY}"]),
    "3 all": (lambda: of.block(*ALIKE, of.cloud(), ["c", "xp", "yp", "b1", "b2"]), 5, [SAME_WAY]),
    "4 control": (lambda: strip(LINE), 1, ["moving all 6 photos", ROLL]),
    "4 a second strip tied to it": (lambda: two_strips(LINE), 1, [ROLL]),
    "4 positions": (lambda: of.block(STRIP, np.zeros((6, 3)), BELOW, positions_sd=0.05), 1, [ROLL]),
    "5 one place": (one_place, None, [ONE_PLACE]),
    "6 c, b1": (lambda: ring(["c", "b1"]), 1, [f"c, b1 of camera: {NOT_TURNED}"]),
    "6 yp": (lambda: ring(["yp"]), 1, [f"yp of camera.*{NOT_TURNED}"]),
    "6 from above": (lambda: ring(["c", "yp", "b1"], 0.6), 2, [NOT_TURNED]),
    "6 from above, two": (lambda: ring(["yp", "b1"], 0.6), 1, [NOT_TURNED]),
    "7 one heading": (flight, 3, ["moving lever arm l, shift s", TOGETHER]),
    "7 two headings": (lambda: flight([0, 0, 0, np.pi, np.pi, np.pi]), 1, [TOGETHER]),
    "8 one point": (lambda: strip((13,), gnss(STRIP, drift=Drift("d"))), 4, ["shift s, drift d", TAKES]),
    "8 two across": (lambda: strip((12, 14), gnss(STRIP, drift=Drift("d"))), 1, [TAKES]),
    "8 two along": (lambda: strip((4, 22), gnss(STRIP, drift=Drift("d"))), 1, [ROLL]),
    "11 parallel": (lambda: pair(["c"], meeting=False), 1, [f"c of camera: {TWO}"]),
    "11 meeting": (lambda: pair(["c"]), 1, [f"c of camera.*{TWO}"]),
    "11 c, xp, yp": (lambda: pair(["c", "xp", "yp"]), 2, [TWO]),
}  # fmt: skip


@pytest.mark.parametrize("name", SET_UPS)
def test_what_is_open_is_counted_and_named_with_what_helps(name):
    make, count, words = SET_UPS[name]
    with pytest.raises(RankError) as caught:
        adjust(make())
    said = " ".join(str(caught.value).split())
    if count is not None:
        assert caught.value.phrase.fields["n"] == count
    assert all(re.search(each, said) for each in words), said
    assert "second flying height" not in said


@pytest.mark.parametrize("name", SET_UPS)
def test_the_command_says_it_and_ends_with_its_code(name, run, tmp_path):
    make, _, words = SET_UPS[name]
    block = make()
    project = formats.Project(
        block=block, path=tmp_path, title=name, sizes=(None,), pixel_mm=(None,), starts=block.point_positions
    )
    (tmp_path / "given").mkdir()
    for file, content in formats.to_files(project, "plain").items():
        (tmp_path / "given" / file).write_bytes(content)
    done = run("adjust", "given", "--no-html")
    said = " ".join((done.output + done.stderr).split())
    assert done.exit_code == 3, said
    assert all(re.search(each, said) for each in words), said
    assert not re.search("accepted|usable", said, re.IGNORECASE)


REMEDIES = {
    "1 relief with heights": lambda: vertical(["c"], of.IN_SPACE, 200.0),
    "3 one photo tilted": lambda: of.block(
        ALIKE[0], ALIKE[1] + np.eye(6)[:, :1] * [0.3, 0.0, 0.0], of.cloud(), ["c", "xp", "yp"]
    ),
    "4 a height aside": lambda: strip((*LINE, 0)),
    "4 a second strip with control": lambda: two_strips((*LINE, 5, 23)),
    "5 a base": lambda: one_place(base=0.005),
    "6 turned": lambda: of.block(*of.ring(turned=True), of.cloud(), ["c", "xp", "yp", "b1", "b2"]),
    "6 b1 alone": lambda: ring(["b1"]),
    "6 two rings": two_rings,
    "8 corners": lambda: strip((0, 2, 24, 26), gnss(STRIP, drift=Drift("d"))),
}


@pytest.mark.parametrize("name", REMEDIES)
def test_the_remedies_help(name):
    assert adjust(REMEDIES[name]()).converged


def plumb(known):
    points = of.cloud()
    points[1] = points[0] + [0.0, 0.0, 2.5]
    line = PlumbLine("l", [*points[0, :2], 0.0], sd=0.0 if known else np.inf)
    return of.block(*of.around(), points, observations=[OnPlumbLine(f"P{k}", line, 0.001) for k in (0, 1)])


def level(pairs):
    points = of.cloud()
    for a, b in pairs:
        points[b, 2] = points[a, 2]
    return of.block(
        *of.around(), points, observations=[EqualHeight(f"P{a}", f"P{b}", sd=0.001) for a, b in pairs]
    )


@pytest.mark.parametrize(
    ("make", "count", "expected"),
    [
        (lambda: plumb(known=False), 5, ["free.plumb-line", "free.place", "free.azimuth", "free.scale"]),
        (lambda: plumb(known=True), 3, ["free.plumb-line", "free.turn", "free.shift", "free.scale"]),
        (lambda: level([(0, 1)]), 6, ["free.equal-heights"]),
        (lambda: level([(0, 1), (2, 3)]), 5, []),
        (lambda: strip((), gnss(STRIP, drift=Drift("d"))), 7, []),
    ],
)
def test_free_networks_hold_what_is_open_and_say_it(make, count, expected):
    """Set-ups 9 and 10, and 8 without control."""
    result = adjust(make())
    assert len(result.datum.held) == count
    (remark,) = [each for each in result.messages if each.code == "free.minimum"]
    assert nested_codes(remark.phrase.fields["levels"]) == expected


def with_errors(block, seed=0, start=2.0, tilt=0.002):
    """Return a block with errors of images, control and the start, its points intersected."""
    random = of.drawn(seed)
    control = np.isfinite(block.point_sd)
    points = block.point_positions + 0.05 * random.standard_normal(block.point_positions.shape)
    return block.replace(
        image_xy=block.image_xy + of.SD * random.standard_normal(block.image_xy.shape),
        photo_positions=block.photo_positions + start * random.standard_normal(block.photo_positions.shape),
        photo_attitudes=block.photo_attitudes + tilt * random.standard_normal(block.photo_attitudes.shape),
        point_positions=np.where(control, points, np.nan),
    )


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("free", [["c"], ["c", "xp", "yp"]])
def test_a_flat_field_with_errors_is_not_accepted(free, seed, tmp_path):
    """Its principal distance might be any."""
    for control in (of.IN_SPACE, of.IN_PLAN):
        try:
            result = adjust(with_errors(vertical(free, control), seed))
        except RankError:
            continue
        verdict = result.verdict
        assert (verdict.code, verdict.exit) == ("undetermined", 3), verdict
        assert "c of camera" in verdict.headline
        result.to_parquet(tmp_path / f"{free}{len(control)}")
        assert read_result(tmp_path / f"{free}{len(control)}").verdict.code == "undetermined"


def test_a_ring_with_errors_ends_with_words():
    result = adjust(with_errors(ring(["c", "yp", "b1"], 0.6), 1, 0.05, 0.005))
    said = " ".join(str(each) for each in result.messages)
    assert str(Phrase("weak.ring")) in said
    assert result.verdict.exit == 3


def test_a_principal_distance_that_might_be_any_is_no_result():
    """With weights on everything else the equations are regular; the answer is none all the same."""
    block = vertical(["c"], of.IN_SPACE)
    camera = Camera("brown", {"c": of.C}, {"c": 100.0}, unit="mm", name="camera")
    result = adjust(with_errors(block).replace(cameras=[camera]))
    assert result.cameras[0].sd[0] > abs(result.cameras[0].values[0]) / 3
    assert result.verdict.code == "undetermined"


def test_a_strip_that_hardly_knows_its_roll_says_so():
    """Its control is off the line by its errors only, which must not give heights beside the line."""
    result = adjust(with_errors(strip(LINE)))
    assert result.verdict.code == "undetermined"
    assert re.search(ROLL, result.verdict.headline)
