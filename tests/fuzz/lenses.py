"""Every camera written out once more, for real and complex arguments: formulas of `docs/cameras.md`.

Arguments may have imaginary parts so small that their squares vanish: those of the values are then their
derivatives (Squire and Trapp 1998). Functions that are not analytic for complex numbers in NumPy, or lose
such parts, are written by their derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

__all__ = ["BACKWARD", "FORWARD", "arctan", "arctan2"]

Numbers = NDArray[np.complex128]
Values = Mapping[str, complex]
Projection = Callable[[Numbers, Values], tuple[Numbers, Numbers]]


def arctan(x: Numbers) -> Numbers:
    """Return the arc tangent."""
    return np.arctan(x.real) + 1j * x.imag / (1 + x.real**2)


def arctan2(y: Numbers, x: Numbers) -> Numbers:
    """Return the angle of a point of the plane."""
    square = x.real**2 + y.real**2
    return np.arctan2(y.real, x.real) + 1j * (x.real * y.imag - y.real * x.imag) / square


def _vision(u: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    return u[:, 0], -u[:, 1], -u[:, 2]


def _central(u: Numbers, _: Values) -> tuple[Numbers, Numbers]:
    x, y, z = _vision(u)
    return x / z, y / z


def _by_angle(of: Callable[[Numbers], Numbers]) -> Projection:
    """Return a fisheye whose radius is a function of the angle from the axis."""

    def project(u: Numbers, _: Values) -> tuple[Numbers, Numbers]:
        x, y, z = _vision(u)
        rho = np.sqrt(x * x + y * y)
        ratio = of(arctan2(rho, z)) / rho
        return ratio * x, ratio * y

    return project


_equidistant = _by_angle(lambda theta: theta)
_equisolid = _by_angle(lambda theta: 2 * np.sin(theta / 2))
_stereographic = _by_angle(lambda theta: 2 * np.tan(theta / 2))


def _fov(u: Numbers, p: Values) -> tuple[Numbers, Numbers]:
    a, b = _central(u, p)
    r = np.sqrt(a * a + b * b)
    half = np.tan(np.atleast_1d(np.asarray(p["omega"], complex)) / 2)
    ratio = arctan(2 * r * half) / (r * p["omega"])
    return ratio * a, ratio * b


def _division(u: Numbers, p: Values) -> tuple[Numbers, Numbers]:
    x, y, z = _vision(u)
    ratio = 2 / (z + np.sqrt(z * z - 4 * p["k"] * (x * x + y * y)))
    return ratio * x, ratio * y


def _eucm(u: Numbers, p: Values) -> tuple[Numbers, Numbers]:
    x, y, z = _vision(u)
    depth = p["alpha"] * np.sqrt(p["beta"] * (x * x + y * y) + z * z) + (1 - p["alpha"]) * z
    return x / depth, y / depth


def _pixels(p: Values, a: Numbers, b: Numbers) -> Numbers:
    """Return columns and rows of what the lens has made, whatever of these a model has."""
    fx, fy = (p["f"], p["f"]) if "f" in p else (p["fx"], p["fy"])
    column = fx * a + p["cx"] + p.get("b1", 0) * a + p.get("b2", 0) * b + p.get("skew", 0) * fx * b
    row = fy * b + p["cy"]
    return np.column_stack([column + p.get("w", 0) / 2, row + p.get("h", 0) / 2])


def _lens(
    projection: Projection, radial: str, *, swapped: bool = True
) -> Callable[[Numbers, Values], Numbers]:
    """Return a camera of vision with radial terms of some names, tangential and prism ones where it has any.

    `swapped`: p1 and p2 are those of OpenCV, P2 and P1 of photogrammetry.
    """
    above, _, below = radial.partition("/")

    def image(u: Numbers, p: Values) -> Numbers:
        a, b = projection(u, p)
        q = a * a + b * b
        factor = 1 + sum(p[name] * q**power for power, name in enumerate(above.split(), 1))
        factor = factor / (1 + sum(p[name] * q**power for power, name in enumerate(below.split(), 1)))
        t1, t2 = (p.get("p2", 0), p.get("p1", 0)) if swapped else (p.get("p1", 0), p.get("p2", 0))
        profile = 1 + p.get("p3", 0) * q + p.get("p4", 0) * q * q
        bent_a = a * factor + profile * (t1 * (q + 2 * a * a) + 2 * t2 * a * b)
        bent_b = b * factor + profile * (t2 * (q + 2 * b * b) + 2 * t1 * a * b)
        bent_a += p.get("s1", p.get("sx1", 0)) * q + (p["s2"] * q * q if "s4" in p else 0)
        bent_b += (p["s3"] * q + p["s4"] * q * q) if "s4" in p else p.get("sy1", 0) * q
        return _pixels(p, *_tilted(p, bent_a, bent_b))

    return image


def _tilted(p: Values, a: Numbers, b: Numbers) -> tuple[Numbers, Numbers]:
    if "tau_x" not in p:
        return a, b
    sx, cx, sy, cy = np.sin(p["tau_x"]), np.cos(p["tau_x"]), np.sin(p["tau_y"]), np.cos(p["tau_y"])
    r = np.array([[cy, sy * sx, -sy * cx], [0, cx, sx], [sy, -cy * sx, cy * cx]], complex)
    turned = r @ np.array([a, b, np.ones_like(a)])
    return (
        (r[2, 2] * turned[0] - r[0, 2] * turned[2]) / turned[2],
        (r[2, 2] * turned[1] - r[1, 2] * turned[2]) / turned[2],
    )


def _rad_tan_thin_prism(u: Numbers, p: Values) -> Numbers:
    a, b = _equidistant(u, p)
    r = a * a + b * b
    factor = 1 + sum(p[f"k{k}"] * r ** (k + 1) for k in range(6))
    x, y = a * factor, b * factor
    q = x * x + y * y
    return _pixels(
        p,
        x + p["p0"] * (2 * x * x + q) + 2 * p["p1"] * x * y + p["s0"] * q + p["s1"] * q * q,
        y + 2 * p["p0"] * x * y + p["p1"] * (2 * y * y + q) + p["s2"] * q + p["s3"] * q * q,
    )


def _bal(u: Numbers, p: Values) -> Numbers:
    x, y = -u[:, 0] / u[:, 2], -u[:, 1] / u[:, 2]
    q = x * x + y * y
    factor = p["f"] * (1 + p["k1"] * q + p["k2"] * q * q)
    return np.column_stack([factor * x, factor * y])


def _radial(u: Numbers, p: Values) -> Numbers:
    x, y = _bal(u, p).T
    return np.column_stack([p["cx"] + x, p["cy"] - y])


def _perspective(u: Numbers, p: Values) -> Numbers:
    return np.column_stack([p["c"] * u[:, 0] / u[:, 2], p["c"] * u[:, 1] / u[:, 2]])


def _balanced(p: Values, q: Numbers, letter: str) -> Numbers:
    return sum(p[f"{letter}{k}"] * (q**k - p["r0"] ** (2 * k)) for k in (1, 2, 3))


def _brown_forward(u: Numbers, p: Values) -> Numbers:
    x, y = _perspective(u, p).T
    q = x * x + y * y
    r = _balanced(p, q, "A")
    return np.column_stack(
        [
            p["xp"] + x + x * r + p["B1"] * (q + 2 * x * x) + 2 * p["B2"] * x * y + p["C1"] * x + p["C2"] * y,
            p["yp"] + y + y * r + p["B2"] * (q + 2 * y * y) + 2 * p["B1"] * x * y,
        ]
    )


def _equirectangular(u: Numbers, p: Values) -> Numbers:
    x, y, z = _vision(u)
    column = p["w"] * (0.5 + arctan2(x, z) / (2 * np.pi))
    return np.column_stack([column, p["h"] * (0.5 + arctan2(y, np.sqrt(x * x + z * z)) / np.pi)])


def _plate(u: Numbers, p: Values) -> Numbers:
    x, y, z = _vision(u)
    c_y = p["c_y"] if p["c_y"] != 0 else p["c"]
    if p["c0"] == 0:
        a, b, m_x, m_y = p["c"] * x / z, c_y * y / z, 1.0, 1.0
    else:
        a, b, m_x, m_y = p["c0"] * x / z, p["c0"] * y / z, p["c"] / p["c0"], c_y / p["c0"]
    d, e = a - p["dx"], b - p["dy"]
    q = d * d + e * e
    r, t = p["K1"] * q + p["K2"] * q * q + p["K3"] * q**3, p["K4"] + p["K5"] * q
    c, s = np.cos(p["phi_T"]), np.sin(p["phi_T"])
    row = p["yp"] + m_y * (b + e * r + t * ((q + 2 * e * e) * s + 2 * d * e * c))
    column = p["xp"] + m_x * (a + d * r + t * ((q + 2 * d * d) * c + 2 * d * e * s)) - p["epsilon"] * row
    return np.column_stack([column, row])


def _cahvor(u: Numbers, p: Values) -> Numbers:
    v, (a, b) = np.stack(_vision(u)), (p["axis_x"], p["axis_y"])
    o = np.array([[np.cos(b) * np.sin(a)], [np.sin(b)], [np.cos(b) * np.cos(a)]])
    along = np.sum(v * o, axis=0)
    t = np.sum(v * v, axis=0) / along**2 - 1
    mu = p["r0"] + p["r1"] * t + p["r2"] * t * t
    bent = (1 + mu) * v - mu * along * o
    return _pixels(p, bent[0] / bent[2], bent[1] / bent[2])


FORWARD: dict[str, Callable[[Numbers, Values], Numbers]] = {
    "perspective": _perspective,
    "bal": _bal,
    "radial": _radial,
    "equirectangular": _equirectangular,
    "brown_forward": _brown_forward,
    "plate": _plate,
    "simple_pinhole": _lens(_central, ""),
    "pinhole": _lens(_central, ""),
    "simple_radial": _lens(_central, "k"),
    "opencv": _lens(_central, "k1 k2"),
    "full_opencv": _lens(_central, "k1 k2 k3/k4 k5 k6"),
    "opencv_pinhole": _lens(_central, "k1 k2 k3/k4 k5 k6"),
    "opencv_tilted": _lens(_central, "k1 k2 k3/k4 k5 k6"),
    "cahvor": _cahvor,
    "fov": _lens(_fov, ""),
    "simple_fisheye": _lens(_equidistant, ""),
    "fisheye": _lens(_equidistant, ""),
    "simple_radial_fisheye": _lens(_equidistant, "k"),
    "radial_fisheye": _lens(_equidistant, "k1 k2"),
    "opencv_fisheye": _lens(_equidistant, "k1 k2 k3 k4"),
    "opencv_fisheye_skew": _lens(_equidistant, "k1 k2 k3 k4"),
    "thin_prism_fisheye": _lens(_equidistant, "k1 k2 k3 k4"),
    "rad_tan_thin_prism_fisheye": _rad_tan_thin_prism,
    "equisolid": _lens(_equisolid, "k1 k2"),
    "stereographic": _lens(_stereographic, "k1 k2"),
    "simple_division": _lens(_division, ""),
    "division": _lens(_division, ""),
    "eucm": _lens(_eucm, ""),
    "agisoft_frame": _lens(_central, "k1 k2 k3 k4", swapped=False),
    "agisoft_fisheye": _lens(_equidistant, "k1 k2 k3 k4", swapped=False),
    "agisoft_frame_p4": _lens(_central, "k1 k2 k3 k4", swapped=False),
    "agisoft_fisheye_p4": _lens(_equidistant, "k1 k2 k3 k4", swapped=False),
}
"""Where directions u (n, 3), in the axes of the photo, are seen: (n, 2)."""


def _brown(xy: Numbers, p: Values, *, after: bool = False) -> Numbers:
    x, y = xy[:, 0] - p["xp"], xy[:, 1] - p["yp"]
    own, more = x, p["b1"] * x + p["b2"] * y
    if not after:
        own, more = x + more, 0 * x
    q = own * own + y * y
    r = _balanced(p, q, "K")
    return np.column_stack(
        [
            own + own * r + p["P1"] * (q + 2 * own * own) + 2 * p["P2"] * own * y + more,
            y + y * r + p["P2"] * (q + 2 * y * y) + 2 * p["P1"] * own * y,
        ]
    )


def _ebner(xy: Numbers, p: Values) -> Numbers:
    x, y, e = xy[:, 0] - p["xp"], xy[:, 1] - p["yp"], [0, *(p[f"e{k}"] for k in range(1, 13))]
    k, m = x * x - 2 * p["b"] ** 2 / 3, y * y - 2 * p["b"] ** 2 / 3
    in_x = x + e[1] * x + e[2] * y - 2 * e[3] * k + e[4] * x * y + e[5] * m + e[7] * x * m + e[9] * y * k
    in_y = y - e[1] * y + e[2] * x + e[3] * x * y - 2 * e[4] * m + e[6] * k + e[8] * y * k + e[10] * x * m
    return np.column_stack([in_x + e[11] * k * m, in_y + e[12] * k * m])


_OTHERS = [
    f"{i}{j}"
    for i in range(1, 6)
    for j in range(1, 6)
    if i + j > 4 and (i, j) not in {(2, 2), (3, 1), (1, 3)}
]


def _gruen(xy: Numbers, p: Values) -> Numbers:
    x, y, b2 = xy[:, 0] - p["xp"], xy[:, 1] - p["yp"], p["b"] ** 2

    def basis(v: Numbers) -> list[Numbers]:
        third = v * (v * v - 17 * b2 / 20)
        return [1 + 0 * v, v, v * v - b2 / 2, third, v * v * (v * v - 31 * b2 / 28) + 9 * b2 * b2 / 70]

    along_x, along_y = basis(x), basis(y)
    k, m = along_x[2], along_y[2]
    in_x = x + p["a12"] * x + p["a21"] * y + p["a22"] * x * y + p["a31"] * m - 10 / 7 * p["b22"] * k
    in_y = y - p["a12"] * y + p["a21"] * x - 10 / 7 * p["a22"] * m + p["b13"] * k + p["b22"] * x * y
    for pair in _OTHERS:
        i, j = (int(digit) - 1 for digit in pair)
        in_x, in_y = (
            in_x + p[f"a{pair}"] * along_y[i] * along_x[j],
            in_y + p[f"b{pair}"] * along_y[i] * along_x[j],
        )
    return np.column_stack([in_x, in_y])


def _on_comparator(xy: Numbers, p: Values) -> Numbers:
    x, y = xy[:, 0] - p["x0"], xy[:, 1] - p["y0"]
    d = (1 + p["mx"]) * x + (1 + p["my"]) * np.sin(p["lean"]) * y, (1 + p["my"]) * np.cos(p["lean"]) * y
    s, t = d[0] / p["hx"], d[1] / p["hy"]
    terms = dict(zip("ABCDEFGHJ", (s**4, t**4, s**3, t**3, s**2, t**2, s, t, 1), strict=True))
    bowed = [
        d[k] + sum(p[f"{axis}{name}"] * term for name, term in terms.items()) for k, axis in enumerate("xy")
    ]
    return _brown(np.column_stack(bowed), {**p, "b1": 0, "b2": 0, "r0": 0})


BACKWARD: dict[str, Callable[[Numbers, Values], Numbers]] = {
    "brown": _brown,
    "brown_affinity_after": lambda xy, p: _brown(xy, p, after=True),
    "ebner": _ebner,
    "gruen": _gruen,
    "on_comparator": _on_comparator,
}
"""What measured positions (n, 2) are corrected to, from the principal point: (n, 2)."""
