"""The computed references of the stellar camera, as problems."""

import json
from pathlib import Path

import numpy as np

from photogram.stellar import NAMES, Air, Options, Problem, Site

DATA = Path(__file__).parents[1] / "data" / "stellar"
TO_GOLDEN = {"epsilon": "eps", "dx": "Dx", "dy": "Dy", "phi_T": "phiT"}


def load(name):
    return json.loads((DATA / f"{name}.json").read_text())


def vector(values):
    return np.array([values[TO_GOLDEN.get(name, name)] for name in NAMES])


def site(station):
    return Site(np.radians(station["lat_deg"]), air=Air(station["T_K"], station["P_mmHg"]))


def problem(document, **options):
    stars = document["stars"]
    images = [(i, *row) for i, star in enumerate(stars) for row in star["obs"]]
    weights = np.array([[[aa, ad], [ad, dd]] for aa, dd, ad in (star["P"] for star in stars)])
    options = {
        "tolerance": 1e-10,
        "distortion_tolerance": 1e-12,
        "refraction_tolerance": 1e-14,
        "mean_error": document["results"]["input_m"] or 0.0,
        **options,
    }
    return Problem(
        site=site(document["station"]),
        star_ids=tuple(str(star["nost"]) for star in stars),
        star_places=np.array([[star["alpha"], star["delta"]] for star in stars]),
        star_weights=weights,
        image_points=tuple(str(row[1]) for row in images),
        image_stars=np.array([row[0] for row in images]),
        image_groups=np.array([row[5] for row in images]),
        image_xy=np.array([row[2:4] for row in images]),
        image_weights=np.broadcast_to(np.eye(2), (len(images), 2, 2)).copy(),
        image_times=np.array([row[4] for row in images]),
        initial=vector(document["initial"]),
        options=Options(**options),
    )
