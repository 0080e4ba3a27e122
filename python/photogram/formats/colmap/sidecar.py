"""Covariances of a result beside a COLMAP model, and how good its observations are: docs/formats.md."""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.formats.colmap.writing import Made, made
from photogram.formats.project import Project
from photogram.formats.rotations import Y_DOWN
from photogram.io.json import to_json
from photogram.results.result import Result

__all__ = ["covariance_files"]


def covariance_files(project: Project, result: Result) -> Mapping[str, bytes]:
    """Return the covariances of a result in the order of the model's files: docs/formats.md."""
    model = made(project)
    block = result.block
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    photos = sorted(model.photos.items(), key=lambda each: each[1])
    order = [rows[name] for name, _ in photos]
    covariances = _centre_and_rotation(result)[order]
    points = {name: row for row, name in enumerate(block.point_ids)}
    used = result.used_points
    own = sorted(((number, points[name]) for name, number in model.points.items() if used[points[name]]))
    point_rows = [row for _, row in own]
    table = np.empty(len(order), [("id", "<u4"), ("c", "<f8", 21)])
    table["id"], table["c"] = [number for _, number in photos], _lower(covariances)
    point_table = np.empty(len(own), [("id", "<u8"), ("c", "<f8", 6)])
    point_table["id"], point_table["c"] = (
        [number for number, _ in own],
        _lower(result.point_covariances[point_rows]),
    )
    about = {
        "format": 1,
        "what": "covariances: cofactors times the variance of unit weight",
        "variance_of_unit_weight": result.covariance_scale,
        "frame": str(project.frame),
        "unit": block.linear_unit,
        "datum": str(result.datum),
        "photo": ["C_x", "C_y", "C_z", "r_x", "r_y", "r_z"],
        "photo_rotation": "R_true = exp([r]x) R, R world to camera; r in the camera's axes, radians",
        "point": ["X", "Y", "Z"],
        "camera": "the parameters of cameras.bin; held ones have zeros",
        "layout": "u64 n; n x {id, lower triangle by rows as f64}; little endian, no padding",
        "quality": "u64 n; n x {u32 image_id, u32 point2D_idx, f32 x 6}: residual, redundancy number and test"
        " value of column and row; NaN where there is none",
        "files": [
            "photo_covariances.bin",
            "camera_covariances.bin",
            "point_covariances.bin",
            "observation_quality.bin",
        ],
    }
    return {
        "covariances.json": to_json(about),
        "photo_covariances.bin": struct.pack("<Q", len(table)) + table.tobytes(),
        "camera_covariances.bin": _camera_covariances(model, result),
        "point_covariances.bin": struct.pack("<Q", len(point_table)) + point_table.tobytes(),
        "observation_quality.bin": _quality(model, result),
    }


def _quality(model: Made, result: Result) -> bytes:
    """Return residuals, redundancy numbers and test values of images, by image and feature."""
    images = model.model.images
    counts = np.asarray(images.counts)
    table = np.empty(len(model.rows), [("image", "<u4"), ("feature", "<u4"), ("values", "<f4", 6)])
    table["image"] = np.repeat(images.numbers, counts)
    table["feature"] = np.arange(len(model.rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    parts = (result.residuals, result.redundancy, result.standardized)
    table["values"] = np.hstack([part[model.rows] for part in parts])
    return struct.pack("<Q", len(table)) + table.tobytes()


def _camera_covariances(model: Made, result: Result) -> bytes:
    found = []
    own = {each.name: each.covariance for each in result.cameras}
    for camera in model.model.cameras:
        name = next(name for name, number in model.cameras.items() if number == camera.number)
        count = len(camera.parameters)
        matrix = own.get(name)
        if matrix is None or matrix.shape != (count, count):
            matrix = np.zeros((count, count))
        found.append(
            struct.pack("<II", camera.number, count) + _lower(matrix[np.newaxis])[0].astype("<f8").tobytes()
        )
    return struct.pack("<Q", len(found)) + b"".join(found)


def _lower(matrices: Floats) -> Floats:
    rows, columns = np.tril_indices(matrices.shape[1])
    found: Floats = matrices[:, rows, columns]
    return found


def _centre_and_rotation(result: Result) -> Floats:
    """Return (P, 6, 6) covariances of centres and of rotations in the axes of the cameras.

    A Exp(rho) is F A' before: r = -F rho.
    """
    kind = "omega_phi_kappa_photo_to_ground" if result.block.photo_to_ground else "omega_phi_kappa"
    rates = _photocore.attitudes_from_numbers(kind, result.photo_attitudes, _photocore.nadir_boresight(0))[1]
    jacobian = np.zeros((len(rates), 6, 6))
    jacobian[:, :3, :3] = np.eye(3)
    jacobian[:, 3:, 3:] = -Y_DOWN @ rates
    found: Floats = jacobian @ result.photo_covariances @ jacobian.transpose(0, 2, 1)
    return found
