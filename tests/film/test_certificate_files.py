"""Certificates as files: what is read, turned, refused, and what `photogram certificate` says of it."""

import json
import math
from importlib.resources import files

import numpy as np
import pytest

from message_codes import as_check, coded, codes, has_code
from photogram import Camera, InputError
from photogram.film import Certificate

EXAMPLE = (files("photogram") / "examples" / "certificate" / "rc10.toml").read_text(encoding="utf-8")
HEAD = '[certificate]\ncamera = "a"\n'


@pytest.fixture
def written(tmp_path):
    """Write a certificate and read it."""

    def read(text, name="certificate.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return Certificate.read(path)

    return read


def test_the_example_is_accepted(run):
    done = run("certificate", "--example", "--json", "c.json", "--html", "c.html")
    assert done.exit_code == 0, done.output
    assert "4 distances agree with the coordinates: largest difference 3.3 um" in done.stdout.lower()
    with open("c.json", encoding="utf-8") as file:
        document = json.load(file)
    assert document["kind"] == "certificate"
    assert document["date"] == "1983-05-11"
    assert document["lens"]["terms"] == 1
    assert [each["model"] for each in document["cameras"]] == ["brown_forward", "brown"]
    assert len(document["marks"]["covariance_mm2"]["matrix"]) == 16
    with open("c.html", encoding="utf-8") as file:
        assert "Distances beside coordinates" in file.read()


def test_exchanged_digits_end_with_4_and_are_named(run, tmp_path):
    (tmp_path / "c.toml").write_text(EXAMPLE.replace("220.018", "220.108"), encoding="utf-8")
    done = run("certificate", "c.toml")
    assert done.exit_code == 4
    printed = " ".join(done.stdout.split())
    assert "ml-mr is 220.108 mm, by coordinates 220.018 mm" in printed
    assert "perhaps ml-mr 220.018 for 220.108 (exchange)" in printed


def test_figures_are_explained_as_they_were_typed(written):
    certificate = written(EXAMPLE.replace("220.002", "220.020"))
    (each,) = (one for one in certificate.check() if one.beyond)
    names, changes, leaves, _ = certificate.document().table("explanations").columns
    assert set(names.values) == {each.name}
    assert changes.values == [*map(str, each.explanations)]
    assert leaves.values.tolist() == [one.remaining for one in each.explanations]
    assert each.explanations[0].typed == "220.020"
    assert each.explanations[0].perhaps == "220.002"


def test_a_strip_on_top_is_turned_to_the_left(written):
    left = written(EXAMPLE)
    # The same camera, its report with the strip on top: (x, y) was (y, -x), the left was the top.
    name = {"ll": "ul", "lr": "ll", "ur": "lr", "ul": "ur", "ml": "mt", "mb": "ml", "mr": "mb", "mt": "mr"}
    text = HEAD + 'type = "Wild RC10"\ndate = 1983-05-11\ndata_strip = "top"\nc = 152.387\nsd_c = 0.003\n'
    x, y = left.autocollimation
    text += f"autocollimation = [{y}, {-x}]\n[certificate.fiducials]\n"
    text += "".join(f"{name[mark]} = [{y}, {-x}]\n" for mark, (x, y) in left.places.items())
    text += "[certificate.distances]\n"
    text += "".join(f"{name[d.first]}-{name[d.second]} = {d.length}\n" for d in left.distances)
    top = written(text, "top.toml")
    assert {mark: pytest.approx(place) for mark, place in left.places.items()} == top.places
    assert top.autocollimation == pytest.approx(left.autocollimation)
    assert [each.difference for each in top.check()] == pytest.approx([d.difference for d in left.check()])


@pytest.mark.parametrize("names", [("1", "2", "5", "8"), ("1", "2", "A", "C"), ("LL", "ur", "ml", "mb")])
def test_numbers_and_letters_of_reports_are_sides(written, names):
    text = (
        HEAD + "[certificate.fiducials]\n" + "".join(f"{each} = [{k}, 0]\n" for k, each in enumerate(names))
    )
    assert list(written(text).places) == ["ll", "ur", "ml", "mb"]


WRONG = {
    "no table": ("[camera]\nc = 1\n", coded("error.unknown", kind="table", name="camera")),
    "unknown key": (HEAD + "focal = 152\n", coded("error.unknown.close", kind="key", name="focal")),
    "unit": (HEAD + 'unit = "in"\n', coded("error.choice", value="in", names=["mm"])),
    "strip": (HEAD + 'data_strip = "right"\n', coded("error.choice", names=["left", "top"])),
    "date": (HEAD + 'date = "11.5.1983"\n', coded("error.day")),
    "c": (HEAD + "c = 0\n", coded("error.key", key="c", message="error.positive")),
    "reference": (HEAD + 'principal_point = "centre"\n', coded("error.choice", value="centre")),
    "place": (HEAD + "[certificate.fiducials]\nll = [1, 2, 3]\n", coded("error.key", key="ll")),
    "infinite": (HEAD + "[certificate.fiducials]\nll = [inf, 2]\n", coded("error.finite")),
    "twice": (
        HEAD + "[certificate.fiducials]\nll = [1, 2]\n1 = [1, 2]\n",
        coded("error.repeated", kind="mark", name="ll"),
    ),
    "pair": (HEAD + "[certificate.distances]\nml = 220\n", coded("films.pair-of-marks")),
    "pair twice": (HEAD + "[certificate.distances]\nml-mr = 220\nmr-ml = 220\n", coded("error.repeated")),
    "length": (HEAD + "[certificate.distances]\nml-mr = 0\n", coded("error.key", key="ml-mr")),
    "radial without c": (
        HEAD + "[certificate.radial]\nangle = [1]\ndistortion = [1]\n",
        coded("error.requires", other="c"),
    ),
    "angles": (
        HEAD + "c = 150\n[certificate.radial]\nangle = [95]\ndistortion = [1]\n",
        coded("films.angles"),
    ),
    "both": (
        HEAD + "c = 150\n[certificate.radial]\nangle = [9]\nradius = [9]\ndistortion = [1]\n",
        coded("error.exclusive"),
    ),
    "lengths": (
        HEAD + "c = 150\n[certificate.radial]\nangle = [9, 8]\ndistortion = [1]\n",
        coded("error.key", key="distortion"),
    ),
    "sign": (HEAD + "c = 150\n[certificate.tangential]\nJ1 = 1e-8\nphi0 = 3\n", coded("films.sign")),
    "lines": (
        HEAD + '[[certificate.lines]]\nmarks = ["ml", "mr"]\nsd_place = 1\n',
        coded("films.four-marks"),
    ),
    "idle lines": (
        HEAD + '[[certificate.lines]]\nmarks = ["ml", "mr", "mb", "mt"]\n',
        coded("films.line-without-sd"),
    ),
    "origin": (HEAD + 'principal_point = "symmetry"\nsymmetry = [0.1, 0]\n', coded("films.origin")),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_used_is_refused_by_name(written, case):
    text, message = WRONG[case]
    with pytest.raises(InputError, check=as_check(message)) as caught:
        written(text)
    assert caught.value.file.name == "certificate.toml"


def test_distances_alone_need_places_to_start_from(written):
    text = HEAD + "[certificate.distances]\nml-mr = 220\n"
    with pytest.raises(InputError, check=coded("films.no-design", certificate="a", marks=["ml", "mr"])):
        written(text).fiducials()
    designed = written(f"{text}[certificate.design]\nml = [-110, 0]\nmr = [110, 0]\n")
    # Two marks have one distance: their figure is free.
    assert designed.fiducials().adjusted.free == 3
    assert (
        written(text.replace("[certificate.d", 'type = "RC 8"\n[certificate.d')).fiducials().adjusted
        is not None
    )


def test_distances_of_another_unit_are_found(written):
    text = HEAD + 'type = "RC10"\n[certificate.distances]\nml-mr = 8.661\nmt-mb = 8.661\n'
    assert written(text).verdict.exit == 4


def test_the_principal_point_is_where_it_is_in_the_frame_of_the_marks(written):
    camera = written(EXAMPLE).camera()
    assert isinstance(camera, Camera)
    assert (camera.parameters["xp"], camera.parameters["yp"]) == (0.004, -0.012)
    assert camera.deviations[camera.names.index("xp")] == pytest.approx(0.003)
    own = written(HEAD + "c = 150\n")
    assert own.principal_point == ((0.0, 0.0), 0.02, "fiducial-centre")
    assert has_code(own.told()[0], "films.unknown-point", sd=0.02)
    moved = written(
        HEAD + 'c = 150\nprincipal_point = "autocollimation"\n[certificate.fiducials]\nll = [-1, -1]\n'
    )
    assert moved.principal_point == ((0.0, 0.0), 0.003, "autocollimation")


def test_a_tangential_profile_is_largest_along_its_axis(written):
    text = EXAMPLE.replace("sd_c", "tangential_sign = 1\nsd_c")
    text += "[certificate.tangential]\nphi0 = 30\nangle = [20, 40]\ndisplacement = [2.0, 10.7]\n"
    certificate = written(text)
    camera, c = certificate.camera(), certificate.c
    straight = camera.replace(parameters={**camera.parameters, "B1": 0.0, "B2": 0.0})
    r, sizes = 100.0, []
    for azimuth in np.radians(np.arange(0, 360, 5)):
        u = np.array([[r / c * math.cos(azimuth), r / c * math.sin(azimuth), -1.0]])
        bent = (camera.project(u) - straight.project(u))[0]
        sizes.append(bent @ [-math.sin(azimuth), math.cos(azimuth)])
    assert np.argmax(sizes) * 5 == 30
    assert max(sizes) == pytest.approx(certificate.tangential.j1 * r**2, rel=1e-3)
    with pytest.raises(InputError, check=coded("films.decentring")):
        certificate.camera("brown")


def test_four_semi_diagonals_give_their_own_standard_deviation(written):
    rows = {"ll": [-4, -11, -9, -2], "ul": [-4, -10, -9, 1], "ur": [-4, -10, -7, 4], "lr": [-4, -11, -9, 0]}
    text = HEAD + "c = 152\n[certificate.radial]\nangle = [10, 20, 30, 40]\n"
    certificate = written(text + "".join(f"{name} = {values}\n" for name, values in rows.items()))
    left = [(a + c - b - d) / 2 for a, b, c, d in zip(*rows.values(), strict=True)]
    assert certificate.radial.sd == pytest.approx(1e-3 * math.sqrt(np.mean(np.square(left))) / 2)
    assert certificate.radial.distortion == pytest.approx(1e-3 * np.mean([*rows.values()], axis=0))
    assert has_code(certificate.told()[0], "films.decentring-of-diagonals")
    assert certificate.told()[0].fields["size"] == pytest.approx(3, abs=0.5)


def test_radii_about_the_indicated_point_are_told_from_decentring(written):
    """The point of symmetry is 18 um away; what is left beside it grows with the square of the radius."""
    angle, centre = np.array([10.0, 20.0, 30.0, 40.0]), np.array([12.0, -14.0])
    common = np.array([-4.0, -10.0, -8.0, 1.0]) + 0.1 * np.array([1.0, -1.0, 1.0, -1.0])
    towards = {"ll": (-1, -1), "ul": (-1, 1), "ur": (1, 1), "lr": (1, -1)}
    lateral = 1.5 * np.tan(np.radians(angle)) ** 2
    rows = {
        name: common + (centre @ way + way[0] * lateral) / math.sqrt(2) + 0.05 * way[0] * way[1]
        for name, way in towards.items()
    }
    text = HEAD + "c = 152\n[certificate.radial]\nangle = [10, 20, 30, 40]\n"
    certificate = written(text + "".join(f"{name} = {own.tolist()}\n" for name, own in rows.items()))
    away, decentring = certificate.told()[:2]
    assert has_code(away, "films.symmetry-elsewhere")
    assert (away.fields["x"], away.fields["y"]) == pytest.approx((0.012, -0.014), abs=5e-4)
    assert decentring.code == "films.decentring-of-diagonals"
    assert decentring.fields["size"] == pytest.approx(0.75, abs=0.05)
    assert certificate.radial.distortion == pytest.approx(1e-3 * common)


def test_a_table_that_counts_inwards_says_so(written):
    turned = EXAMPLE.replace("distortion = [-4, -9, -11, -7, -1, 7]", "distortion = [4, 9, 11, 7, 1, -7]")
    given = written(turned.replace("[certificate.radial]", "[certificate.radial]\nsign = -1"))
    assert given.camera().parameters == written(EXAMPLE).camera().parameters
    with pytest.raises(InputError, check=coded("error.key", key="sign", message="films.sign")):
        written(turned.replace("[certificate.radial]", "[certificate.radial]\nsign = 0"))


def test_printed_coefficients_are_compared_with_the_table(written):
    certificate = written(EXAMPLE)
    curve = certificate.curve()
    right = ", ".join(repr(float(each)) for each in curve.coefficients)
    text = EXAMPLE.replace("sd_c =", "radial_coefficients = [{}]\nsd_c =")
    assert not {"films.printed", "films.printed-other-sign"} & set(codes(written(text.format(right)).told()))
    wrong = ", ".join(repr(-float(each)) for each in curve.coefficients)
    assert "films.printed-other-sign" in codes(written(text.format(wrong)).told())


def test_tables_of_several_cameras_with_covariances(tmp_path):
    (tmp_path / "fiducials.csv").write_text(
        "camera,fiducial,x,y,sd_x,sd_y,use\na,1,-106.0,-105.99,0.003,,\na,2,106,106,,,off\nb,ll,1,2,,,\n"
    )
    with pytest.raises(InputError, check=coded("films.choose-camera", cameras=["a", "b"])):
        Certificate.read(tmp_path / "fiducials.csv")
    own = Certificate.read(tmp_path / "fiducials.csv", "a")
    (remark,) = own.told()
    assert has_code(remark, "films.marks-off", marks=["ur"])
    assert np.sqrt(np.diag(own.fiducials().covariance)) == pytest.approx([0.003, 0.002])
    (tmp_path / "covariances.csv").write_text(
        "kind,name,first,second,covariance\nfiducials,a,ll.x,ll.y,2e-6\ncamera,a,c,c,1\n"
    )
    assert Certificate.read(tmp_path / "fiducials.csv", "a").fiducials().covariance[0, 1] == 2e-6
    (tmp_path / "covariances.csv").write_text("kind,name,first,second,covariance\nfiducials,a,ll.x,ll.y,1\n")
    with pytest.raises(InputError, check=coded("error.covariance-singular")):
        Certificate.read(tmp_path / "fiducials.csv", "a")


@pytest.mark.parametrize("word", ["off", "No", "false", "0"])
def test_marks_are_off_by_the_words_of_plain_projects(written, word):
    own = written(f"camera,fiducial,x,y,use\na,ll,1,2,yes\na,ur,3,4,{word}\n", "fiducials.csv")
    assert own.places == {"ll": (1.0, 2.0)}
    (remark,) = own.told()
    assert has_code(remark, "films.marks-off", marks=["ur"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("camera,fiducial,x\na,1,2\n", "column y is missing"),
        ("camera,fiducial,x,y\na,1,2,\n", coded("error.column", column="y", message="error.empty")),
        ("camera,fiducial,x,y\na,1,2,3\na,ll,2,3\n", coded("error.repeated")),
        ("camera,fiducial,x,y,sd_x,sd_y\na,1,2,3,0,1\n", coded("error.positive")),
        ("camera,fiducial,x,y,use\na,1,2,3,maybe\n", coded("error.flag", value="maybe")),
        ("camera,fiducial,x,y,colour\na,1,2,3,red\n", coded("error.unknown", kind="column", name="colour")),
    ],
)
def test_tables_that_cannot_be_used(written, text, message):
    with pytest.raises(InputError, check=as_check(message)):
        written(text, "fiducials.csv")
