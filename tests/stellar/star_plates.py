"""Plates to test with: simulated by a model of their own, adjusted densely."""

from dataclasses import replace

import numpy as np

from photogram.stellar import ARCSEC, INDEX, NAMES

PLATE_SD, STAR_SD = 3e-6, 0.2 * ARCSEC
"""Noise of the computed references."""


def images(problem, parameters, places):
    """Return (m, 2) plate coordinates, step by step from the report's equations 1 to 19 and 38 or 40."""
    standard = standard_coordinates(problem, parameters, places)
    turned = np.empty((len(standard), 3))
    for group in range(3):
        chosen = problem.image_groups == group
        turned[chosen] = standard[chosen] @ matrix(parameters[3 * group : 3 * group + 3]).T
    epsilon, xp, yp, cx, cy, *_ = parameters[9:22]
    if problem.options.common_scale:
        cy = cx
    ideal = turned[:, :2] / turned[:, 2:]
    first = problem.options.distortion_first
    if first:
        xy = np.array([xp, yp]) + np.array([cx, cy]) / first * distorted(parameters, first * ideal)
    else:
        xy = np.array([xp, yp]) + distorted(parameters, np.array([cx, cy]) * ideal)
    xy[:, 0] -= epsilon * xy[:, 1]
    return xy


def standard_coordinates(problem, parameters, places):
    """Return (m, 3) refracted xi, eta, 1 of every image's star."""
    ra, dec = places[problem.image_stars].T
    site, time = problem.site, problem.image_times
    k = site.aberration * np.cos(site.latitude)
    hour = time - ra - k * np.cos(time - ra) / np.cos(dec)
    dec = dec + k * np.sin(time - ra) * np.sin(dec)
    sp, cp = np.sin(site.latitude), np.cos(site.latitude)
    cosine = sp * np.sin(dec) + cp * np.cos(dec) * np.cos(hour)
    north = cp * np.sin(dec) - sp * np.cos(dec) * np.cos(hour)
    east = -np.cos(dec) * np.sin(hour)
    true = np.arctan2(np.hypot(north, east), cosine)
    temperature, pressure = site.air.temperature / 273.15, site.air.pressure / 760.0
    observed = true
    for _ in range(30):
        u = np.tan(0.5 * np.arctan(np.sqrt(temperature) / 8.7137 * np.tan(observed)))
        series = sum(tau * u ** (2 * i + 1) for i, tau in enumerate(parameters[22:]))
        observed = true - pressure * temperature**-1.5 * series * ARCSEC
    tangent, azimuth = np.tan(observed), np.arctan2(-east, -north)
    return np.column_stack([-tangent * np.cos(azimuth), -tangent * np.sin(azimuth), np.ones(len(true))])


def matrix(angles):
    """Return the rotation with reflection, element by element (equation 19)."""
    (sa, so, sk), (ca, co, ck) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [-ca * ck + sa * so * sk, -co * sk, sa * ck + ca * so * sk],
            [-ca * sk - sa * so * ck, co * ck, sa * sk - ca * so * ck],
            [sa * co, so, ca * co],
        ]
    )


def distorted(parameters, xy):
    """Return images with distortion about its own centre (equations 25 to 32)."""
    dx, dy, k1, k2, k3, k4, k5, phi = parameters[14:22]
    x, y = (xy - np.array([dx, dy])).T
    square = x**2 + y**2
    radial = square * (k1 + square * (k2 + square * k3))
    decentering = k4 + k5 * square
    c, s = np.cos(phi), np.sin(phi)
    shift_x = radial * x + decentering * ((3 * x**2 + y**2) * c + 2 * x * y * s)
    shift_y = radial * y + decentering * ((x**2 + 3 * y**2) * s + 2 * x * y * c)
    return xy + np.column_stack([shift_x, shift_y])


def quiet(problem):
    """Return a problem that is not tested for movement."""
    return replace(problem, options=replace(problem.options, movement_factor=0.0))


def seen(problem, parameters):
    """Return the problem without errors, as a camera of these parameters, its initial values, sees it."""
    return replace(
        problem, image_xy=images(problem, parameters, problem.star_places), initial=parameters.copy()
    )


