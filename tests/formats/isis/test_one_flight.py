"""Images of one observation: which they are, and that they share the coefficients of their poses."""

import json

import numpy as np
import pytest
import support_data
from test_frames import moved, network

from message_codes import refused
from photogram import adjust, formats
from photogram.formats import FORMATS, ReadOptions
from photogram.formats.csm import SupportedImage, read_support
from photogram.formats.isis.outcome import Outcome, contents_of
from photogram.formats.isis.solving import observation_number, one_flight
from photogram.formats.results import adjusted

SERIALS = ("MRO/HIRISE/903418200:19968/RED4/0", "MRO/HIRISE/903418200:19968/RED5/0")


@pytest.mark.parametrize(
    ("serial", "number"),
    [
        (SERIALS[0], "MRO/HIRISE/903418200:19968"),
        ("LO4/HRC/1002/3", "LO4/HRC/1002"),
        ("LO5/MRC/5031/1", "LO5/MRC/5031"),
        ("TGO/CaSSIS/2018-05-18T01:02:03.4/RED", "TGO/CaSSIS/2018-05-18T01:02:03.4"),
        ("JUNO/JNC/2013-10-09T19:22:15/12/BLUE", "JUNO/JNC/2013-10-09T19:22:15/12"),
        ("LRO/1/269182000:51104/NACL", "LRO/1/269182000:51104/NACL"),
        ("APOLLO15/METRIC/1971-07-31T01:24:36.970", "APOLLO15/METRIC/1971-07-31T01:24:36.970"),
    ],
)
def test_serial_numbers_say_the_observation(serial, number):
    assert observation_number(serial) == number


def later(seconds):
    """Return the support data of a second detector beside the first, whose image begins later."""
    own = support_data.document()
    times = np.array(own["instrument_position"]["ephemeris_times"]) + seconds
    places, velocities, matrices = support_data.orbit(times)
    own["instrument_position"] |= {"positions": places.tolist(), "velocities": velocities.tolist()}
    own["instrument_pointing"]["quaternions"] = [support_data.quaternion(m) for m in matrices]
    own["body_rotation"]["quaternions"] = [support_data.quaternion(m) for m in support_data.body(times)]
    for table in ("instrument_position", "instrument_pointing", "body_rotation"):
        own[table]["ephemeris_times"] = times.tolist()
    own["center_ephemeris_time"] += seconds
    own["starting_ephemeris_time"] += seconds
    own["starting_detector_sample"] += 150
    return own


@pytest.fixture
def observed(tmp_path):
    """Return a folder with two images of one observation, turned by 1e-4, and fixed points in both."""
    documents = [support_data.document(), later(0.3)]
    paths = [support_data.written(tmp_path, each, f"{k}.json") for k, each in enumerate(documents)]
    images = [
        SupportedImage(read_support(path), serial, "isis", "isis")
        for path, serial in zip(paths, SERIALS, strict=True)
    ]
    lines, samples = (each.ravel() for each in np.mgrid[120:381:5j, 20:281:4j])
    ground = [each.to_ground(lines, samples, 50.0) for each in images]
    network(tmp_path, images, np.concatenate(ground))
    for each, document in zip(paths, documents, strict=True):
        each.write_text(json.dumps(moved(document, 0.0, 1e-4)))
    listed = zip(SERIALS, paths, strict=True)
    (tmp_path / "images.lis").write_text("".join(f"{serial}, {path.name}\n" for serial, path in listed))
    return tmp_path, documents


def project(folder, words):
    options = ReadOptions(
        cubes=folder / "images.lis", jigsaw=f"OBSERVATIONS=yes CAMERA_ANGLES_SIGMA=1 {words}"
    )
    return formats.read(folder / "own.net", options)


@pytest.mark.parametrize("words", ["CAMSOLVE=angles OVEREXISTING=yes", "CAMSOLVE=accelerations"])
def test_images_of_one_observation_share_their_coefficients(observed, words):
    folder, documents = observed
    own = project(folder, words)
    one, two = own.block.timed
    assert one.trajectory is two.trajectory
    assert one.trajectory.name == "MRO/HIRISE/903418200:19968"
    # Time counts as in the first of them.
    assert one.trajectory.rotation.reference == support_data.START + 2.0
    result = adjust(own.block, tolerance=1e-9)
    assert np.abs(Outcome(contents_of(own.details), result).residuals).max() < 0.02
    # Of one image: angles of degree 0 are weighted, all others are free.
    unknown = 3 if "angles" in words else 9
    assert result.degrees_of_freedom == 2 * len(own.block.image_xy) + 3 - unknown
    files = FORMATS["isis"].results(adjusted(own, result), result)
    rows = files["images.csv"].decode().splitlines()[2:]
    assert len(rows) == 2
    # Behind the file, its residuals and where it was in the middle of its table.
    assert rows[0].split(",")[19:] == rows[1].split(",")[19:]
    assert len(rows[0].split(",")) == 19 + 5 * unknown
    for k, document in enumerate(documents):
        found = json.loads(files[f"support/{k}.json"])["instrument_pointing"]
        times = np.array(document["instrument_pointing"]["ephemeris_times"])
        at = np.searchsorted(found["ephemeris_times"], times - 1e-6)
        turned = np.array(found["quaternions"])[at]
        truth = np.array(document["instrument_pointing"]["quaternions"])
        apart = 1 - np.abs(np.einsum("ni,ni->n", turned, truth)) / np.linalg.norm(truth, axis=1)
        assert (2 * np.sqrt(2 * np.maximum(apart, 0.0)) < 2e-6).all()


def test_without_observations_every_image_has_its_own(observed):
    folder, _ = observed
    own = project(folder, "OBSERVATIONS=no")
    assert [each.trajectory.name for each in own.block.timed] == list(SERIALS)


def test_tables_of_two_flights_are_refused(observed):
    folder, documents = observed
    (folder / "1.json").write_text(json.dumps(moved(documents[1], 0.4)))
    with refused("isis.flight") as caught:
        project(folder, "")
    assert caught.value.file == folder / "1.json"


def test_tables_of_one_image_stay_as_they_are(observed):
    folder, _ = observed
    isd = read_support(folder / "0.json")
    both = one_flight([isd])
    np.testing.assert_array_equal(both.position.places, isd.position.places)
    np.testing.assert_array_equal(both.pointing.matrices, isd.pointing.matrices)
    joined = one_flight([isd, read_support(folder / "1.json")])
    assert (np.diff(joined.position.times) > 0).all()
    assert len(joined.position.times) > len(isd.position.times)


def test_an_observation_is_held_altogether(observed):
    folder, _ = observed
    (folder / "held.lis").write_text(f"{SERIALS[0]}\n")
    with refused("isis.observation number=MRO/HIRISE/903418200:19968"):
        project(folder, f"HELDLIST={folder / 'held.lis'}")


def test_instruments_without_a_rule_are_refused():
    with refused("isis.observation-rule image=IDEAL/1"):
        observation_number("IDEAL/1")
