"""Every project from every format to every format that can hold it: read back, adjusted, compared."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import photogram
from message_codes import has_code
from photogram import InputError, MinimumConstraints, adjust, formats
from photogram.cli import app
from photogram.network import geographic_to_geocentric

EXAMPLES = Path(photogram.__file__).parent / "examples"
WRITTEN = [name for name, each in formats.FORMATS.items() if each.write]
SIMULATED = {
    "simulated": "",
    "negative plane": "--principal-distance 152.74 --position-sd 0.1",
    "geographic": "--spheroid wgs84 --origin 8 47 400",
}
SMALL = "--strips 2 --photos-per-strip 3 --points-per-photo 20 --check-points 2"
MOVED = {"bundler", "bal", "patb", "bingo"}
"""Formats whose coordinates are those of a camera without distortion: weights are other ones."""
CODES = (
    "format.poses",
    "format.no-images",
    "block.poses-unknown",
    "block.unsupported.camera",
    "block.unsupported.observations",
)


def written(project, name, folder):
    """Return a project as it comes back from a format; None where that says why it cannot hold it."""
    try:
        files = formats.target(folder / "there", name).files(project)
    except InputError as error:
        if any(has_code(error, code) for code in CODES):
            return None
        raise
    for path, content in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    main = formats.FORMATS[name].files
    path = folder / "there" / main[0] if main else folder / "there"
    cameras = path.parent / "cameras.csv" if name == "pixels" else None
    return formats.read(path, file_format=name, cameras=cameras)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    found = {name: formats.read(EXAMPLES / name) for name in ("project", "galveston")}
    for name, options in SIMULATED.items():
        folder = tmp_path_factory.mktemp("simulated") / "project"
        done = CliRunner().invoke(app, ["simulate", str(folder), *f"{SMALL} {options}".split()])
        assert done.exit_code == 0, done.output
        found[name] = formats.read(folder)
    return found


def free(block, *poses):
    """Return images alone, of one weight by angle, with poses of another block where there are none."""
    poses = next(
        (
            each
            for each in poses
            if np.isfinite(each.photo_positions).all() and set(each.photo_ids) >= set(block.photo_ids)
        ),
        None,
    )
    scales = block.camera_scales()[block.image_photos]
    if np.isnan(block.photo_positions).all():
        rows = [poses.photo_ids.index(name) for name in block.photo_ids]
        block = block.replace(
            photo_positions=poses.photo_positions[rows],
            photo_attitudes=poses.photo_attitudes[rows],
            photo_to_ground=poses.photo_to_ground,
            spheroid=poses.spheroid,
        )
    return block.replace(
        observations=(),
        mounts=(),
        point_positions=np.full((len(block.point_ids), 3), np.nan),
        point_sd=np.inf,
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        image_sd=1e-4 * np.column_stack([scales, scales]),
        refraction=None,
    )


def shape(result):
    """Return all distances between stations, in parts of their mean: some formats have numbers for names."""
    x, block = result.photo_positions, result.block
    x = geographic_to_geocentric(x, block.spheroid) if block.spheroid else x
    apart = np.linalg.norm(x[:, np.newaxis] - x, axis=2)
    return np.sort(apart.ravel()) / apart.mean()


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("source", ["project", "galveston", *SIMULATED])
def test_all_formats_hold_the_same_block_or_say_why_not(sources, tmp_path, source, name):
    first = written(sources[source], name, tmp_path / "first")
    if first is None or not len(first.block.image_photos):  # markers of known points alone
        return

    @cache
    def before():
        return adjust(free(first.block, sources[source].block), datum=MinimumConstraints(), tolerance=1e-9)

    for other in WRITTEN:
        second = written(first, other, tmp_path / other)
        if second is None:
            continue
        assert formats.cannot_hold(first, other) or other in ("plain", "giant")
        if name == "agisoft" or other == "agisoft":
            # Markers alone have too few images for a network.
            assert len(second.block.photo_ids) == len(first.block.photo_ids)
            continue
        after = adjust(
            free(second.block, first.block, sources[source].block), datum=MinimumConstraints(), tolerance=1e-9
        )
        exact = 1e-5 if source != "project" or not MOVED & {name, other} else 0.1
        assert after.degrees_of_freedom == before().degrees_of_freedom, other
        np.testing.assert_allclose(
            after.sums_of_squares.total, before().sums_of_squares.total, rtol=exact, err_msg=other
        )
        np.testing.assert_allclose(shape(after), shape(before()), atol=exact / 100, err_msg=other)
