"""Results of blocks with photos on trajectories: numbers, units, reports, tests, covariances."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from message_codes import raises
from moving_blocks import rolling, scanned
from photogram import (
    AdjustmentError,
    Camera,
    InnerConstraints,
    InputError,
    MinimumConstraints,
    RankError,
    adjust,
    clean,
    eliminate_terms,
    group_sums,
    score_test,
    snoop,
    terms_test,
    variance_components,
    variance_function,
)
from photogram.formats import Project, read, to_files
from photogram.network import (
    Attitude,
    Boresight,
    Clock,
    Lines,
    Prior,
    Readout,
    Sensor,
    Spline,
    Table,
    Timed,
    Trajectory,
)
from photogram.network.motion import kept_images
from photogram.results.trajectories import trajectories_table
from photogram.show.page import about


@pytest.fixture(scope="module")
def drone():
    return adjust(rolling())


@pytest.fixture(scope="module")
def scan():
    return adjust(scanned(photos=True, smooth=True))


def unknown(result, name):
    return next(each for each in result.unknowns if each.name == name)


def test_values_are_values(drone):
    """A readout time given as 20 ms was told as 14 ms: the change of it."""
    readout = unknown(drone, "drone")
    assert readout.values == pytest.approx(readout.change + 0.02)
    assert abs(readout.values[0] - 0.03) < 4 * readout.sd[0]
    assert (readout.components, readout.units) == (("time",), ("s",))
    table = drone.unknown_table()
    row = table[table["unknown"] == "drone"].iloc[0]
    assert (row["value"], row["unit"], row["component"]) == (readout.values[0], "s", "time")
    told = next(each for each in json.loads(drone.to_json())["unknowns"] if each["name"] == "drone")
    assert told["value"] == [readout.values[0]]
    asked = drone.propagate(lambda x: 3000 / x[0], ("unknown", "drone"))
    assert asked.value == pytest.approx(3000 / readout.values[0])
    speed = unknown(drone, "IMG_1 position 1")
    np.testing.assert_allclose(speed.values, speed.given.position + speed.change)


def test_units_of_what_moves(scan):
    units = {each.name: (each.components, each.units) for each in scan.unknowns}
    assert units["receiver"] == (("offset",), ("s",))
    assert units["gyro"] == (("x", "y", "z"), ("rad/s",) * 3)
    assert units["strip 1 position 0"] == (("x", "y", "z"), ("m",) * 3)
    assert units["strip 2 rotation 0"] == (("x", "y", "z"), ("rad",) * 3)
    kinds = {name: each.units for name, each in scan.kinds.items()}
    assert kinds["velocity"] == ("m/s",) * 3
    assert kinds["rate"] == ("rad/s",) * 3
    images = scan.image_table()
    assert "residual_x_mm" in images


def test_a_factor_of_line_rates_is_a_plain_number():
    block = scanned()
    own = [
        Timed(
            each.photo,
            each.trajectory,
            lines=each.lines,
            line_sensor=each.line_sensor,
            rate=Readout(f"rate {k}", sd=1e-4),
        )
        for k, each in enumerate(block.timed)
    ]
    result = adjust(block.replace(timed=own))
    rate = unknown(result, "rate 0")
    assert (rate.components, rate.units) == (("factor",), ("",))
    assert rate.values == pytest.approx(1.0, abs=1e-3)
    assert "factor" in result.report()


def test_open_unknowns_beside_trajectories():
    """A boresight without a value beside smoothness ended in a traceback; a sensor in a word on frames."""
    assert adjust(scanned(smooth=True)).converged
    block = scanned(photos=True)
    *others, last = block.timed
    with pytest.raises(InputError, match=r"F2.*trajectory"):
        adjust(
            block.replace(timed=[*others, Timed(last.photo, last.trajectory, last.time, sensor=Sensor("f"))])
        )
    imu = Boresight("imu")
    only = [each for each in block.observations if not isinstance(each, Attitude)]
    assert adjust(block.replace(observations=only)).converged
    assert imu.is_open


def test_what_is_given_of_a_pose_is_given_of_its_trajectory():
    """Weighted positions of photos that move had residuals without redundancy, and counted twice."""
    result = adjust(rolling().replace(photo_position_sd=0.1))
    assert np.isinf(result.photo_given_sd).all()
    assert len(result.station_table()) == 0
    assert "positions" not in {each.name for each in group_sums(result).groups}
    coefficient = unknown(result, "IMG_1 position 0")
    assert (coefficient.redundancy > 0.3).all()
    total = result.redundancies.total
    parts = result.redundancy.sum() + result.point_redundancy.sum()
    parts += sum(each.redundancy.sum() for each in result.unknowns)
    assert parts == pytest.approx(total, abs=1e-6)


def test_the_report_names_and_counts(scan):
    document, report = scan.document(), scan.report()
    for line in report.splitlines():
        assert "receiverX" not in line
        assert "position 0x" not in line
    assert "coefficients of trajectories are not listed" in report
    assert "position coefficient strip 1 position 3" not in report
    trajectories = {column.head: column.values for column in document.table("trajectories").columns}
    row = list(zip(trajectories["Trajectory"], trajectories["Of"], strict=True)).index(
        ("strip 2", "rotation")
    )
    assert trajectories["Basis"][row] == "spline of degree 3"
    assert about("poses") in " ".join(report.split())
    page = scan.to_html().decode()
    assert about("poses") in page
    assert ">strip 1 position 3<" not in page
    table = scan.unknown_table()
    assert (table["unknown"] == "strip 1 position 3").sum() == 3


def test_many_coefficients_do_not_flood_the_report():
    block = scanned(smooth=True)

    def finer(own):
        return Trajectory(
            own.name,
            own.table,
            position=Spline(0.02, sd=1.0, smooth=(2, 1e-3)),
            rotation=Spline(0.02, sd=0.01, smooth=(2, 1e-5)),
        )

    new = {each.name: finer(each) for each in block.trajectories}
    observations = [
        replace(each, trajectory=new[each.trajectory.name])
        for each in block.observations
        if each.KIND != "smoothness"
    ]
    timed = [
        Timed(each.photo, new[each.trajectory.name], lines=each.lines, line_sensor=each.line_sensor)
        for each in block.timed
    ]
    result = adjust(block.replace(timed=timed, observations=observations))
    assert len(result.unknowns) > 1900
    report = result.report()
    assert len(report.splitlines()) < 1200
    assert "coefficients of trajectories" in report
    assert "components with the largest test values" in report
    assert len(result.to_html()) < 2_000_000
    assert len(result.unknown_table()) == 3 * len(result.unknowns) - 2


def test_largest_corrections(scan):
    """They are those of the basis at all times of the table, not of its coefficients."""
    for each in trajectories_table(scan).record():
        own = next(one for one in scan.block.trajectories if one.name == each["trajectory"])
        basis = getattr(own, each["what"])
        values = [unknown(scan, f"{own.name} {each['what']} {k}").position for k in range(basis.count)]
        curve = BSpline(basis.knots, np.array(values), basis.degree)
        largest = np.linalg.norm(curve(np.linspace(each["first"], each["last"], 5001)), axis=1).max()
        assert each["largest"] == pytest.approx(largest, rel=1e-3)
        assert each["largest"] == pytest.approx(np.linalg.norm(curve(each["at"])), rel=1e-9)


def test_a_photo_is_its_trajectory_at_its_time(scan):
    """Covariances of a photo are those of the coefficients, whichever way they are asked for."""
    own = scan.covariance(("photo", "F1"))
    np.testing.assert_allclose(own, scan.photo_covariances[3], rtol=1e-6, atol=1e-9)
    step = scan.covariance(("step", "F1"))
    np.testing.assert_allclose(step[:3, :3], own[:3, :3], rtol=1e-9)
    basis = scan.block.trajectories[3].position
    names = [f"strip 1 position {k}" for k in range(basis.count)]
    joint = scan.covariance(("unknown", names))
    at = BSpline.design_matrix([scan.block.timed[3].time], basis.knots, basis.degree).toarray()
    values = np.kron(at, np.eye(3))
    np.testing.assert_allclose(values @ joint @ values.T, own[:3, :3], rtol=1e-9)


@pytest.mark.parametrize("block", [rolling, scanned])
def test_a_datum_of_trajectories_that_have_one(block):
    block = block()
    result = adjust(block)
    first = block.photo_ids[0]
    for ask in (
        lambda: result.relative_to(photo=first),
        lambda: result.relative_to(points=block.point_ids[:5]),
    ):
        with raises(InputError, "block.unsupported.trajectories"):
            ask()
    for datum in (InnerConstraints(photos=[first]), InnerConstraints(attitudes=None)):
        with raises(InputError, "block.datum.moving"):
            adjust(block, datum=datum)
    for ask in (
        lambda: result.in_datum(InnerConstraints()),
        lambda: adjust(block, datum=InnerConstraints()),
    ):
        with pytest.raises(AdjustmentError, match="requires a free block"):
            ask()
    assert adjust(block, datum=MinimumConstraints(first)).datum.kind == "observations"
    with raises(InputError, "block.unsupported.trajectories"):
        block.with_fixed_photos()


def test_restarted(scan, drone):
    for result in (scan, drone):
        again = adjust(result.restarted())
        assert again.sums_of_squares.total == pytest.approx(result.sums_of_squares.total, rel=1e-5)


def loosened(block, **bases):
    """Return a block whose trajectories have other bases."""
    known = {}

    def meant(given):
        return known.setdefault(id(given), replace(given, **bases))

    others = [each for each in block.observations if each.KIND != "smoothness"]
    return block.replace(
        timed=[replace(each, trajectory=meant(each.trajectory)) for each in block.timed],
        observations=[replace(each, trajectory=meant(each.trajectory)) for each in others],
    )


def test_restarted_trajectories(tmp_path):
    """Free coefficients start where they have ended; what is given of weighted ones is an observation."""
    free = np.array([np.inf, np.inf, 1.0])
    block = loosened(
        scanned(),
        position=Spline(2.0, value=[0.0, 0.0, 0.1], sd=free, smooth=(2, 0.3)),
        rotation=Spline(2.0, sd=0.01),
    )
    result = adjust(block)
    started = result.restarted()
    assert len(started.all_trajectories) == 2
    assert len(started.observations) == len(block.observations)
    assert {id(each.trajectory) for each in started.timed} == {id(each) for each in started.all_trajectories}
    for own, given in zip(started.all_trajectories, block.all_trajectories, strict=True):
        found = result.trajectories[own.name]
        values = np.array([each.position for each in own.coefficients[0]])
        np.testing.assert_array_equal(values[:, :2], found.position[:, :2])
        assert np.abs(values[:, :2]).max() > 0.1
        assert (values[:, 2] == 0.1).all()
        assert not np.array([each.position for each in own.coefficients[1]]).any()
        assert own.table is given.table
    again = adjust(started)
    assert len(again.iterations) < len(result.iterations)
    assert again.sums_of_squares.total == pytest.approx(result.sums_of_squares.total, rel=1e-6)
    (smooth,) = (name for name in result.kinds if name.startswith("smoothness"))
    assert again.kinds[smooth].sum_of_squares == pytest.approx(result.kinds[smooth].sum_of_squares, rel=1e-4)
    none = (None,) * len(started.cameras)
    starts = np.full((len(started.point_ids), 3), np.nan)
    project = Project(block=started, path=tmp_path, title="", sizes=none, pixel_mm=none, starts=starts)
    for name, content in to_files(project, "plain").items():
        (tmp_path / name).write_bytes(content)
    read_again = read(tmp_path).block
    for own, one in zip(read_again.all_trajectories, started.all_trajectories, strict=True):
        both = [np.array([each.position for each in all_.coefficients[0]]) for all_ in (own, one)]
        np.testing.assert_allclose(*both, rtol=0, atol=1e-12)


def test_restarted_coefficients_with_priors():
    """A prior is of the value that its coefficient was given: it does not move."""
    block = loosened(scanned(), position=Spline(2.0, sd=np.inf), rotation=Spline(2.0, sd=0.01))
    first = block.all_trajectories[0].coefficients[0][0]
    result = adjust(block.replace(observations=[*block.observations, Prior(first, sd=0.5)]))
    started = result.restarted()
    own = started.all_trajectories[0].coefficients[0]
    assert not own[0].position.any()
    assert all(each.position.any() for each in own[1:])
    assert [each.unknown for each in started.observations if isinstance(each, Prior)] == [own[0]]
    again = adjust(started)
    assert again.sums_of_squares.total == pytest.approx(result.sums_of_squares.total, rel=1e-6)


def test_restarted_motions_of_photos():
    """A free velocity starts where it has ended, with the pose from which it counts."""
    block = rolling(readout=0.03)
    result = adjust(block.replace(timed=[replace(each, sd_velocity=np.inf) for each in block.timed]))
    started = result.restarted()
    for own in started.timed:
        found = result.trajectories[own.photo]
        np.testing.assert_array_equal(own.velocity, found.position[1])
        assert not np.asarray(own.rotation_rate).any()
    again = adjust(started)
    assert again.initial_weighted_sum_of_squares < result.initial_weighted_sum_of_squares
    assert again.sums_of_squares.total == pytest.approx(result.sums_of_squares.total, rel=1e-6)


@pytest.mark.parametrize("groups", ["kind", "photo", "strip", "camera", "component"])
def test_sums_over_groups_where_there_are_records(scan, groups):
    """Arrays of the core have a row for each record behind those of the photos."""
    found = group_sums(scan, groups)
    of_unknowns = sum(each.redundancy.sum() for each in scan.unknowns)
    total = sum(each.redundancy for each in found.groups) + of_unknowns
    assert total == pytest.approx(scan.degrees_of_freedom, abs=1e-6)
    for each in found.groups:
        assert 0 < each.spread <= each.redundancy + 1e-9
    if groups == "kind":
        assert found["velocity"].squares == pytest.approx(scan.kinds["velocity"].sum_of_squares)


def test_variance_components_of_records():
    """Rates with deviations that are a third of what they should be are found out."""
    block = scanned()
    wrong = [each if each.KIND != "rate" else replace(each, sd=each.sd / 3) for each in block.observations]
    found = variance_components(block.replace(observations=wrong))
    assert found["rate"].factor_of_sd == pytest.approx(3.0, rel=0.25)
    assert {"images", "position", "attitude", "velocity", "rate"} <= {each.name for each in found.components}
    assert found.result.converged
    largest = variance_function(block).largest
    assert largest == pytest.approx(np.abs(block.image_xy[:, 0] - 3000).max() * 0.01)


def test_snooping_takes_out_a_record():
    block = scanned()
    row = next(k for k, each in enumerate(block.observations) if each.KIND == "position")
    own = block.observations[row]
    wrong = replace(own, position=own.position + np.array([0.0, 0.0, 1.0]))
    found = snoop(
        block.replace(observations=[*block.observations[:row], wrong, *block.observations[row + 1 :]])
    )
    assert [each.name for each in found.log] == [f"position {own.photos[0]}"]
    assert found.log[0].error[2] == pytest.approx(1.0, abs=0.2)
    assert found.result.converged
    assert clean(block).result.converged


def test_snooping_of_a_rolling_shutter():
    found = snoop(rolling(gross=True))
    assert [each.name for each in found.log] == ["image of point P0 on photo IMG_1"]
    assert found.log[0].error[0] == pytest.approx(12.0, abs=2.0)
    assert unknown(found.result, "drone").values == pytest.approx(0.03, abs=0.02)


def test_trajectories_without_an_observation():
    """What nothing is of stays at what is given, and is no part of the tests."""
    block = rolling()
    kept = block.image_photos != 3
    result = adjust(kept_images(block, kept))
    assert any("IMG_4" in str(each) for each in result.messages)
    assert (unknown(result, "IMG_4 position 0").change == 0).all()


def test_two_known_trajectories():
    """A trajectory without coefficients has no line of its own, and harms no report."""
    block = scanned(records=False)
    known = [
        Timed(
            each.photo,
            Trajectory(each.trajectory.name, each.trajectory.table),
            lines=each.lines,
            line_sensor=each.line_sensor,
        )
        for each in block.timed
    ]
    result = adjust(block.replace(timed=known))
    assert result.converged
    tables = result.document().tables()
    assert not any(table.key == "trajectories" and table.visible for table in tables)
    assert Clock("c").KIND == "clock"
    assert Table is type(block.trajectories[0].table)


def test_what_is_beyond_its_trajectory_is_named():
    """The core named photo 30, 401 s from the beginning of trajectory 0."""
    block = scanned()
    own = next(each for each in block.observations if each.KIND == "position")
    late = replace(own, time=500.0)
    with raises(AdjustmentError, "adjust.beyond-trajectory"):
        adjust(block.replace(observations=[*block.observations, late]))
    first, second = block.timed
    early = replace(first, lines=Lines([[0, 20.0, 0.002]]))
    with raises(AdjustmentError, "adjust.beyond-trajectory"):
        adjust(block.replace(timed=[early, second]))
    frames = scanned(photos=True)
    last = replace(frames.timed[-1], time=90.0)
    with raises(AdjustmentError, "adjust.beyond-trajectory"):
        adjust(frames.replace(timed=[*frames.timed[:-1], last]))


def test_what_is_open_is_told_by_trajectory_and_time():
    """One by one coefficients would fill pages."""
    block = rolling()
    free = [replace(each, sd_velocity=np.inf, sd_rate=np.inf) for each in block.timed]
    with pytest.raises(RankError, match="moving readout drone, positions of IMG_1") as told:
        adjust(block.replace(timed=free))
    assert "readout time and motion of the photos" in str(told.value)
    assert "position coefficient" not in str(told.value)
    # Scale and readout time: known velocities times T.
    with pytest.raises(RankError, match="records of GNSS, or standard deviations of coefficients") as told:
        adjust(block.replace(point_sd=np.inf))
    strips = scanned(records=False)

    def finer(own):
        return Trajectory(own.name, own.table, position=Spline(0.5), rotation=Spline(2.0, sd=1e-3))

    fine = [replace(each, trajectory=finer(each.trajectory)) for each in strips.timed]
    with pytest.raises(RankError, match=r"positions of strip 1 between [\d.]+ and [\d.]+ s") as told:
        adjust(strips.replace(timed=fine))
    assert len(str(told.value).splitlines()) <= 42


@pytest.mark.parametrize(
    ("block", "model", "given", "terms"),
    [
        (scanned, "brown", {"c": -60.0, "K1": 0.0, "K2": 0.0}, ["K1", "K2"]),
        (
            rolling,
            "opencv",
            {"fx": 3000.0, "fy": 3000.0, "cx": 2000.0, "cy": 1500.0}
            | dict.fromkeys(("k1", "k2", "p1", "p2"), 0.0),
            ["k1"],
        ),
    ],
)
def test_terms_of_lenses_of_what_moves(block, model, given, terms):
    """Scores take places in the focal plane: they foretell what estimated terms come to."""
    block = block(photos=True) if block is scanned else block()

    def adjusted(**sd):
        return adjust(block.replace(cameras=[Camera(model, given, sd=sd)]), tolerance=1e-8)

    held, free = adjusted(), adjusted(**dict.fromkeys(terms, np.inf))
    found = score_test(held, terms)
    fall = held.sums_of_squares.total - free.sums_of_squares.total
    assert found.statistic == pytest.approx(fall, rel=2e-3)
    assert terms_test(free, terms).statistic == pytest.approx(fall, rel=5e-3)
    assert eliminate_terms(free.block).result.converged
