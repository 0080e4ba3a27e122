"""Cameras over years: what changed is named, whatever model or balance the calibrations have."""

import json
import math
from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from message_codes import coded, has_code
from photogram import Camera, InputError
from photogram.film import DatedCamera, compare_cameras
from photogram.film.years import figures_of, simulated_certificates

ANGLE = math.radians(40)
NAMES = ("c", "xp", "yp", "A1", "A2", "B1", "B2", "C1", "C2")
SD = np.array([5e-3, 3e-3, 3e-3, 5e-9, 3e-13, 1e-7, 1e-7, 1e-5, 1e-5])
VALUES = np.array([-152.3, 0.004, -0.012, 4e-8, -1e-12, 2e-7, -1e-7, 0.0, 0.0])


def camera(values=VALUES, covariance=None):
    matrix = np.diag(SD**2) if covariance is None else covariance
    return Camera(
        "brown_forward", dict(zip(NAMES, values, strict=True)), covariance=(NAMES, matrix), name="a"
    )


def test_the_step_of_the_example_is_found_and_ends_with_4(run):
    done = run("camera", "compare", "--example", "--json", "c.json")
    assert done.exit_code == 4, done.output
    assert "principal distance steps by 0.01656 ± 0.0026 mm between 1980-02-27 and 1983-05-11" in done.stdout
    with open("c.json", encoding="utf-8") as file:
        document = json.load(file)
    (own,) = document["cameras"].values()
    assert own["angle_rad"] == pytest.approx(ANGLE)
    assert [each["name"] for each in own["series"]] == [
        *("principal distance", "shift x", "shift y", "radial 3", "radial 5")
    ]
    assert own["series"][0]["changes"][0]["occasion"] == "1983-05-11"
    with open("camera-compared/report.html", encoding="utf-8") as file:
        assert "Control charts" in file.read()


def test_nothing_is_named_where_nothing_changes():
    before = simulated_certificates()[:3]
    found = compare_cameras(before)
    assert found.verdict.exit == 0
    assert "nothing changed between 1974-03-12 and 1980-02-27" in str(found.verdict.lines)


def test_figures_of_a_known_camera():
    r = abs(VALUES[0]) * math.tan(ANGLE)
    found = figures_of([camera(), camera()], ANGLE)
    values = dict(zip(found.names, found.values[0], strict=True))
    a1, a2, b1, b2 = VALUES[3:7]
    # r^3 = r0^3 (R3 + 2 R1) / 3, r^5 = r0^5 (R5 + 4 R3 + 5 R1) / 10.
    assert values["radial 5"] == pytest.approx(1e3 * a2 * r**5 / 10)
    assert values["radial 3"] == pytest.approx(1e3 * (a1 * r**3 / 3 + 0.4 * a2 * r**5))
    scale = r + a1 * r**3 * 2 / 3 + a2 * r**5 / 2
    assert values["principal distance"] == pytest.approx(scale / math.tan(ANGLE))
    assert values["decentring x"] == pytest.approx(1e3 * b1 * r**2)
    assert values["decentring y"] == pytest.approx(1e3 * b2 * r**2)
    # The mean of decentring over the field is a shift.
    assert values["shift x"] == pytest.approx(1e3 * (VALUES[1] + b1 * r**2))
    assert found.held == ()


def test_the_covariance_is_that_of_many_cameras():
    rng = np.random.default_rng(5)
    many = figures_of([camera(VALUES + SD * rng.standard_normal(9)) for _ in range(300)], ANGLE)
    assert many.values.std(axis=0) == pytest.approx(np.sqrt(np.diag(many.covariances[0])), rel=0.15)


