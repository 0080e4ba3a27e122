"""Support data in JSON: what is read of all three kinds of cameras, and what is refused."""

import json

import numpy as np
import pytest
from support_data import RADIUS, START, along_minus_z, document, unmirrored, written

from message_codes import coded, has_code, rejected
from photogram import InputError
from photogram.formats.csm import SupportedImage, read_support
from photogram.network import Polynomial, projected

PLACES = np.array([[10.0, 20.0], [150.0, 200.5], [290.0, 399.0], [0.5, 0.5]])
"""Samples and lines."""


def image(tmp_path, data, **how):
    return SupportedImage(read_support(written(tmp_path, data)), "I", **how)


@pytest.mark.parametrize("kind", ["LINE_SCANNER", "FRAME", "PUSH_FRAME"])
@pytest.mark.parametrize("pixels", ["csm", "isis"])
@pytest.mark.parametrize("interpolation", ["csm", "isis"])
def test_every_camera_finds_its_pixels_on_the_ground(tmp_path, kind, pixels, interpolation):
    own = image(tmp_path, document(kind), pixels=pixels, interpolation=interpolation)
    ground = own.to_ground(PLACES[:, 1], PLACES[:, 0], 50.0)
    np.testing.assert_allclose(np.linalg.norm(ground, axis=1), 1000 * RADIUS + 50.0, rtol=1e-12)
    np.testing.assert_allclose(own.to_image(ground), PLACES[:, ::-1], rtol=0, atol=1e-7)
    # As photos of a block: each point is where its photo has it.
    photos, xy = own.coordinates(*PLACES.T)
    for row, (photo, place) in enumerate(zip(photos, xy, strict=True)):
        seen = projected(own.timed[photo], own.flown, own.camera, ground[[row]])[0]
        np.testing.assert_allclose(seen, place, rtol=0, atol=1e-7)


def test_framelets_have_times_of_their_own(tmp_path):
    data = document("PUSH_FRAME")
    data |= {"framelet_order_reversed": True, "framelets_flipped": True}
    own = image(tmp_path, data)
    assert len(own.timed) == 25
    assert [own.timed[k].time for k in (24, 0)] == pytest.approx([START + 0.005, START + 0.005 + 24 * 0.16])
    photos, xy = own.coordinates([100.0, 100.0], [17.0, 15.0])
    assert photos.tolist() == [1, 0]
    # Both are one row from an edge that is not the same.
    assert abs(xy[0, 0] - xy[1, 0]) == pytest.approx(14 / 50, rel=0.01)
    ground = own.to_ground(PLACES[:, 1], PLACES[:, 0])
    np.testing.assert_allclose(own.to_image(ground), PLACES[:, ::-1], rtol=0, atol=1e-7)


def test_rows_of_line_scan_rate_follow_each_other(tmp_path):
    data = document()
    data["line_scan_rate"] = [[0.5, -2.0, 0.01], [200.5, 0.1, 0.009]]
    lines = read_support(written(tmp_path, data)).lines
    # Line 200 from the upper edge is 200.5 as ISIS counts.
    assert lines.times([0.0, 199.5, 200.0, 300.0]) == pytest.approx(START + np.array([0.0, 1.995, 2.1, 3.0]))


def test_a_summed_image_lies_on_the_same_detector(tmp_path):
    plain, summed = document("FRAME"), document("FRAME", lines=200, samples=150)
    summed |= {"detector_line_summing": 2, "detector_sample_summing": 2}
    for pixels in ("csm", "isis"):
        corner = 0.5 if pixels == "isis" else 0.0
        one, other = (image(tmp_path, data, pixels=pixels) for data in (plain, summed))
        xy = one.coordinates([100.0 + corner], [60.0 + corner])[1]
        np.testing.assert_allclose(other.coordinates([50.0 + corner], [30.0 + corner])[1], xy, atol=1e-12)


def test_corrections_are_of_the_trajectory_that_is_given(tmp_path):
    own = image(tmp_path, document())
    moved = image(tmp_path, document(), trajectory=own.flown)
    assert moved.timed[0].trajectory is own.flown
    shift = Polynomial(0, value=[[0.0, 30.0, 0.0]], sd=0.0)
    on = type(own.flown)("t", own.flown.table, shift, None, own.flown.body)
    there = image(tmp_path, document(), trajectory=on).to_ground([200.0], [150.0])
    apart = there - own.to_ground([200.0], [150.0])
    assert np.linalg.norm(apart) == pytest.approx(30.0, rel=0.01)


