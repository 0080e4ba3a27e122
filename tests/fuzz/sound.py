"""Sound inputs of every program, as small as they can be: the fuzzer damages copies of them."""

from __future__ import annotations

import bz2
import gzip
import json
import sys
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from photogram import Spheroid, orient, simulate
from photogram.absolute_orientation import read_csv
from photogram.absolute_orientation.stations import transformation_records
from photogram.collection import simulate as simulate_collection
from photogram.collection import to_bytes as collection_bytes
from photogram.comparator import (
    Grid,
    Options,
    built_in_grid,
    calibrate,
    simulate_calibration,
    to_cards,
    to_csv,
)
from photogram.giant import Common, Project
from photogram.giant.files import to_bytes as record_bytes
from photogram.stellar import calibrate_night, read_night, read_plain

from .boards import boards
from .projects import PROJECTS, Files, sound_projects

__all__ = ["SOUND", "Files"]

EXAMPLES = Path(str(files("photogram") / "examples"))
STELLAR_TESTS = Path(__file__).parents[1] / "stellar"


def giant() -> list[Files]:
    """Return three photographs in a strip: rectangular, geographic, and to be intersected only."""
    size = {
        "strips": 1,
        "photos_per_strip": 3,
        "points_per_photo": 6,
        "check_points": 1,
        "control_spacing": 1,
    }
    plain = simulate(**size, seed=1).block
    geographic = simulate(**size, spheroid=Spheroid.clarke_1866(), origin=(-1.6, 0.5, 10.0), seed=2).block
    weighted = simulate(**size, position_sd=0.1, photo_to_ground=True, seed=3).block
    jobs = [
        Common(),
        Common(),
        Common(unit_variance="constrained"),
        Common(intersection_only=True),
    ]
    blocks = [plain, geographic, weighted, plain]
    projects = [Project.from_block(block, job) for block, job in zip(blocks, jobs, strict=True)]
    return [{name: record_bytes(lines) for name, lines in one.records().items()} for one in projects]


def collection(file_format: str) -> list[Files]:
    """Return four photos around nine points, plain and packed."""
    made = simulate_collection(photos=4, points=9, seen=1.0, seed=4).collection
    text = collection_bytes(made, file_format=file_format)
    return [{"input": text}, {"input": text}, {"input": gzip.compress(text)}, {"input": bz2.compress(text)}]


def stations() -> bytes:
    """Return five stations of full control and one without, as a table."""
    rng = np.random.default_rng(6)
    ground = np.round(rng.uniform(0, 1000, (6, 3)), 2)
    model = np.round(0.01 * ground[:, [1, 0, 2]] * [1, -1, 1] + 100 + rng.normal(0, 1e-3, (6, 3)), 4)
    rows = [[f"S{i}", *map(str, (*ground[i], *model[i]))] for i in range(6)]
    rows[2][3] = rows[3][1] = rows[3][2] = rows[5][1] = rows[5][2] = rows[5][3] = ""
    return "\n".join(["id,X,Y,Z,x,y,z", *(",".join(row) for row in rows), ""]).encode()


def orientation() -> list[Files]:
    """Return stations as a table, with standard deviations, and as cards."""
    lines = stations().decode().splitlines()
    weighted = [lines[0] + ",sd_X,sd_Y,sd_Z,sd_x,sd_y,sd_z"]
    weighted += [line + ",0.02,0.02,0.05,0.001,0.001,0.002" for line in lines[1:]]
    cells = [line.split(",") for line in lines[1:]]
    cards = ["0 0 0 0 0 0 0 MODEL", "6 4 4 MODEL"]
    cards += [" ".join([*(cell or "-" for cell in row[1:]), str(k)]) for k, row in enumerate(cells, 1)]
    tables = [lines, weighted, cards]
    return [{"input": ("\n".join(table) + "\n").encode()} for table in tables]


