"""Several images of one point on a photo, as COLMAP has them: counted, with what they cost, or taken in."""

import re
import shutil

import numpy as np
import pytest
from block import sample

from photogram import adjust, formats
from photogram.adjustment.prediction import at_adjusted, computed_images
from photogram.formats.supplements import repeated_remarks, with_repeated

EVERY = 5


@pytest.fixture(scope="module")
def repeated(tmp_path_factory):
    """Return a model, every fifth image of which stands there again beside its place."""
    folder = tmp_path_factory.mktemp("repeated") / "model"
    shutil.copytree(sample("colmap", "text"), folder)
    lines = (folder / "images.txt").read_text().splitlines()
    places = [row for row, line in enumerate(lines) if line and not line.startswith("#")]
    random = np.random.default_rng(4)
    for row in places[1::2]:
        words = lines[row].split()
        features = [words[k : k + 3] for k in range(0, len(words), 3)]
        for x, y, point in features[::EVERY]:
            if point != "-1":
                dx, dy = random.normal(0.0, 0.5, 2)
                lines[row] += f" {float(x) + dx} {float(y) + dy} {point}"
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    return folder


def cost_of_all(project, result):
    """Return the weighted sum of squares of all images, the repeated ones too, at a solution."""
    block, again = project.block, project.repeated
    there = at_adjusted(result)
    photos = [block.photo_ids.index(name) for name in again.photos]
    points = [block.point_ids.index(name) for name in again.points]
    every = there.replace(
        image_photos=np.append(block.image_photos, photos)[-len(photos) :],
        image_points=np.append(block.image_points, points)[-len(points) :],
        image_xy=again.xy,
        image_sd=np.full(again.xy.shape, block.image_sd[0, 0]),
    )
    first = there.replace(
        image_photos=block.image_photos,
        image_points=block.image_points,
        image_xy=block.image_xy,
        image_sd=block.image_sd,
    )
    return sum(
        float((((each.image_xy - computed_images(each)) / each.image_sd) ** 2).sum())
        for each in (first, every)
    )


def test_they_are_counted_with_what_they_cost(repeated):
    project = formats.read(repeated)
    count = len(project.repeated.points)
    assert count > 10
    assert any(f"{count} second images" in str(each) for each in project.messages)
    result = adjust(project.block, unit_variance="free")
    [said] = repeated_remarks(project, result)
    figures = re.search(r"would be (\S+) here and not (\S+) \(", str(said)).groups()
    assert float(figures[0]) == pytest.approx(cost_of_all(project, result), rel=1e-5)
    assert float(figures[1]) == pytest.approx(result.sums_of_squares.total, rel=1e-5)


def test_they_are_taken_in_to_the_cost_of_all(repeated):
    project = formats.read(repeated)
    kept = with_repeated(project)
    assert not kept.repeated.points
    assert repeated_remarks(kept, adjust(kept.block)) == []
    result, without = (adjust(each.block, unit_variance="free") for each in (kept, project))
    [said] = [str(each) for each in kept.messages if "averaged" in str(each)]
    spread = float(re.search(r"larger by (\S+) ", said)[1])
    total = result.sums_of_squares.total + spread
    # The photos of both start alike; what is held of a free network is, too.
    assert total == pytest.approx(cost_of_all(project, result), abs=1e-6)
    assert total < cost_of_all(project, without)


def test_the_command_has_the_option(run, repeated, tmp_path):
    out = str(tmp_path / "out")
    plain = run("adjust", str(repeated), "--out", out, "--no-html").output
    assert (
        "second images of a point on a photo, which are left out, the weighted sum of squares would" in plain
    )
    kept = run("adjust", str(repeated), "--out", out, "--no-html", "--keep-repeated").output
    assert "are averaged with the first" in kept
    assert "second images of a point on a photo are left out" not in kept
