"""The JSON document of a certificate; docs/certificates.md lists the members."""

from __future__ import annotations

from typing import Any

from photogram import _photocore
from photogram.film.certificate import Certificate
from photogram.film.certificate_tables import (
    cameras,
    compared,
    curve,
    distortion,
    marks,
    matrix_of,
    observed,
    terms,
)
from photogram.io import json
from photogram.network.cameras import Camera
from photogram.show.methods import document_of
from photogram.show.quantity import records
from photogram.statistics.distributions import LEVEL, bonferroni, critical_normal

__all__ = ["certificate_document", "limit_of"]


@document_of.register(Certificate)
def certificate_document(certificate: Certificate) -> bytes:
    """Return everything as JSON."""
    document: dict[str, Any] = {
        "program": f"photogram {_photocore.__version__}",
        "kind": "certificate",
        "camera": certificate.name,
        "type": certificate.camera_type or None,
        "date": certificate.day.isoformat() if certificate.day else None,
        "verdict": certificate.verdict.document(),
        "remarks": certificate.told(),
        "distances": records(compared(certificate)),
        "marks": None,
        "lens": None,
        "cameras": [_camera(each) for each in cameras(certificate)],
    }
    if certificate.places or certificate.distances:
        document["marks"] = _marks(certificate)
    if certificate.radial is not None:
        own = certificate.curve()
        document["lens"] = {
            "focal_length_mm": own.focal_length,
            "sd_focal_length_mm": own.sd_focal_length,
            "table": records(distortion(certificate, own)),
            "terms": own.terms,
            "fits": records(terms(certificate.curves(), own.terms)),
            "curve": records(curve(own)),
            "brown_apart_mm": certificate.lens("brown").apart,
            "printed_coefficients_apart_mm": certificate.printed_coefficients(),
        }
    return json.to_json(document)


def limit_of(count: int) -> float:
    """Return the |w| beyond which one of so many is named."""
    return critical_normal(bonferroni(LEVEL, max(count, 1)))


def _marks(certificate: Certificate) -> dict[str, Any]:
    found = certificate.fiducials()
    own: dict[str, Any] = {
        "places": records(marks(found)),
        "covariance_mm2": {
            "order": [f"{name}.{axis}" for name in found.names for axis in "xy"],
            "matrix": found.covariance,
        },
        "adjustment": None,
    }
    if found.adjusted is not None:
        test = found.adjusted.test
        own["adjustment"] = {
            "free_movements": found.adjusted.free,
            "degrees_of_freedom": found.adjusted.degrees_of_freedom,
            "omega": test.weighted_sum_of_squares if test else None,
            "probability": test.probability_above if test else None,
            "observed": records(observed(found.adjusted, limit_of(len(found.adjusted.rows)))),
        }
    return own


def _camera(camera: Camera) -> dict[str, Any]:
    names, matrix = matrix_of(camera)
    return {
        "model": camera.model,
        "unit": camera.unit,
        "parameters": dict(camera.parameters),
        "covariance": {"order": names, "matrix": matrix},
    }
