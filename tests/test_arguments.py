"""Public functions and input classes with hostile values for every parameter: errors, no panics, no hangs."""

import dataclasses
import importlib
import inspect
import math
from pathlib import Path

import numpy as np
import pytest

import photogram
from photogram import InputError, PhotogramError
from photogram.distributed import Division
from photogram.giant import Project, read_project
from photogram.results.statement.request import Asked

SMALL = {"strips": 1, "photos_per_strip": 3, "points_per_photo": 6, "check_points": 1, "control_spacing": 1}
PACKAGES = (
    "photogram",
    "photogram.absolute_orientation",
    "photogram.collection",
    "photogram.comparator",
    "photogram.distributed",
    "photogram.network.geometry",
    "photogram.giant",
    "photogram.perspective_center",
    "photogram.network.refraction",
    "photogram.network.simulation_options",
    "photogram.adjustment.robust",
    "photogram.stellar",
)
MADE_BY_THE_LIBRARY = {
    "photogram": "Cleaned Differences Feature Features FirstValues GroupSums Iteration Message Orientation"
    " Plan Pose Progress Resection Result Simulation Snooped Statement VarianceComponents VarianceFunction",
    "photogram.absolute_orientation": "Model Strip",
    "photogram.collection": "AdjustedCollection Simulation",
    "photogram.comparator": "Calibration Case CaseResult Comparison Decomposition Identity Place PlateResult"
    " Pointing Reading RecordedCalibration RecordedCase Session Simulation collect_cases",
    "photogram.distributed": "PartsPlan",
    "photogram.giant": "ErrorWarning ImageFrame Project",
    "photogram.perspective_center": "Cycle PerspectiveCenter Run Stop",
    "photogram.stellar": "CalibratedNight Result",
    "photogram.network.simulation_options": "LineScanner RollingShutter",
    "photogram.adjustment.robust": "remark loss_row",
}
"""Results and what readers make: nobody calls them with values of their own."""


def masked():
    return np.ma.masked_array([1.0, 2.0, 3.0], [False, True, False])


def deep():
    value = []
    for _ in range(2000):
        value = [value]
    return value