def test_models_and_balances_of_one_lens_are_alike():
    certificate = simulated_certificates()[0]
    forward, backward = certificate.camera(), certificate.camera("brown")
    moved = replace(
        certificate,
        c=certificate.c * 1.0001,
        radial=replace(
            certificate.radial,
            distortion=certificate.radial.distortion
            - 1e-4 * certificate.c * np.tan(certificate.radial.angle),
        ),
    )
    for other in (backward, moved.camera()):
        found = figures_of([forward, other], ANGLE)
        sd = np.sqrt(np.diag(found.covariances[0]))
        assert (np.abs(found.values[1] - found.values[0]) < 0.02 * sd).all()
        assert np.sqrt(np.diag(found.covariances[1])) == pytest.approx(sd, rel=0.01)


def test_pixels_count_downwards_and_are_compared_as_others():
    names = ("fx", "fy", "cx", "cy")
    own = Camera(
        "opencv",
        {"fx": 3000.0, "fy": 3000.0, "cx": 2000.0, "cy": 1500.0},
        covariance=(names, np.diag([0.5, 0.5, 0.3, 0.3])),
    )
    found = figures_of([own, own], math.radians(30))
    values = dict(zip(found.names, found.values[0], strict=True))
    assert values["principal distance"] == pytest.approx(3000.0)
    assert (values["shift x"], values["shift y"]) == pytest.approx((2000.0, -1500.0))
    with pytest.raises(InputError, check=coded("films.two-units")):
        figures_of([own, camera()], ANGLE)


def test_what_some_calibrations_hold_is_not_compared_and_told():
    held = Camera(
        "brown_forward",
        dict(zip(NAMES, VALUES, strict=True)),
        covariance=(("c",), np.array([[2.5e-5]])),
        name="a",
    )
    days = [date(1980 + k, 5, 1) for k in range(3)]
    found = compare_cameras(
        [DatedCamera(day, one, ANGLE) for day, one in zip(days, [camera(), held, held], strict=True)]
    )
    (own,) = found.histories.values()
    assert [each.name for each in own.series] == ["principal distance"]
    assert has_code(found.remarks[0], "films.not-compared", camera="camera a")


def test_other_cameras_and_single_calibrations():
    years = simulated_certificates()
    found = compare_cameras([*years[:3], replace(years[0], name="other")])
    assert list(found.histories) == ["camera rc10-2345"]
    (remark,) = found.remarks
    assert has_code(remark, "films.single-calibration", camera="camera other")
    with pytest.raises(InputError, check=coded("films.two-calibrations")):
        compare_cameras([years[0]])
    with pytest.raises(InputError, check=coded("films.repeated")):
        compare_cameras([years[0], years[0]])
    with pytest.raises(InputError, check=coded("films.undated", certificate="rc10-2345")):
        compare_cameras([years[0], replace(years[1], day=None)])
    with pytest.raises(InputError, check=coded("films.unknown-angle")):
        compare_cameras([DatedCamera(date(1980, 1, k), camera()) for k in (1, 2)])
    with pytest.raises(InputError, check=coded("films.no-covariance")):
        DatedCamera(date(1980, 1, 1), Camera("perspective", {"c": -150.0}))


def test_files_of_certificates_and_of_stars(run, tmp_path):
    head = '[certificate]\ncamera = "a"\ndate = 19{}-05-11\nc = 152.3\n[certificate.radial]\n'
    for year in (80, 85):
        text = head.format(year) + "angle = [10, 20, 30, 40]\ndistortion = [1, 2, 1, -2]\n"
        (tmp_path / f"{year}.toml").write_text(text)
    done = run("camera", "80.toml", "85.toml", "--no-html", "--json", "r.json")
    assert done.exit_code == 0, done.output
    verdict = json.loads((tmp_path / "r.json").read_bytes())["verdict"]
    assert "nothing changed between 1980-05-11 and 1985-05-11" in str(verdict["lines"])
    (tmp_path / "camera.json").write_text("{}")
    done = run("camera", "80.toml", "camera.json")
    assert done.exit_code == 1
    assert "must contain a date" in done.stderr
    done = run("camera", "80.toml", "85.toml", "--day", "1990-01-01")
    assert done.exit_code == 2