LENSES = {
    "transverse": {"x": [0, 1, *[0] * 8], "y": [0, 0, 1, *[0] * 7]},
    "lrolrocnac": {"coefficients": 1.8e-5},
    "kaguyalism": {"boresight_x": 0.07, "x": [0, 1e-5, 0, 0], "boresight_y": 0.02, "y": [0, 1e-5, 0, 0]},
    "cahvor": {"coefficients": [1e-4, 0, 0, 0.1, 0.2]},
    "radtan": {"coefficients": [-0.1, 0.01, 0, 0, 0]},
}


@pytest.mark.parametrize("model", LENSES)
def test_lenses_are_read_by_their_names(tmp_path, model):
    own = image(tmp_path, document() | {"optical_distortion": {model: LENSES[model]}})
    assert own.isd.lens.model == model
    ground = own.to_ground(PLACES[:, 1], PLACES[:, 0])
    np.testing.assert_allclose(own.to_image(ground), PLACES[:, ::-1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("model", ["radial", *LENSES])
@pytest.mark.parametrize("kind", ["positive", "negative"])
def test_a_frame_that_looks_along_minus_z_sees_the_same(tmp_path, model, kind):
    data = unmirrored(document("FRAME"))
    if model != "radial":
        data["optical_distortion"] = {model: LENSES[model]}
    turned = along_minus_z(data)
    if kind == "negative":
        turned["focal_length_model"]["focal_length"] *= -1
    one, other = image(tmp_path, data), image(tmp_path, turned)
    assert (one.isd.look, other.isd.look) == (1, -1)
    assert other.camera.parameters["c"] < 0
    if model in ("radial", "lrolrocnac"):
        # The other lenses are not the same in turned axes.
        ground = one.to_ground(PLACES[:, 1], PLACES[:, 0])
        np.testing.assert_allclose(other.to_ground(PLACES[:, 1], PLACES[:, 0]), ground, rtol=0, atol=1e-6)
    ground = other.to_ground(PLACES[:, 1], PLACES[:, 0])
    np.testing.assert_allclose(other.to_image(ground), PLACES[:, ::-1], rtol=0, atol=1e-6)
    xy = other.coordinates(*PLACES.T)[1]
    seen = projected(other.timed[0], other.flown, other.camera, ground)
    np.testing.assert_allclose(seen, xy, rtol=0, atol=1e-6)


def keywords(**values):
    own = {f"INS-1_{name}": value for name, value in values.items()}
    return {"INS-1_TRANSX": [0.0, 0.02, 0.0], "INS-1_TRANSY": [0.0, 0.0, 0.02], **own}


def test_null_values_are_derived_from_other_fields(tmp_path):
    data = document("FRAME", records=1)
    data |= {"starting_detector_line": 0, "starting_detector_sample": 0, "detector_line_summing": 2}
    data["detector_center"] = {"line": None, "sample": None}
    data["center_ephemeris_time"] = None
    found = read_support(written(tmp_path, data))
    assert found.detector.centre.tolist() == [150.0, 400.0]
    assert found.time == data["instrument_pointing"]["ephemeris_times"][0]
    assert len(found.remarks) == 3
    data["detector_center"] = None
    assert read_support(written(tmp_path, data)).detector.centre.tolist() == [150.0, 400.0]


@pytest.mark.parametrize(
    ("kind", "changes", "remarks"),
    [
        ("FRAME", {}, 1),
        ("FRAME", {"focal2pixel_samples": [160.0, 50.0, 0.0]}, 0),
        ("FRAME", {"detector_center": {"line": 0, "sample": 160.0}}, 0),
        ("FRAME", {"starting_detector_line": 3}, 0),
        ("LINE_SCANNER", {}, 0),
    ],
)
def test_a_detector_center_in_the_corner_is_reported(tmp_path, kind, changes, remarks):
    data = document(kind, records=1 if kind == "FRAME" else 9)
    data |= {"starting_detector_line": 0, "starting_detector_sample": 0}
    data |= {"focal2pixel_samples": [0.0, 50.0, 0.0], "focal2pixel_lines": [0.0, 0.0, 50.0]}
    data |= {"detector_center": {"line": 0, "sample": 0.0}, **changes}
    found = read_support(written(tmp_path, data))
    assert len(found.remarks) == remarks
    assert found.detector.centre.tolist() == [data["detector_center"][axis] for axis in ("sample", "line")]


@pytest.mark.parametrize("kind", ["FRAME", "LINE_SCANNER"])
def test_null_values_are_those_of_the_keywords(tmp_path, kind):
    data = document(kind)
    plain = read_support(written(tmp_path, data))
    data["naif_keywords"] = keywords(
        BORESIGHT_SAMPLE=160.0,
        BORESIGHT_LINE=2.5,
        FOCAL_LENGTH=300.0,
        ITRANSS=data["focal2pixel_samples"],
        ITRANSL=data["focal2pixel_lines"],
    )
    data |= {"detector_center": {"line": None, "sample": None}, "focal_length_model": {"focal_length": None}}
    data |= {"focal2pixel_samples": None, "focal2pixel_lines": None}
    found = read_support(written(tmp_path, data))
    assert len(found.remarks) == 5
    assert found.focal_length == plain.focal_length
    np.testing.assert_array_equal(found.detector.centre, plain.detector.centre)
    np.testing.assert_array_equal(found.detector.planes["csm"].matrix, plain.detector.planes["csm"].matrix)


def without(*keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        del data[keys[-1]]

    return change


def setting(value, *keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


FAULTS = [
    (without("name_model"), "error.at: error.document: error.missing name_model"),
    (
        setting("USGS_ASTRO_SAR_SENSOR_MODEL", "name_model"),
        "error.at /name_model: error.unknown.close sensor model",
    ),
    (without("image_lines"), "error.at: error.document: error.missing image_lines"),
    (setting(0, "image_samples"), "error.at /image_samples: error.whole-range 0 1 2147483647"),
    (
        setting("x", "focal_length_model", "focal_length"),
        "error.at /focal_length_model/focal_length: error.number x",
    ),
    (
        setting(0, "focal_length_model", "focal_length"),
        "error.at /focal_length_model/focal_length: format.zero",
    ),
    (without("detector_center", "line"), "error.at /detector_center: error.missing line"),
    (
        setting([0.0, 0.0, 0.0], "focal2pixel_lines"),
        "error.at /focal2pixel_samples: csm.inverse /focal2pixel_lines",
    ),
    (
        setting(None, "detector_center", "line"),
        "error.at /detector_center/line: csm.null the line of the detector",
    ),
    (
        setting(None, "focal_length_model", "focal_length"),
        "error.at /focal_length_model/focal_length: csm.null the focal length",
    ),
    (
        setting(None, "focal2pixel_samples"),
        "error.at /focal2pixel_samples: csm.null three numbers",
    ),
    (
        setting(None, "detector_line_summing"),
        "error.at /detector_line_summing: csm.null the number of detector lines",
    ),
    (
        setting(None, "center_ephemeris_time"),
        "error.at /center_ephemeris_time: csm.null the time of the exposure",
    ),
    (setting(None, "radii", "semimajor"), "error.at /radii/semimajor: error.number: error.value None"),
    (setting([0.0, 1.0], "focal2pixel_lines"), "error.at /focal2pixel_lines: error.count 3 2"),
    (
        setting(0, "detector_sample_summing"),
        "error.at /detector_sample_summing: format.positive the sum of pixels 0.0",
    ),
    (
        setting({"fisheye": {}}, "optical_distortion"),
        "error.at /optical_distortion: error.unknown lens fisheye",
    ),
    (setting({}, "optical_distortion"), "error.at /optical_distortion: format.count 0 1"),
    (
        setting([1.0], "optical_distortion", "radial", "coefficients"),
        "error.at /optical_distortion/radial: error.at coefficients of the lens radial: error.numbers 3",
    ),
    (setting({"lineExposureTimes": [1.0]}, "jitter"), "error.at /jitter: csm.jitter"),
    (setting([], "line_scan_rate"), "error.at /line_scan_rate: format.empty"),
    (
        setting([[0.5, -2.0, 0.0]], "line_scan_rate"),
        "error.at /line_scan_rate: error.at lines: error.kind rows of first line, time,",
    ),
    (setting([[0.5, -2.0]], "line_scan_rate"), "error.at /line_scan_rate/0: error.count 3 2"),
    (setting("miles", "radii", "unit"), "error.at /radii/unit: error.unknown unit miles m,km"),
    (setting(2e9, "radii", "semiminor"), "error.at /radii: csm.radii 1700000.0 2000000000000.0"),
    (without("instrument_position", "positions"), "error.at /instrument_position: error.missing positions"),
    (
        setting([1.0, 2.0], "instrument_position", "positions", 3),
        "error.at /instrument_position/positions/3: error.count 3 2",
    ),
    (
        setting([[0, 0, 0]], "instrument_position", "velocities"),
        "error.at /instrument_position/velocities: format.count 1 21",
    ),
    (
        setting(8, "instrument_position", "reference_frame"),
        "error.at /instrument_position: csm.frames 1,8",
    ),
    (
        setting([0, 0, 0, 2], "instrument_pointing", "quaternions", 1),
        "error.at /instrument_pointing/quaternions: error.at: csm.record 2: format.length 2.0",
    ),
    (
        setting([1.0] * 9, "body_rotation", "constant_rotation"),
        "error.at /body_rotation/constant_rotation: error.at constant_rotation[0]: error.kind a rotation",
    ),
    (
        setting(1e9, "body_rotation", "ephemeris_times", 4),
        "error.at /body_rotation/ephemeris_times: error.at ephemeris_times[5]: error.kind a finite time",
    ),
]


@pytest.mark.parametrize(("change", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_what_is_wrong_is_named(tmp_path, change, said):
    data = json.loads(json.dumps(document()))
    change(data)
    path = written(tmp_path, data)
    with rejected(said) as caught:
        read_support(path)
    assert caught.value.file == path


def test_lines_that_the_tables_do_not_reach_are_named(tmp_path):
    data = document()
    data["line_scan_rate"] = [[0.5, -2.0, 0.02]]
    own = image(tmp_path, data)
    (remark,) = own.isd.remarks
    assert has_code(remark, "csm.duration", lines=400)
    assert [remark.fields[name] for name in ("span", "table", "percent")] == pytest.approx([8, 4, 50])
    with pytest.raises(InputError, check=coded("csm.reach", line=300, image="I", time=1006)):
        own.to_ground([100.0, 300.0], [1.0, 1.0])


def test_ways_to_count_and_to_join_have_names(tmp_path):
    for name, value in (("pixels", "corner"), ("interpolation", "cubic")):
        with rejected(f"error.at {name}: error.choice isis,csm {value}"):
            image(tmp_path, document(), **{name: value})
    with rejected("format.shape lines (2,) (1,)"):
        image(tmp_path, document()).coordinates([1.0, 2.0], [1.0])


def places(value, at=()):
    """Yield where things stand in a document; of lists the first and the last."""
    if at:
        yield at
    inside = value.items() if isinstance(value, dict) else []
    if isinstance(value, list):
        inside = {k: value[k] for k in (0, len(value) - 1)}.items() if value else []
    for key, each in inside:
        yield from places(each, (*at, key))


HOSTILE = [None, True, "x", "", [], {}, [None], [[]], {"a": 1}, -1, 0, 0.5, 1e15, -1e299, [1e299] * 3, 10**30]


@pytest.mark.parametrize("kind", ["LINE_SCANNER", "FRAME", "PUSH_FRAME"])
def test_whatever_stands_in_a_document_is_understood_or_refused(tmp_path, kind):
    plain = json.dumps(document(kind, records=9) | {"naif_keywords": {}})
    known = 0
    for at in list(places(json.loads(plain))):
        for hostile in HOSTILE:
            data = json.loads(plain)
            setting(hostile, *at)(data)
            try:
                with np.errstate(all="ignore"):
                    own = image(tmp_path, data)
                    own.to_image(own.to_ground([100.0], [100.0]))
                known += 1
            except InputError:
                continue
            except Exception as error:
                raise AssertionError(f"{at} = {hostile}: {error!r}") from error
    assert known > 20