def noisy(truth, generator, plate_sd=PLATE_SD, star_sd=STAR_SD):
    """Add noise to plate and catalogue, with the weights that belong to it."""
    count = len(truth.star_ids)
    weights = np.broadcast_to(np.eye(2) * (plate_sd / star_sd) ** 2, (count, 2, 2)).copy()
    return replace(
        truth,
        star_places=truth.star_places + star_sd * generator.standard_normal((count, 2)),
        star_weights=weights,
        image_xy=truth.image_xy + plate_sd * generator.standard_normal(truth.image_xy.shape),
    )


def changed(parameters, **values):
    """Return parameters with some of them replaced."""
    changed = parameters.copy()
    for name, value in values.items():
        changed[INDEX[name]] = value
    return changed


def dense(problem, parameters, places, free):
    """Adjust all unknowns at once, iterated to rounding errors.

    Returns
    -------
    Parameters, places, cofactors in this order (zero for what is not free), sum of squares.
    """
    parameters, places = parameters.copy(), places.copy()
    own = np.concatenate([np.flatnonzero(free), np.arange(len(NAMES), len(NAMES) + places.size)])
    step = np.zeros(len(NAMES) + places.size)
    for _ in range(60):
        design, right = equations(problem, parameters, places, free)
        scale = 1.0 / np.linalg.norm(design[:, own], axis=0)
        scaled = design[:, own] * scale
        short = np.linalg.solve(scaled.T @ scaled, scaled.T @ right)
        step[own] = scale * short
        parameters += step[: len(NAMES)]
        places += step[len(NAMES) :].reshape(-1, 2)
        if np.linalg.norm(scaled @ short) < 3e-12 * np.linalg.norm(right):
            break
    # The root of the normal equations by QR, whose condition is the root of theirs.
    inverse = np.linalg.inv(np.linalg.qr(scaled, mode="r")) * scale[:, None]
    cofactors = np.zeros((len(step), len(step)))
    cofactors[np.ix_(own, own)] = inverse @ inverse.T
    return parameters, places, cofactors, right @ right


def columns(equations, groups):
    """Return (m, 2, 26) partials by all parameters."""
    rows = np.zeros((len(groups), 2, len(NAMES)))
    rows[:, :, 9:] = equations["common"]
    image = np.arange(len(groups))
    for k in range(3):
        rows[image, :, 3 * groups + k] = equations["pointing"][:, :, k]
    return rows


def equations(problem, parameters, places, free):
    """Return all observation equations with unit weight: images, stars, axis, weighted parameters."""
    first, unknowns = len(NAMES), len(NAMES) + 2 * len(places)
    core = problem.core(parameters, places, ~free)
    found, image = core.equations(), np.arange(len(problem.image_stars))
    images = np.zeros((len(image), 2, unknowns))
    images[:, :, :first] = columns(found, problem.image_groups)
    for k in range(2):
        images[image, :, first + 2 * problem.image_stars + k] = found["star"][:, :, k]
    known = np.flatnonzero(problem.known)
    stars = np.eye(unknowns)[first:].reshape(len(places), 2, unknowns)[known]
    blocks = [
        (problem.image_weights, images, found["constant"]),
        (problem.star_weights[known], stars, (problem.star_places - places)[known]),
    ]
    if problem.axis is not None:
        axis, row = core.axis_equations(), np.zeros((1, 2, unknowns))
        row[:, :, :first] = columns(axis, np.array([problem.axis.group]))
        blocks.append((problem.axis.weight[None], row, axis["constant"]))
    weighted = np.flatnonzero(problem.weighted & free)
    if weighted.size:
        weights = problem.parameter_weights[np.ix_(weighted, weighted)]
        off = (problem.initial - parameters)[weighted]
        blocks.append((weights[None], np.eye(unknowns)[None, weighted], off[None]))
    roots = [np.linalg.cholesky(weights).transpose(0, 2, 1) for weights, _, _ in blocks]
    rows = [(root @ part).reshape(-1, unknowns) for root, (_, part, _) in zip(roots, blocks, strict=True)]
    right = [(root @ off[:, :, None]).ravel() for root, (_, _, off) in zip(roots, blocks, strict=True)]
    return np.vstack(rows), np.concatenate(right)
