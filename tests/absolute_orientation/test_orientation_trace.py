"""The eight prints that the bulletin suggests under sense switches, against its equations."""

import re
from pathlib import Path

import numpy as np
import pytest
from orientation_golden import array, cases, csv_of, load, stations

from photogram import InputError, orient
from photogram.absolute_orientation.orientation import trace_text

PRINTS = [
    "sense switch 1, after statement 2: tan K",
    "sense switch 2, before 10: sin K, S",
    "sense switch 3, after 8: rotation matrix A",
    "sense switch 4, after 27: the eight P-values of",
    "sense switch 5, after 29: seven diagonal terms and last term of the normal equations",
    "sense switch 6, after 33: bottom row of the auxiliary table",
    "sense switch 7, after 35: seven results of the back solution",
    "sense switch 8, after 36: seven corrected parameters",
]


def rotation(omega, phi, kappa):
    """Return A = K Phi Omega and its three derivatives (equations 2.3 to 2.9)."""
    (so, co), (sp, cp), (sk, ck) = ((np.sin(a), np.cos(a)) for a in (omega, phi, kappa))
    o, do = (
        np.array([[1, 0, 0], [0, co, so], [0, -so, co]]),
        np.array([[0, 0, 0], [0, -so, co], [0, -co, -so]]),
    )
    p, dp = (
        np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]]),
        np.array([[-sp, 0, -cp], [0, 0, 0], [cp, 0, -sp]]),
    )
    k, dk = (
        np.array([[ck, sk, 0], [-sk, ck, 0], [0, 0, 1]]),
        np.array([[-sk, ck, 0], [-ck, -sk, 0], [0, 0, 0]]),
    )
    return k @ p @ o, (k @ p @ do, k @ dp @ o, dk @ p @ o)


@pytest.mark.parametrize("case", cases("full_noise"))
def test_the_prints_of_full_control_are_those_of_the_bulletin(case):
    """P by equations 2.10, C by 4.3, D by 4.4, E by 4.5, from the parameters of the cycle before."""
    given = stations(case["stations"])
    result = orient(given, method="fill-in", start="report", trace=True)
    assert len(result.traces) == len(result.cycles) >= 2
    control = given.control - given.control.mean(axis=0)
    centre, model_centre = given.control.mean(axis=0), given.model.mean(axis=0)
    model = given.model - model_centre
    similarity = result.initial
    omega, phi, kappa = similarity.angles
    parameters = [omega, phi, kappa, similarity.scale, *similarity.translation]
    for trace in result.traces:
        a, derivatives = rotation(*parameters[:3])
        s, b = parameters[3], np.array(parameters[4:])
        np.testing.assert_allclose(trace.rotation, a, atol=1e-12)
        shift = b + s * a @ centre - model_centre
        columns = [s * control @ d.T for d in derivatives]
        expected = np.zeros((len(given.ids), 3, 8))
        for i in range(3):
            expected[:, i, 4 + i] = 1
            for k in range(3):
                expected[:, i, k] = columns[k][:, i]
        expected[:, :, 3] = control @ a.T
        expected[:, :, 7] = model - s * control @ a.T - shift
        places, rows = trace.equations
        assert places == [(station, axis) for station in range(len(given.ids)) for axis in range(3)]
        np.testing.assert_allclose(rows, expected.reshape(-1, 8), rtol=1e-9, atol=1e-8)
        c = rows[:, :7].T @ rows
        np.testing.assert_allclose(trace.normal, c, rtol=1e-10, atol=1e-9 * np.abs(c).max())
        e = np.linalg.solve(c[:, :7], c[:, 7])
        np.testing.assert_allclose(trace.results, e, rtol=1e-6, atol=1e-12)
        # The bottom row of D: below the diagonal what is left of C, then the last pivot and the last result.
        lower = np.linalg.cholesky(c[:, :7])
        np.testing.assert_allclose(trace.auxiliary[6, :7], lower[6] * np.diag(lower), rtol=1e-6, atol=1e-6)
        assert trace.auxiliary[6, 7] == pytest.approx(e[6], rel=1e-6, abs=1e-12)
        parameters = trace.parameters
        np.testing.assert_allclose(
            np.array(parameters[:4]), [*(np.array([omega, phi, kappa]) + e[:3]), s + e[3]]
        )
        omega, phi, kappa = parameters[:3]
    final = [*result.similarity.angles, result.similarity.scale, *result.similarity.translation]
    np.testing.assert_allclose(parameters[3:], final[3:], rtol=1e-9)


def test_the_auxiliary_table_of_the_golden_scheme():
    golden = load("gauss_crout.json")
    c = array(golden["C"])
    lower = np.linalg.cholesky(c[:, :7])
    np.testing.assert_allclose(array(golden["D"])[6, :7], lower[6] * np.diag(lower), rtol=1e-9)


@pytest.mark.parametrize("case", cases("partial_mixed"))
def test_the_option_writes_every_print_for_each_cycle(run, case):
    Path("stations.csv").write_text(csv_of(case["stations"]))
    result = run("absolute-orientation", "stations.csv", "--method", "report", "--trace", "trace.txt")
    assert result.exit_code == 0, result.output
    text = Path("trace.txt").read_text()
    cycles = text.split("\nIteration ")[1:]
    oriented = orient(stations(case["stations"]), method="report", trace=True)
    assert len(cycles) == len(oriented.cycles)
    for number, cycle in enumerate(cycles, 1):
        assert cycle.startswith(f"{number}\n")
        heads = re.findall(r"^sense switch .*$", cycle, re.MULTILINE)
        assert [head[: len(name)] for head, name in zip(heads, PRINTS, strict=True)] == PRINTS
        known = case["counts"]["n_known"]
        assert heads[3].endswith(f"{known} equations")
        lines = cycle.splitlines()
        assert len(lines[lines.index(heads[3]) + 1 :]) >= known
        tangent, sine = (float(lines[lines.index(heads[k]) + 1].split()[0]) for k in (0, 1))
        assert abs(sine) == pytest.approx(abs(tangent) / np.hypot(1, tangent), rel=1e-8)
    assert trace_text(oriented).split("\n\n")[1:] == text.split("\n\n")[1:]


def test_only_the_cycles_of_the_report_can_be_traced(run):
    refused = run("absolute-orientation", "--example", "--trace", "trace.txt")
    assert refused.exit_code == 2
    assert "requires --method report or fill-in" in refused.output
    with pytest.raises(InputError, check=lambda error: error.code == "orientation.trace"):
        orient(stations(load("cases.json")["cases"][0]["stations"]), trace=True)
    assert not orient(stations(load("cases.json")["cases"][1]["stations"]), method="report").traces