def transformation() -> list[Files]:
    """Return a former result in both forms, and points in both forms."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "stations.csv"
        path.write_bytes(stations())
        result = orient(read_csv(path))
    records = "\n".join(transformation_records(result.similarity, "MODEL")) + "\n"
    table = b"id,x,y,z\nA,101.5,95.25,104\nB,109,91,102.5\nC,105,97,108\n"
    weighted = b"id,x,y,z,sd_x,sd_y,sd_z\nA,101.5,95.25,104,.001,.001,.002\nB,109,91,102.5,.001,.001,.002\n"
    words = b"101.5 95.25 104 7\n109 91 102.5 8\n"
    return [{"result": result.to_json(), "points": each} for each in (table, weighted)] + [
        {"result": records.encode(), "points": words}
    ]


def perspective() -> list[Files]:
    """Return the packaged deck with every second point: nine points at two heights."""
    text = (EXAMPLES / "perspective_center" / "grid.deck").read_text().splitlines()
    count = next(k for k, line in enumerate(text) if line.startswith("   25"))
    plate = {line.split()[0]: k for k, line in enumerate(text[count + 2 : count + 27])}
    left_out = {name for name, k in plate.items() if k // 5 % 2 or k % 5 % 2}
    text[count] = text[count].replace("   25", "    9", 1)
    kept = [line for line in text if not line.strip() or line.split()[0] not in left_out]
    return [{"grid.deck": ("\n".join(kept) + "\n").encode()}]


def comparator() -> list[Files]:
    """Return two cases of a grid of nine points, with the plate as a table."""
    nodes = np.array([(x, y) for y in (0.0, 50_000.0, 100_000.0) for x in (0.0, 50_000.0, 100_000.0)])
    grid = Grid(1, np.arange(1, 10), nodes)
    session = simulate_calibration(
        grid, cases=4, sequence=[*range(1, 10), 1], pointing_um=1.0, random_um=1.0, seed=7
    ).session
    lines = [line for line in to_csv(session).decode().splitlines() if not line.startswith("# grid")]
    return [{"readings.csv": ("\n".join(lines) + "\n").encode(), "grid.csv": grid.to_csv()}]


def comparator_cards() -> list[Files]:
    """Return one case of grid 1320, every point once."""
    session = simulate_calibration(
        built_in_grid(1320), cases=1, sequence=[*range(1, 26), 1], pointing_um=1.0, seed=8
    ).session
    return [{"deck.txt": to_cards(session)}]


def correction() -> list[Files]:
    """Return a correction and a table of measurements."""
    session = simulate_calibration(
        built_in_grid(1320), cases=2, pointing_um=1.0, random_um=1.0, seed=9
    ).session
    document = calibrate(session, Options(joint=False)).correction.to_json()
    table = b"name,x_um,y_um\na,100000.5,120000\nb,200000,12500.25\nc,50000,60000\n"
    metric = b"name,x_mm,y_mm\na,100.0005,120\nb,200,12.50025\n"
    return [{"correction.json": document, "points.csv": each} for each in (table, metric)]


def plate() -> list[Files]:
    """Return a plate with twelve stars: the first ones of the packaged example."""
    source = EXAMPLES / "stellar"
    stars = (source / "stars.csv").read_text().splitlines()
    chosen = [stars[0], *stars[1::6]]
    names = {line.split(",")[0] for line in chosen[1:]}
    images = (source / "images.csv").read_text().splitlines()
    kept = [images[0], *(line for line in images[1:] if line.split(",")[0] in names)]
    texts = {"stars.csv": chosen, "images.csv": kept}
    return [
        {"input.toml": (source / "plate.toml").read_bytes()}
        | {name: ("\n".join(lines) + "\n").encode() for name, lines in texts.items()}
    ]


def star_deck() -> list[Files]:
    """Return the same plate as a deck of cards."""
    sys.path.insert(0, str(STELLAR_TESTS))
    try:
        from star_decks import cards  # the writer of decks of the other tests
    finally:
        sys.path.remove(str(STELLAR_TESTS))
    with TemporaryDirectory() as folder:
        for name, content in plate()[0].items():
            (Path(folder) / name).write_bytes(content)
        problem = read_plain(Path(folder) / "input.toml")
    return [{"input.deck": ("\n".join(cards(problem)) + "\n").encode()}]


def night() -> list[Files]:
    """Return two exposures with a catalogue of their stars: to be identified, and identified."""
    source = EXAMPLES / "exposures"
    text = (source / "night.toml").read_text()
    head, *tables = text.split("[[exposures]]")
    result = calibrate_night(read_night(source / "night.toml"))
    exposures = list(zip(result.names, result.exposures, strict=True))[:2]
    catalogue = result.night.catalogue
    seen = sorted({int(star) for _, each in exposures for star in each.stars[:30] if star >= 0})
    degrees = np.degrees(catalogue.places)
    rows = ["id,ra_deg,dec_deg,pm_ra_mas,pm_dec_mas,parallax_mas,magnitude"]
    rows += [
        f"{catalogue.ids[k]},{degrees[k, 0]:.7f},{degrees[k, 1]:.7f},0,0,10,{catalogue.magnitudes[k]:.2f}"
        for k in seen
    ]
    bare, named = ["exposure,x_px,y_px,magnitude"], ["exposure,x_px,y_px,star"]
    for name, each in exposures:
        for (x, y), star in list(zip(each.xy, each.stars, strict=True))[:30]:
            if star >= 0:
                bare.append(f"{name},{x:.3f},{y:.3f},{catalogue.magnitudes[star]:.2f}")
                named.append(f"{name},{x:.3f},{y:.3f},{catalogue.ids[star]}")
    document = head.replace(
        "faintest = 6.0", f'file = "stars.csv"\nepoch = {catalogue.epoch}\nfaintest = 9.0'
    )
    document += "".join("[[exposures]]" + table for table in tables[:2])
    return [
        {
            "input.toml": document.encode(),
            "images.csv": ("\n".join(images) + "\n").encode(),
            "stars.csv": ("\n".join(rows) + "\n").encode(),
        }
        for images in (bare, named)
    ]


def options() -> list[Files]:
    """Return the options of a simulated network, as a document that is not a file of the programs."""
    values = {
        "strips": 1,
        "photos_per_strip": 3,
        "forward_overlap": 0.6,
        "side_overlap": 0.3,
        "principal_distance": -152.74,
        "frame_size": 230.0,
        "flying_height": 4500.0,
        "relief": 150.0,
        "points_per_photo": 6.0,
        "crab": 0.03,
        "tilt": 0.01,
        "control_spacing": 1,
        "control_sd": 0.05,
        "image_sd": 0.010,
        "position_sd": 0.1,
        "attitude_sd": 0.001,
        "origin": [0.0, 0.0, 0.0],
        "seed": 0,
    }
    return [{"options": json.dumps(values).encode()}]


SOUND: dict[str, Callable[[], list[Files]]] = {
    "GIANT project": giant,
    "GIANT project, check": giant,
    "BAL collection": lambda: collection("bal"),
    "Bundle file": lambda: collection("bundler"),
    "orientation: stations": orientation,
    "orientation: transform": transformation,
    "perspective-center deck": perspective,
    "comparator: tables": comparator,
    "comparator: cards": comparator_cards,
    "comparator: correction": correction,
    "stellar camera: plain form": plate,
    "stellar camera: deck": star_deck,
    "exposures": night,
    "simulate": options,
    "calibration with a board": boards,
}
SOUND |= {f"project: {name}": partial(sound_projects, name) for name in PROJECTS}
"""How the sound inputs of each format are made."""
