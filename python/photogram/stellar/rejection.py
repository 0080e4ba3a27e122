"""Data that the user rejects (NOAA TR NOS 55, section 5.10 of its specification)."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

import numpy as np

from photogram.errors import InputError
from photogram.stellar.problem import Problem

__all__ = ["rejected"]


def rejected(problem: Problem, stars: Set[str], points: Set[str]) -> Problem:
    """Return a problem without the named stars and plate points; a star that loses all its images goes, too.

    Raises
    ------
    InputError
        A number that is not there.
    """
    missing = sorted(set(stars) - set(problem.star_ids)) + sorted(set(points) - set(problem.image_points))
    if missing:
        raise InputError(f"rejected but not there: {', '.join(missing)}")
    if not stars and not points:
        return problem
    left = problem.without(
        np.array([star in stars for star in problem.star_ids]),
        np.array([point in points for point in problem.image_points]),
    )
    lost = sorted(set(problem.star_ids) - set(left.star_ids) - set(stars))
    labels = dict(problem.labels)
    for name, values in (("rejected stars", sorted(stars)), ("rejected points", sorted(points))):
        if values:
            labels[name] = ", ".join(values)
    if lost:
        labels["stars eliminated, all images rejected"] = ", ".join(lost)
    return replace(left, labels=labels)
