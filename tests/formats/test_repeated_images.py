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


@pytest.fixture(scope="module", params=[1, 2], ids=["one more", "two more"])
def repeated(request, tmp_path_factory):
    """Return a model with additional observations of every fifth point in a photo, one or two of each."""
    folder = tmp_path_factory.mktemp("repeated") / "model"
    shutil.copytree(sample("colmap", "text"), folder)
    lines = (folder / "images.txt").read_text().splitlines()
    places = [row for row, line in enumerate(lines) if line and not line.startswith("#")]
    random = np.random.default_rng(4)
    for row in places[1::2]:
        words = lines[row].split()
        features = [words[k : k + 3] for k in range(0, len(words), 3)]
        for x, y, point in features[::EVERY]:
            for _ in range(request.param if point != "-1" else 0):
                dx, dy = random.normal(0.0, 0.5, 2)
                lines[row] += f" {float(x) + dx} {float(y) + dy} {point}"
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    return folder


def cost_of_all(project, result):
    """Return the weighted sum of squares of all images, the repeated ones too, at a solution."""
    again, there = project.repeated, at_adjusted(result)
    computed = computed_images(there)
    names = [
        (there.photo_ids[i], there.point_ids[j])
        for i, j in zip(there.image_photos, there.image_points, strict=True)
    ]
    rows = [names.index(pair) for pair in zip(again.photos, again.points, strict=True)]
    residuals = np.vstack([project.block.image_xy - computed, again.xy - computed[rows]])
    return float(((residuals / project.block.image_sd[0, 0]) ** 2).sum())


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


def test_an_adjustment_that_does_not_converge_has_no_such_remark(repeated):
    project = formats.read(repeated)
    places = project.block.photo_positions
    away = places + np.random.default_rng(1).normal(0.0, 2.0, places.shape)
    result = adjust(project.block.replace(photo_positions=away), max_iterations=1)
    assert not result.converged
    assert repeated_remarks(project, result) == []


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
