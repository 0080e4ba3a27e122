"""Build the packaged example `galveston` from the printed figures of the GIANT guide.

    python examples/make_galveston.py

The sample of the guide (Elassal and Malhotra, NOAA 1987) prints stations and control of a block of twenty
photographs, but only a few of its image coordinates. What is printed is taken from `tests/data/giant`; the
rest is simulated, always with the same numbers. The README beside the files says line by line which is which.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from photogram import Spheroid, network
from photogram.giant import Camera, Common, Frame, GroundPoint, ImageFrame, Project, write_project

ROOT = Path(__file__).resolve().parents[1]
PRINTED = ROOT / "tests" / "data" / "giant"
EXAMPLE = ROOT / "python" / "photogram" / "examples" / "galveston"

SPHEROID = Spheroid.clarke_1866()
PRINCIPAL_DISTANCE = -152.740
FRAME_EDGE = 112.0  # mm from the centre; nothing nearer to the edge of the 230 mm format is measured
IMAGE_SD = 0.010  # mm
ARCSEC = math.radians(1 / 3600)
STRIPS = ([f"SH{n}" for n in range(9960, 9969)], [f"SH{n}" for n in range(9944, 9955)])
FRAMES = STRIPS[0] + STRIPS[1]
HELD_HEIGHTS = {"SH960202": 0.0, "SH954202": 0.0}  # the first adjusted by 0.0005 m, the second not printed
SIMULATED_POINTS = 112  # makes 144 ground points, as in the sample

Floats = NDArray[np.float64]
Stations = dict[str, tuple[Floats, Floats]]
Points = dict[str, Floats]
Images = dict[tuple[str, str], Floats]


def rows(file: str) -> list[dict[str, str]]:
    """Return the rows of a table of printed figures."""
    with (PRINTED / file).open() as stream:
        return list(csv.DictReader(stream))


def number(text: str) -> float:
    """Return a number; NaN for "null", not legible."""
    return math.nan if text == "null" else float(text)


def dms(text: str) -> float:
    """Return radians of "-94 59 4.7584"; NaN for "null"."""
    if text == "null":
        return math.nan
    degrees, minutes, seconds = text.removeprefix("-").split()
    value = ARCSEC * (3600 * int(degrees) + 60 * int(minutes) + float(seconds))
    return -value if text.startswith("-") else value


def printed_stations(file: str) -> Stations:
    """Return position and attitude by frame; NaN where a value is not legible."""
    values = {(row["frame"], row["parameter"]): number(row["value"]) for row in rows(file)}
    stations = {}
    for frame in dict.fromkeys(frame for frame, _ in values):
        lon, lat, elev, omega, phi, kappa = (
            values[frame, name] for name in ("lon", "lat", "elev", "omega", "phi", "kappa")
        )
        stations[frame] = (
            np.array([math.radians(lon), math.radians(lat), elev]),
            np.radians([omega, phi, kappa]),
        )
    return stations


def true_stations(random: np.random.Generator) -> Stations:
    """Return the printed adjusted stations, and the second strip continued to its end.

    The continuation keeps the mean base of the printed part and drifts towards the first strip, 80 m in a
    base: so SH954201 falls on SH9953 and SH9954, on which the listing has its residuals (page 29).
    """
    stations = printed_stations("stations_adjusted.csv")
    printed = [frame for frame in STRIPS[1] if frame in stations]
    first, last = (stations[frame][0] for frame in (printed[0], printed[-1]))
    base = (last - first) / (len(printed) - 1) + [-2.4 * ARCSEC, -1.5 * ARCSEC, 0.0]
    kappa = np.mean([stations[frame][1][2] for frame in printed])
    for step, frame in enumerate(STRIPS[1][len(printed) :], start=1):
        position = last + step * base + [2 * ARCSEC, 2 * ARCSEC, 2.0] * random.standard_normal(3)
        attitude = np.array([0.0, 0.0, kappa]) + math.radians(0.5) * random.standard_normal(3)
        stations[frame] = (position, attitude)
    return {frame: stations[frame] for frame in FRAMES}


def initial_stations(truth: Stations, random: np.random.Generator) -> Stations:
    """Return FRAMES: the printed input, elsewhere the truth with errors like the printed corrections."""
    printed = printed_stations("stations_initial.csv")
    stations = {}
    for frame, (position, attitude) in truth.items():
        position = position + [0.01 * ARCSEC, 0.01 * ARCSEC, 0.4] * random.standard_normal(3)
        attitude = attitude + 5 * ARCSEC * random.standard_normal(3)
        if frame in printed:
            position, attitude = (
                np.where(np.isnan(known), simulated, known)
                for known, simulated in zip(printed[frame], (position, attitude), strict=True)
            )
        position[:2], position[2] = rounded(position[:2]), round(position[2], 3)
        stations[frame] = (position, rounded(attitude))
    return stations


def rounded(angles: Floats) -> Floats:
    """Round angles to 0.001 arcsec, the last digit of FRAMES."""
    return np.round(angles / ARCSEC, 3) * ARCSEC


def triple(values: Floats) -> tuple[float, float, float]:
    """Return three plain numbers."""
    first, second, third = values.tolist()
    return first, second, third


def project(station: tuple[Floats, Floats], point: Floats) -> Floats:
    """Return the image of a point in millimetres."""
    return network.project(
        [point], [station[0]], [station[1]], [PRINCIPAL_DISTANCE], spheroid=SPHEROID, photo_to_ground=True
    )[0]


def ray(station: tuple[Floats, Floats], xy: Floats) -> tuple[Floats, Floats]:
    """Return the geocentric projection centre and direction to the ground of an image point."""
    position, attitude = station
    (sl, cl), (sp, cp) = ((math.sin(angle), math.cos(angle)) for angle in position[:2])
    east_north_up = np.array([[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])
    image = np.array([*xy, PRINCIPAL_DISTANCE])
    direction = east_north_up.T @ network.rotation_matrix([attitude])[0] @ image
    return network.geographic_to_geocentric([position], SPHEROID)[0], direction / np.linalg.norm(direction)


def at_height(station: tuple[Floats, Floats], xy: Floats, height: float) -> Floats:
    """Return where the ray of an image point reaches a height."""
    origin, direction = ray(station, xy)
    distance = 0.0
    for _ in range(20):
        point = network.geocentric_to_geographic([origin + distance * direction], SPHEROID)[0]
        distance += point[2] - height
    return point


def intersection(rays: list[tuple[Floats, Floats]]) -> Floats:
    """Return the point nearest to the rays."""
    normals = [np.eye(3) - np.outer(direction, direction) for _, direction in rays]
    right = sum(normal @ origin for normal, (origin, _) in zip(normals, rays, strict=True))
    return network.geocentric_to_geographic([np.linalg.solve(sum(normals), right)], SPHEROID)[0]


def seen_by(stations: Stations, point: Floats) -> list[str]:
    """Return the frames that a point falls on."""
    return [
        frame for frame, station in stations.items() if np.abs(project(station, point)).max() < FRAME_EDGE
    ]


def printed_images() -> Images:
    """Return the printed images, in millimetres, whose name and coordinates are legible and none doubtful."""
    return {
        (row["frame"], row["point"]): np.array([number(row["x_mm"]), number(row["y_mm"])])
        for row in rows("image_coordinates.csv")
        if "null" not in (row["point"], row["x_mm"], row["y_mm"])
        and "low" not in (row["conf_x"], row["conf_y"])
    }


def printed_points(stations: Stations) -> Points:
    """Return control and 126! at the printed adjusted positions (page 34).

    Of four vertical control points only the seconds are printed. Degrees and minutes put them nearest to the
    station of the frame in their names, among the places that two photographs or more see.
    """
    points = {}
    for row in rows("ground_adjusted.csv"):
        lon, lat, height = (number(row[column]) for column in ("lon_deg", "lat_deg", "elev_m"))
        position = np.array([math.radians(lon), math.radians(lat), height])
        if row["type_code"] == "3" and np.isnan(position[0]):
            station = stations[f"SH9{row['point'][2:5]}"][0]
            position[:2] = _place(stations, station, number(row["lon_s"]), number(row["lat_s"]))
        if np.isfinite(position).all():
            points[row["point"]] = position
    return points


def _place(stations: Stations, near: Floats, lon_seconds: float, lat_seconds: float) -> Floats:
    """Complete seconds to a western longitude and a northern latitude near a position."""
    minute = 60 * ARCSEC
    lon, lat = -math.floor(-near[0] / minute), math.floor(near[1] / minute)
    places = [
        np.array([(lon - i) * minute - lon_seconds * ARCSEC, (lat + j) * minute + lat_seconds * ARCSEC, 0.0])
        for i in range(-2, 3)
        for j in range(-2, 3)
    ]
    places = [place for place in places if len(seen_by(stations, place)) >= 2]
    return min(places, key=lambda place: float(np.hypot(*(place - near)[:2])))[:2]


def measured_points(stations: Stations, images: Images, random: np.random.Generator) -> Points:
    """Intersect points of which only images are printed; on a single ray the height is simulated."""
    points = {}
    for name in dict.fromkeys(point for _, point in images):
        rays = [(stations[frame], xy) for (frame, point), xy in images.items() if point == name]
        if len(rays) > 1:
            points[name] = intersection([ray(station, xy) for station, xy in rays])
        else:
            points[name] = at_height(*rays[0], random.uniform(0.0, 12.0))
    return points


def simulated_points(stations: Stations, random: np.random.Generator) -> Points:
    """Simulate pass points, in every photograph two in either wing and one or two in the middle."""
    places = [(0, -96), (0, 96), (0, 0), (8, -88), (8, 88), (8, 6)]
    spots = [(frame, place) for place in places for frame in FRAMES][:SIMULATED_POINTS]
    points = {}
    for serial, (frame, place) in enumerate(sorted(spots, key=lambda spot: FRAMES.index(spot[0])), start=1):
        xy = np.array(place) + random.uniform(-4.0, 4.0, 2)
        points[f"S{serial:03d}"] = at_height(stations[frame], xy, random.uniform(0.0, 12.0))
    return points


def ground() -> list[GroundPoint]:
    """Return GROUND: control as printed, with the standard deviations of COMMON, record 3.

    The input of most vertical control is not printed. Its held height is the adjusted one, which differs by
    less than 1 mm; its ignored components are left blank.
    """
    printed = {row["point"]: row for row in rows("ground_control_input.csv")}
    adjusted = {row["point"]: row for row in rows("ground_adjusted.csv")}
    codes = {name: int(row["type_code"]) for name, row in {**adjusted, **printed}.items()} | {"SH954202": 3}
    points = []
    for name, code in sorted(codes.items(), key=lambda item: (-item[1], item[0])):
        if name in printed:
            row = printed[name]
            position = (dms(row["lon_dms"]), dms(row["lat_dms"]), number(row["elev_m"]))
        elif name in HELD_HEIGHTS:
            position = (math.nan, math.nan, HELD_HEIGHTS[name])
        else:
            position = (math.nan, math.nan, round(number(adjusted[name]["elev_m"]), 3))
        if code:
            points.append(GroundPoint(name, position, type_code=code))
    return points


def images(
    stations: Stations, points: Points, printed: Images, random: np.random.Generator
) -> list[ImageFrame]:
    """Return IMAGES: what every photograph sees, measured with noise where the measurement is not printed."""
    frames = []
    for frame, station in stations.items():
        names, xy = [], []
        for name, point in points.items():
            image = project(station, point) + IMAGE_SD * random.standard_normal(2)
            if (frame, name) in printed:
                image = printed[frame, name]
            elif np.abs(image).max() >= FRAME_EDGE:
                continue
            names.append(name)
            xy.append(np.round(image, 3))
        frames.append(ImageFrame(frame, names, np.array(xy), camera="F1982"))
    return frames


def build() -> Project:
    """Return the example."""
    random = np.random.default_rng(1987)
    stations = true_stations(random)
    initial = initial_stations(stations, random)
    measured = printed_images()
    points = measured_points(stations, measured, random) | printed_points(stations)
    points |= simulated_points(stations, random)
    common = Common(
        title="SAMPLE TEST RUN FOR ERROR PROPAGATION ............ 22-SEP-86 14:02:27",
        geographic=True,
        photo_to_ground=True,
        error_propagation=True,
        max_iterations=4,
        strip="0",
        convergence_percent=5,
        semi_major=SPHEROID.a,
        semi_minor=SPHEROID.b,
        control_sd=(0.001 * ARCSEC, 0.001 * ARCSEC, 0.010),
    )
    return Project(
        common=common,
        cameras=[Camera("F1982", PRINCIPAL_DISTANCE)],
        frames=[
            Frame(name, triple(position), triple(attitude)) for name, (position, attitude) in initial.items()
        ],
        images=images(stations, points, measured, random),
        ground=ground(),
    )


if __name__ == "__main__":
    write_project(build(), EXAMPLE, overwrite=True)
