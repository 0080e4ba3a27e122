"""Control networks of frames and push frame cameras, and of cubes."""

import json

import made_cubes
import numpy as np
import pytest
import support_data

from photogram import adjust, formats
from photogram.formats import FORMATS, ReadOptions
from photogram.formats.csm import SupportedImage, read_support
from photogram.formats.isis import ControlMeasures, ControlNetwork, ControlPoints, network_text
from photogram.formats.isis.outcome import Outcome, contents_of
from photogram.formats.results import adjusted


def moved(document, kilometres, turn=0.0):
    """Return support data of a camera farther on, turned about its axis along the flight by radians."""
    own = json.loads(json.dumps(document))
    places = np.array(own["instrument_position"]["positions"])
    own["instrument_position"]["positions"] = (places + np.array([0.0, 0.0, kilometres])).tolist()
    w, x, y, z = np.array(own["instrument_pointing"]["quaternions"]).T
    c, s = np.cos(turn / 2), np.sin(turn / 2)
    turned = np.column_stack([c * w - s * x, c * x + s * w, c * y - s * z, c * z + s * y])
    own["instrument_pointing"]["quaternions"] = turned.tolist()
    return own


def network(folder, images, ground):
    """Write a network of fixed points at what images see, and return its path."""
    seen = np.stack([image.to_image(ground) for image in images], axis=1)
    there = np.isfinite(seen).all(axis=2)
    assert there.any(axis=1).all()
    count = len(ground)
    types = np.full(count, 4, dtype=np.int8)
    points = ControlPoints([f"p{k}" for k in range(count)], types, apriori=ground)
    measures = ControlMeasures(
        [each.name for each in images],
        np.nonzero(there)[1].astype(np.int32),
        np.full(there.sum(), 3, dtype=np.int8),
        sample=seen[there][:, 1],
        line=seen[there][:, 0],
    )
    starts = np.append(0, np.cumsum(there.sum(axis=1)))
    own = ControlNetwork(points, measures, starts, target="Moon")
    path = folder / "own.net"
    path.write_bytes(network_text(own))
    return path


@pytest.mark.parametrize("kind", ["FRAME", "PUSH_FRAME", "LINE_SCANNER", "-z"])
def test_pointing_is_found_by_fixed_points(tmp_path, kind):
    # Between framelets there are gaps.
    plain = support_data.document("FRAME" if kind == "-z" else kind)
    documents = [plain, moved(plain, 0.0 if kind == "PUSH_FRAME" else 0.4)]
    if kind == "-z":
        documents = [support_data.along_minus_z(support_data.unmirrored(each)) for each in documents]
    paths = [support_data.written(tmp_path, each, f"{k}.json") for k, each in enumerate(documents)]
    images = [
        SupportedImage(read_support(path), f"image {k}", "isis", "isis") for k, path in enumerate(paths)
    ]
    lines, samples = (each.ravel() for each in np.mgrid[120:381:5j, 20:281:4j])
    path = network(tmp_path, images, images[0].to_ground(lines, samples, 50.0))
    for each, document in zip(paths, documents, strict=True):
        each.write_text(json.dumps(moved(document, 0.0, 1e-4)))
    (tmp_path / "images.lis").write_text("".join(f"image {k}, {k}.json\n" for k in range(2)))
    words = "CAMSOLVE=angles OVEREXISTING=yes CAMERA_ANGLES_SIGMA=1"
    project = formats.read(path, ReadOptions(cubes=tmp_path / "images.lis", jigsaw=words))
    result = adjust(project.block, tolerance=1e-9)
    outcome = Outcome(contents_of(project.details), result)
    assert not any("behind" in each.text for each in result.messages)
    # The records of the pair are exact; priors of a degree hardly pull.
    assert np.abs(outcome.residuals).max() < 1e-4
    assert len(result.block.photo_ids) == (50 if kind == "PUSH_FRAME" else 2)
    files = FORMATS["isis"].results(adjusted(project, result), result)
    for k, document in enumerate(documents):
        found = np.array(json.loads(files[f"support/{k}.json"])["instrument_pointing"]["quaternions"])
        truth = np.array(document["instrument_pointing"]["quaternions"])
        apart = 1 - np.abs(np.einsum("ni,ni->n", found, truth)) / np.linalg.norm(truth, axis=1)
        assert (2 * np.sqrt(2 * np.maximum(apart, 0.0)) < 2e-6).all()


def test_cubes_are_adjusted_and_stay_as_they_are(tmp_path):
    made_cubes.cube(tmp_path / "own.cub")
    image = SupportedImage(read_support(tmp_path / "own.cub"), "LRO/own", "isis", "isis")
    lines, samples = (each.ravel() for each in np.mgrid[20:381:5j, 100:281:4j])
    path = network(tmp_path, [image], image.to_ground(lines, samples))
    (tmp_path / "images.lis").write_text("LRO/own, own.cub\n")
    words = "CAMSOLVE=velocities TWIST=no CAMERA_ANGLES_SIGMA=1"
    project = formats.read(path, ReadOptions(cubes=tmp_path / "images.lis", jigsaw=words))
    result = adjust(project.block)
    assert result.converged
    files = FORMATS["isis"].results(adjusted(project, result), result)
    assert set(files) == {"images.csv", "points.csv", "residuals.csv", "bundleout.txt", "own.net"}