HOSTILE = {
    "None": lambda: None,
    "2^64": lambda: 2**64,
    "10^400": lambda: 10**400,
    "-1": lambda: -1,
    "0": lambda: 0,
    "1.5": lambda: 1.5,
    "nan": lambda: math.nan,
    "inf": lambda: math.inf,
    "1e300": lambda: 1e300,
    "a string": lambda: "x",
    "no string": lambda: "",
    "half a pair": lambda: "\ud800",
    "NUL": lambda: "a\0b",
    "bytes": lambda: b"x",
    "complex": lambda: 1j,
    "object": object,
    "list": list,
    "dict": dict,
    "deep": deep,
    "masked": masked,
    "objects": lambda: np.array([None, "x", object()], object),
    "complex array": lambda: np.array([1j, 2.0]),
    "four dimensions": lambda: np.zeros((1, 2, 3, 4)),
    "no elements": lambda: np.zeros(0),
    "nan array": lambda: np.full(3, np.nan),
    "words": lambda: np.array(["a", "\ud800"]),
    "True": lambda: True,
    "a class": lambda: int,
}


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Return for each public name the arguments of a call that works."""
    from photogram import absolute_orientation, collection, comparator, perspective_center, stellar

    folder = tmp_path_factory.mktemp("sound")
    examples = Path(photogram.__file__).parent / "examples"
    block = photogram.simulate(**SMALL).block
    pair = photogram.simulate(strips=1, photos_per_strip=2, points_per_photo=40, control_spacing=1).block
    project = Project.from_block(block)
    photogram.giant.write_project(project, folder / "giant")
    project = read_project(folder / "giant")
    adjustable = project.to_block()
    stations = absolute_orientation.read_csv(examples / "absolute_orientation" / "stations.csv")
    oriented = photogram.orient(stations)
    orientation = folder / "orientation.json"
    orientation.write_bytes(oriented.to_json())
    cards = folder / "cards.txt"
    cards.write_text("0 0 0 0 0 0 0 A\n3 3 3 A\n0 0 0 0 0 0 1\n10 0 0 1 0 0 2\n0 10 0 0 1 0 3\n")
    photos = collection.simulate(photos=3, points=8, seen=1.0).collection
    ring = examples / "collection" / "ring.txt"
    plate = comparator.built_in_grid(1320)
    session = comparator.simulate_calibration(plate, cases=1, sequence=range(1, 26)).session
    options = comparator.Options(joint=False, polynomial=False)
    calibration = comparator.calibrate(session, options)
    years = [
        comparator.calibrate(comparator.simulate_calibration(plate, cases=2, date=day, seed=k).session)
        for k, day in enumerate(("1970-01-15", "1971-01-20"))
    ]
    star_camera = folder / "camera.json"
    star_camera.write_bytes(stellar.SkyCamera.of_field(6000, 4000, 0.6).to_json())
    readings, deck, own_grid = folder / "readings.csv", folder / "deck.txt", folder / "grid.csv"
    readings.write_bytes(comparator.to_csv(session))
    deck.write_bytes(comparator.to_cards(session))
    own_grid.write_bytes(plate.to_csv())
    grid_deck = examples / "perspective_center" / "grid.deck"
    grid = perspective_center.read_deck(grid_deck)[0]
    plate_file, star_night = examples / "stellar" / "plate.toml", examples / "exposures" / "night.toml"
    problem, night = stellar.read_plain(plate_file), stellar.read_night(star_night)
    night = dataclasses.replace(night, exposures=night.exposures[:2], names=night.names[:2])
    calibrated_night = stellar.calibrate_night(night)
    exposure, catalogue = calibrated_night.exposures[0], night.catalogue.brighter(4.0)
    star_deck, star_yaml = folder / "star_deck.txt", folder / "camera.yaml"
    with pytest.MonkeyPatch.context() as paths:
        paths.syspath_prepend(Path(__file__).parent / "stellar")
        from star_decks import cards as star_cards
    star_deck.write_text("\n".join(star_cards(problem)) + "\n")
    star_yaml.write_bytes(stellar.to_yaml(night.camera, night.frame, "ros"))
    lens = photogram.Camera("brown", {"c": -152.74}, sd={"K1": 1e-8})
    calibrated = photogram.adjust(
        block.replace(cameras=[lens], photo_cameras=[0] * 3, principal_distances=None)
    )
    calibrated.to_parquet(folder / "result")
    points, places = np.array([[100.0, 200.0, 30.0]]), np.array([[0.0, 0.0, 1000.0]])
    resected = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 5.0], [0.0, 100.0, 3.0], [100.0, 100.0, 0.0]])
    seen = photogram.network.geometry.project(
        resected, [[50.0, 50.0, 500.0]] * 4, np.zeros((4, 3)), np.full(4, -150.0)
    )
    return {
        "photogram": {
            "AdjustOptions": {},
            "AsPublished": {"percent": 5.0},
            "Attitudes": {"matrices": np.eye(3)[None], "step_covariances": np.eye(3)[None]},
            "Block": {name: getattr(block, name) for name in photogram.Block.__dataclass_fields__},
            "Camera": {
                "model": "brown",
                "parameters": {"c": -150.0, "K1": 1e-8},
                "sd": {"c": 0.1},
                "name": "A",
                "unit": "mm",
            },
            "Distance": {"first": "A", "second": "B", "length": 12.5, "sd": 0.001},
            "LeverArm": {"name": "antenna", "value": [0.1, 0.0, 1.2], "sd": 0.01},
            "Position": {"photo": "1", "position": [0.0, 0.0, 1500.0], "sd": 0.05},
            "InnerConstraints": {"points": ["A"], "photos": ["1"], "scale": True},
            "MinimumConstraints": {"photo": "1", "coordinate": ("2", "X")},
            "Refraction": {"air": "giant", "water": None, "water_level": 0.0, "refractive_index": 1.34},
            "Spheroid": {"a": 6378137.0, "b": 6356752.0},
            "adjust": {"block": block},
            "diagnose": {"network": block},
            "snoop": {"block": block},
            "features": {"result": calibrated, "definitions": {"d": ("distance", block.point_ids[:2])}},
            "first_values": {"block": block},
            "adjust_in_parts": {"block": block, "division": Division(parts=2)},
            "adjust_started": {"started": photogram.first_values(block)},
            "camera_from": {"path": star_camera, "name": "stars", "weighted": True},
            "clean": {"network": block},
            "compare": {"results": {"one": calibrated, "two": calibrated}},
            "differences": {"first": calibrated, "second": calibrated},
            "read_result": {"directory": folder / "result"},
            "eliminate_terms": {"block": calibrated.block},
            "score_test": {"result": calibrated, "names": ["K3"]},
            "terms_test": {"result": calibrated, "names": ["K1"]},
            "statement": {"result": photogram.adjust(block), "sd": 0.1, "budgets": ()},
            "group_sums": {"result": photogram.adjust(block)},
            "orient": {"stations": stations},
            "variance_components": {"network": block, "max_steps": 3},
            "variance_function": {"network": block, "max_steps": 2, "bins": 2},
            "plan": {"patterns": {"one": block}},
            "predict": {"block": block},
            "resect": {"object_points": resected, "image_xy": seen, "principal_distance": -150.0},
            "simulate": {"options": photogram.network.SimulationOptions(**SMALL)},
        },
        "photogram.network.simulation_options": {"SimulationOptions": dict(SMALL)},
        "photogram.absolute_orientation": {
            "Similarity": {
                name: getattr(oriented.similarity, name)
                for name in absolute_orientation.Similarity.__dataclass_fields__
            },
            "Stations": {"ids": ["a", "b"], "control": np.eye(2, 3), "model": np.eye(2, 3)},
            "relative_model": {"block": pair, "first": pair.photo_ids[0], "second": pair.photo_ids[1]},
            "strip_of": {"block": pair, "photos": pair.photo_ids[:2]},
            "read_cards": {"path": cards},
            "read_similarity": {"path": orientation, "usable": True},
            "read_csv": {"path": examples / "absolute_orientation" / "stations.csv"},
            "transform_file": {
                "similarity": oriented.similarity,
                "source": examples / "absolute_orientation" / "points.csv",
                "target": folder / "out.csv",
            },
        },
        "photogram.collection": {
            "Collection": {
                name: getattr(photos, name) for name in collection.Collection.__dataclass_fields__
            },
            "adjust": {"collection": photos},
            "read": {"path": ring},
            "simulate": {"photos": 3, "points": 8},
            "simulate_turntable": {"photos": 4, "points": 8, "rays": 3},
            "to_bytes": {"collection": photos},
        },
        "photogram.comparator": {
            "Correction": {"scale_x": 1.0, "scale_y": 1.0, "nonorthogonality_rad": 0.0},
            "Frame": {"centre_um": (0.0, 0.0), "half_range_um": (1e5, 1e5)},
            "Grid": {"number": 1, "points": np.arange(25), "xy_um": plate.xy_um},
            "Options": {},
            "Polynomial": {
                "frame": comparator.Frame((0.0, 0.0), (1e5, 1e5)),
                "scaled_um": np.zeros((2, 12)),
                "scaled_cofactors": np.zeros((12, 12)),
            },
            "built_in_grid": {"number": 1320},
            "calibrate": {"session": session, "options": options},
            "compare": {"calibrations": years},
            "find_grid": {"name": "1320"},
            "listing": {"calibration": calibration},
            "read": {"paths": [readings]},
            "read_cards": {"path": deck},
            "read_csv": {"paths": [readings]},
            "read_grid": {"path": own_grid},
            "simulate_calibration": {"grid": plate, "cases": 1},
            "to_cards": {"session": session},
            "to_csv": {"session": session},
        },
        "photogram.network.geometry": {
            "Spheroid": {"a": 6378137.0, "b": 6356752.0},
            "geocentric_to_geographic": {
                "xyz": [[6378137.0, 0.0, 0.0]],
                "spheroid": photogram.Spheroid.wgs84(),
            },
            "geographic_to_geocentric": {
                "positions": [[0.0, 0.5, 10.0]],
                "spheroid": photogram.Spheroid.wgs84(),
            },
            "lengths_of_units": {"positions": [[0.0, 0.5, 10.0]], "spheroid": None},
            "local_frames": {"positions": [[0.0, 0.5, 10.0]]},
            "project": {
                "points": points,
                "positions": places,
                "attitudes": np.zeros((1, 3)),
                "principal_distances": [-150.0],
            },
            "refraction_shift": {
                "points": points,
                "positions": places,
                "refraction": photogram.Refraction("giant"),
            },
            "rotation_angles": {"matrices": np.eye(3)[np.newaxis]},
            "rotation_matrix": {"angles": np.zeros((1, 3))},
            "viewing_directions": {"positions": places, "attitudes": np.zeros((1, 3))},
        },
        "photogram.distributed": {
            "Division": {"parts": 2},
            "plan_in_parts": {"block": block, "division": Division(parts=2)},
        },
        "photogram.giant": {
            "Camera": {"name": "A", "principal_distance": -152.0},
            "Common": {},
            "Frame": {"name": "A", "position": (0.0, 0.0, 0.0), "attitude": (0.0, 0.0, 0.0)},
            "GroundPoint": {"name": "A", "position": (0.0, 0.0, 0.0)},
            "Limits": {"stations": 3},
            "error_warnings": {"project": project, "block": block},
            "listing": {"project": project, "block": adjustable, "result": photogram.adjust(adjustable)},
            "read_project": {"directory": folder / "giant"},
            "write_project": {"project": project, "directory": folder / "written", "overwrite": True},
        },
        "photogram.perspective_center": {
            "Coordinatograph": {"x_scale": 1.0, "y_scale": 1.0, "sine": 0.0},
            "Grid": {
                name: getattr(grid, name)
                for name in ("ids", "plate_xy", "model", "principal_distance", "initial")
            },
            "determine": {"grid": grid},
            "joined": {"grids": [grid]},
            "read_deck": {"path": grid_deck},
            "reduce": {
                "readings": [np.ones((2, 3))] * len(grid.ids),
                "ids": grid.ids,
                "plate_xy": grid.plate_xy,
                "principal_distance": 150.0,
            },
            "run_deck": {"path": grid_deck},
        },
        "photogram.network.refraction": {
            "Refraction": {"air": "giant"},
            "metres_per_unit": {"linear_unit": "m"},
        },
        "photogram.adjustment.robust": {},
        "photogram.stellar": {
            "Air": {"temperature": 280.0, "pressure": 760.0},
            "Axis": {"azimuth": 0.0, "zenith_distance": 0.0, "xy": np.zeros(2), "weight": np.eye(2)},
            "Catalogue": {name: getattr(catalogue, name) for name in stellar.Catalogue.__dataclass_fields__},
            "Earth": {"dut1": -0.2, "pole": (1e-6, 2e-6)},
            "Effects": {"refraction": False},
            "Exposure": {name: getattr(exposure, name) for name in stellar.Exposure.__dataclass_fields__},
            "Night": {name: getattr(night, name) for name in stellar.Night.__dataclass_fields__},
            "Options": {},
            "PlateCamera": {
                "values": np.zeros(13),
                "covariance": np.zeros((13, 13)),
                "mean_error": 1.0,
                "degrees_of_freedom": 3,
            },
            "Problem": {name: getattr(problem, name) for name in stellar.Problem.__dataclass_fields__},
            "Site": {"latitude": 0.5},
            "SkyCamera": {"values": np.r_[9000.0, 9000.0, np.zeros(7)], "covariance": np.zeros((9, 9))},
            "apparent_places": {"catalogue": catalogue, "utc": exposure.utc, "effects": stellar.Effects()},
            "attitude_of": {"azimuth": 0.2, "elevation": 0.9, "roll": 0.1},
            "calibrate": {"problem": problem},
            "calibrate_exposures": {
                "exposures": calibrated_night.exposures,
                "camera": night.camera,
                "site": night.site,
                "catalogue": night.catalogue,
                "fixed": ("k2", "k3"),
                "prior": None,
                "threads": 1,
            },
            "calibrate_night": {"night": night, "threads": 1},
            "camera_document": {"result": stellar.calibrate(problem)},
            "default_parameters": {"principal_distance": 0.3},
            "landmark": {"site": night.site, "azimuth": 0.2, "elevation": 0.1, "weight": np.eye(2)},
            "project_sky": {
                "camera": night.camera,
                "attitude": exposure.attitude,
                "site": night.site,
                "places": catalogue.places,
                "time": 1.0,
            },
            "read_deck": {"path": star_deck},
            "read_night": {"path": star_night, "values": {}},
            "read_plain": {"path": plate_file},
            "read_yaml": {"path": star_yaml},
            "refraction": {"zenith_distances": [0.5]},
            "sidereal_time": {"site": night.site, "utc": exposure.utc, "dut1": 0.1},
            "to_yaml": {"camera": night.camera, "frame": night.frame, "form": "ros", "name": "A"},
        },
    }


OF_THE_SIZE = {
    ("photogram", "simulate"),
    ("photogram.collection", "simulate"),
    ("photogram.collection", "simulate_turntable"),
}
"""Numbers of these are sizes: large ones are refused for their memory in tests of their own."""
BIG = {"1e300", "2^64", "10^400", "inf"}


def public():
    for package in PACKAGES:
        module = importlib.import_module(package)
        results = MADE_BY_THE_LIBRARY.get(package, "").split()
        for name in getattr(module, "__all__", [name for name in vars(module) if not name.startswith("_")]):
            found = getattr(module, name)
            if not hasattr(module, "__all__") and getattr(found, "__module__", None) != package:
                continue
            error = inspect.isclass(found) and issubclass(found, BaseException)
            called = inspect.isclass(found) or inspect.isroutine(found) or hasattr(found, "__wrapped__")
            if called and name not in results and not error:
                yield package, name


@pytest.mark.parametrize(("package", "name"), list(public()))
def test_hostile_arguments_are_refused_by_errors(package, name, good, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function = getattr(importlib.import_module(package), name)
    arguments = good[package][name]
    function(**arguments)
    failed = []
    parameters = inspect.signature(function).parameters.values()
    # Keywords that there are not are Python's own errors.
    plain = {each.name: each.annotation for each in parameters if each.kind is not each.VAR_KEYWORD}
    for parameter, annotation in plain.items():
        for what, make in HOSTILE.items():
            if (package, name) in OF_THE_SIZE and what in BIG:
                continue
            if parameter in ("progress", "by") and what == "a class":
                continue  # it can be called: what comes of that is the caller's
            try:
                with np.errstate(all="ignore"):
                    function(**{**arguments, parameter: make()})
                if annotation == "bool" and what == "a string":
                    failed.append(f"{parameter} = {what}: accepted")
            except Exception:  # of our own, or of Python for a value of a wrong type
                pass
            except BaseException as error:  # panics of the extension are no Exceptions
                failed.append(f"{parameter} = {what}: {type(error).__name__}: {error}"[:200])
    assert not failed, "\n".join(failed)


def test_hostile_options_of_a_statement_are_refused(good):
    arguments = good["photogram"]["statement"]
    failed = []
    for option in [each.name for each in dataclasses.fields(Asked)]:
        for what, make in HOSTILE.items():
            try:
                with np.errstate(all="ignore"):
                    photogram.statement(**{**arguments, option: make()})
            except (PhotogramError, OSError):
                pass
            except BaseException as error:
                failed.append(f"{option} = {what}: {type(error).__name__}: {error}"[:200])
    assert not failed, "\n".join(failed)


def test_every_public_name_is_tried_or_named(good):
    for package in PACKAGES:
        assert {name for own, name in public() if own == package} == set(good[package])


def test_paths_may_be_strings(tmp_path):
    photogram.giant.write_project(
        Project.from_block(photogram.simulate(**SMALL).block), str(tmp_path / "giant")
    )
    assert read_project(str(tmp_path / "giant")).frames
    example = Path(photogram.__file__).parent / "examples" / "absolute_orientation" / "stations.csv"
    assert len(photogram.absolute_orientation.read_csv(str(example)).ids) > 3
    for wrong in (None, 3, b"x", "a\0b", "\ud800"):
        with pytest.raises(InputError, match="directory: must be a path"):
            read_project(wrong)
