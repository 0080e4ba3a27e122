"""Work in a notebook: what things show of themselves, equality, pickles, what can be reached and given."""

import copy
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import photogram
import typed_uses
from example_scripts import load
from photogram import Camera, Iteration, Progress, adjust, collection, errors, simulate
from photogram.arguments.equality import alike
from photogram.stellar import read_plain


@pytest.fixture(scope="module")
def result():
    return adjust(simulate(strips=3, photos_per_strip=12, points_per_photo=60, seed=2).block)


@pytest.fixture(scope="module")
def ring():
    return collection.adjust(collection.read(files("photogram") / "examples" / "collection" / "ring.txt"))


@pytest.fixture(scope="module")
def camera():
    return Camera(
        "opencv", {"fx": 800, "fy": 801, "cx": 400, "cy": 300}, sd={"fx": np.inf, "cx": 0.5}, name="<lens>"
    )


@pytest.fixture(params=["result", "ring", "camera", "block", "collection"])
def thing(request):
    if request.param == "block":
        return request.getfixturevalue("result").block
    if request.param == "collection":
        return request.getfixturevalue("ring").collection
    return request.getfixturevalue(request.param)


def test_what_is_shown_fits_on_a_screen(thing):
    lines = repr(thing).splitlines()
    assert 3 <= len(lines) <= 22
    assert max(map(len, lines)) <= 110
    shown = thing._repr_html_()
    assert len(shown) < 5000
    # A verdict goes on in further lines.
    assert 0 <= len(lines) - 1 - shown.count("<tr>") <= 3


def test_what_is_shown(result, ring, camera):
    assert "photos     36" in repr(result)
    assert result.verdict.headline[:60] in repr(result)
    assert "Block: simulated block, 3 strips of 12 photographs" in repr(result.block)
    assert "bal: f, k1, k2" in repr(ring.collection)
    assert repr(camera).splitlines()[:2] == ["Camera <lens>: opencv, px", "  fx  800 px, free"]
    assert "cx  400 px, sd 0.5" in repr(camera)
    assert "&lt;lens&gt;" in camera._repr_html_()
    assert "<lens>" not in camera._repr_html_()


def test_many_remarks_are_counted(result):
    remarks = [photogram.Message(f"remark {number}") for number in range(40)]
    told = repr(photogram.results.result.replace(result, messages=remarks))
    assert "and 35 more remarks" in told
    assert len(told.splitlines()) <= 22


def test_equal_is_what_has_the_same_values(thing):
    again = copy.deepcopy(thing)
    assert again is not thing
    assert again == thing
    assert hash(again) == hash(thing)
    assert thing != "thing"
    assert pickle.loads(pickle.dumps(thing)) == thing


def test_a_changed_number_is_another_block(result, ring, camera):
    block = result.block
    moved = np.array(block.image_xy)
    moved[7, 1] += 1e-12
    assert block.replace(image_xy=moved) != block
    assert block.replace(title="another") != block
    assert camera.replace(sd=0.0) != camera
    assert camera.replace() == camera
    assert ring.collection.replace(image_sd=2.0) != ring.collection
    assert adjust(block) == result
    assert adjust(block, covariance=False) != result
    assert adjust(block, threads=1) == result


def test_alike_goes_down_to_the_elements():
    nan = float("nan")
    assert alike({"a": [nan, (1, np.array([nan, 2.0]))]}, {"a": [nan, (1, np.array([nan, 2.0]))]})
    assert not alike([1, np.array([2.0])], [1, np.array([2])])
    assert not alike({"a": 1}, {"b": 1})
    assert not alike([1, 2], [1, 2, 3])
    assert not alike(1, True)
    assert not alike(np.zeros(2), np.zeros((2, 1)))


RAISED = [
    errors.PhotogramError("plain"),
    errors.InputError("is wrong", file=Path("a.txt"), record=3, text="the record"),
    errors.ContradictionError("is mirrored"),
    errors.AdjustmentError("cannot be"),
    errors.OutOfMemoryError("too large"),
    errors.RankError("undetermined", ["1", "2"], ["p"], ["lens"]),
]


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
def test_errors_are_pickled_and_copied(error):
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error), copy.deepcopy(error)):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)


def test_every_error_of_the_package_is_among_them():
    def all_of(kind):
        return {kind}.union(*(all_of(each) for each in kind.__subclasses__()))

    own = {each for each in all_of(errors.PhotogramError) if each.__module__ == "photogram.errors"}
    assert own == {type(each) for each in RAISED}


def undetermined(number):
    raise errors.RankError(f"block {number} is open", ["1"], ["2"])


def test_an_error_of_a_pool_of_processes_arrives():
    with ProcessPoolExecutor(1) as pool, pytest.raises(errors.RankError, match="block 7 is open") as raised:
        pool.submit(undetermined, 7).result()
    assert (raised.value.photos, raised.value.points) == (["1"], ["2"])


