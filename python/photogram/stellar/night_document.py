"""The JSON document of a calibrated night; `docs/stellar-camera.md` describes it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.show.angles import ARCSEC
from photogram.show.quantity import records
from photogram.stellar.lens_tests import LensTest
from photogram.stellar.night_result import CalibratedNight
from photogram.stellar.night_tables import exposures, images, stars

__all__ = ["to_json"]


def to_json(result: CalibratedNight) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    found, night = result.calibration, result.night
    errors = np.sqrt(np.diag(result.camera.covariance))
    return json.to_json(
        {
            "program": f"photogram {_photocore.__version__}",
            "title": night.title,
            "conventions": {
                "frame": "north, east, zenith (left-handed); azimuth from south, positive west",
                "pixels": "right and down",
                "residual": "measured minus computed; of stars adjusted minus catalogue",
                "standardized": "residual over its mean error",
                "covariance": "cofactors times m squared, in the units of the parameters",
                "icrs": "quaternion w, x, y, z from ICRS to the camera (x right, y down, z along the axis);"
                " covariance of the turn about these axes, radians squared",
            },
            "m": found.mean_error,
            "m_unit": "standard deviation of an image coordinate",
            "sd_px": night.pixel_sd,
            "degrees_of_freedom": found.degrees_of_freedom,
            "iterations": found.iterations,
            "stop": found.status,
            "converged": result.converged,
            "usable": result.usable,
            "verdict": result.verdict.document(),
            "global_test": None
            if result.test is None
            else {
                "variance_of_unit_weight": result.test.variance,
                "limits": result.test.limits,
                "probability": result.test.probability,
            },
            "doubtful": result.doubtful,
            "falsely_identified": result.falsely_identified,
            "lens": {
                "name": result.camera.lens,
                "model": result.camera.facts.model,
                "formula": result.camera.facts.formula,
                "common_scale": result.camera.common_scale,
                "tried": result.lenses,
                "scale_test": _test(result.scale_test),
                "term_tests": [_test(test) for test in result.term_tests],
            },
            "effects": night.site.effects,
            "standstill": None if result.standstill is None else _standstill(result),
            "messages": [str(message) for message in result.messages],
            "parameters": {
                name: {
                    "value": float(value),
                    "mean_error": float(error),
                    "unit": "pixel" if name[0] in "fc" else "",
                }
                for name, value, error in zip(result.camera.names, result.camera.values, errors, strict=True)
            },
            "covariance": {"order": result.camera.names, "matrix": result.camera.covariance},
            "correlated": [{"parameters": [a, b], "correlation": r} for a, b, r in result.correlated()],
            "significance": result.significance(),
            "exposures": records(exposures(result)),
            "stars": records(stars(result)),
            "images": records(images(result)),
        }
    )


def _test(test: LensTest | None) -> dict[str, Any] | None:
    return None if test is None else asdict(test) | {"verdict": test.verdict}


def _standstill(result: CalibratedNight) -> dict[str, Any]:
    test = result.standstill
    assert test is not None
    return {
        "chi_square": test.statistic,
        "degrees_of_freedom": test.dimension,
        "probability": test.probability,
        "own_probability": test.own,
        "turn_arcsec": test.turns / ARCSEC,
        "moved": [result.names[k] for k in test.moved],
    }