def test_progress_is_pickled():
    seen = []
    adjust(simulate(strips=2, photos_per_strip=3).block, progress=seen.append)
    assert any(each.iteration for each in seen)
    assert pickle.loads(pickle.dumps(seen)) == seen
    assert isinstance(seen[0], Progress)
    assert isinstance(next(each.iteration for each in seen if each.iteration), Iteration)


def test_programs_are_there_after_the_import_and_not_before_they_are_asked_for():
    code = (
        "import sys, photogram\n"
        "assert not {'numpy', 'pandas', 'photogram.giant', 'photogram._photocore'} & set(sys.modules)\n"
        "for name in ('giant', 'collection', 'comparator', 'stellar', 'formats', 'planning', 'plots',\n"
        "             'perspective_center', 'absolute_orientation'):\n"
        "    assert name in dir(photogram)\n"
        "    assert getattr(photogram, name).__name__ == f'photogram.{name}'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_names_are_numbers_where_none_are_given():
    block = typed_uses.block_of_lists()
    assert block.photo_ids == ["0", "1"]
    assert block.point_ids == ["0", "1", "2"]
    assert typed_uses.block_of_data_frames().photo_ids == ["0", "1"]
    assert block.replace(photo_ids=["a", "b"]).photo_ids == ["a", "b"]


def test_what_checkers_of_types_accept_works():
    assert typed_uses.pictures(typed_uses.block_of_lists())[:3] == ["a block", "<svg", "network"]
    assert [each.unit for each in typed_uses.cameras()] == ["mm", "mm", "px"]
    assert len(typed_uses.collection().image_xy) == 1
    with pytest.raises(TypeError):
        typed_uses.refused()


def made(kind):
    """Return a result of each kind that may hold much."""
    simulation = simulate(strips=2, photos_per_strip=4, blunders=2, seed=1)
    block = simulation.block
    unknown = np.full((8, 3), np.nan)
    return {
        "snoop": lambda: photogram.snoop(block),
        "clean": lambda: photogram.clean(block),
        "variance_components": lambda: photogram.variance_components(block),
        "first_values": lambda: photogram.first_values(
            block.replace(photo_positions=unknown, photo_attitudes=unknown)
        ),
        "check": lambda: photogram.diagnose(block),
        "plan": lambda: photogram.plan({"a": simulation.truth}),
        "adjusted camera": lambda: adjust(load("self_calibration").measured()).cameras[0],
        "snooped collection": lambda: photogram.snoop(
            collection.simulate(outlier_share=0.01, seed=1).collection
        ),
        "project of GIANT": lambda: photogram.giant.read_project(
            files("photogram") / "examples" / "galveston"
        ),
        "project": lambda: photogram.formats.read(files("photogram") / "examples" / "project"),
    }[kind]()


@pytest.mark.parametrize(
    "kind",
    [
        "snoop",
        "clean",
        "variance_components",
        "first_values",
        "check",
        "plan",
        "adjusted camera",
        "snooped collection",
        "project of GIANT",
        "project",
    ],
)
def test_all_results_are_short_and_pickled(kind):
    thing = made(kind)
    lines = repr(thing).splitlines()
    assert len(lines) <= 22
    assert max(map(len, lines)) <= 110
    if kind != "plan":  # which is a table of its own
        assert len(thing._repr_html_()) < 5000
    again = pickle.loads(pickle.dumps(thing))
    assert type(again) is type(thing)
    assert repr(again) == repr(thing)
    if kind.startswith("snoop"):
        assert again.report() == thing.report()
        assert len(repr(thing).splitlines()) <= 22
        assert "removed" in repr(thing)


EXAMPLES = files("photogram") / "examples"


@pytest.mark.parametrize("kind", ["orientation", "projector", "plate", "comparator", "verdict"])
def test_results_of_programs_fit_on_a_screen(kind):
    thing = {
        "orientation": lambda: photogram.orient(
            photogram.absolute_orientation.read_csv(EXAMPLES / "absolute_orientation" / "stations.csv")
        ),
        "projector": lambda: photogram.perspective_center.run_deck(
            EXAMPLES / "perspective_center" / "grid.deck"
        ),
        "plate": lambda: photogram.stellar.calibrate(read_plain(EXAMPLES / "stellar" / "plate.toml")),
        "comparator": lambda: photogram.comparator.calibrate(
            *photogram.comparator.read([EXAMPLES / "comparator" / "comparator-3.txt"])
        ),
        "verdict": lambda: adjust(simulate(strips=2, photos_per_strip=3).block).verdict,
    }[kind]()
    lines = repr(thing).splitlines()
    assert len(lines) <= 22
    assert kind == "verdict" or max(map(len, lines)) <= 110
    assert len(repr(thing)) < 1000
    again = pickle.loads(pickle.dumps(thing))
    assert repr(again) == repr(thing)
