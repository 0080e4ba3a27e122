"""The page of figures in Markdown."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version

import machine
import phases
from agreement import Agreement
from runs import Measured, Record, main_seconds, main_step, package

from targets import GIB, Target, covariance_seconds, growth, targets


def table(header: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> str:
    """Return a Markdown table; all columns but the first ones stand to the right."""
    alignment = [":---"] * left + ["---:"] * (len(header) - left)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (header, alignment, *rows)) + "\n"


COMPARISON = (
    "", "computed", "seconds", "ratio", "peak GiB", "iterations", "sigma0", "weighted sum of squares",
    "photos differ", "points differ",
)  # fmt: skip


def comparison(results: Sequence[Measured], columns: int = len(COMPARISON)) -> str:
    """Return the table of what was computed by whom, in how much time and memory; its first columns."""
    rows = [row for measured in results for row in _block(measured)]
    filled = [(*row, *[""] * len(COMPARISON))[:columns] for row in rows]
    return table(COMPARISON[:columns], filled, left=2)


def heading(measured: Measured) -> str:
    """Return one line about a block."""
    size = measured.size
    strips = f"{size.strips} strips of {size.photos_per_strip}" if size.strips > 1 else "one strip"
    counts = f"{measured.points:,} points, {measured.images:,} image points"
    return f"**{measured.photos:,} photos** ({strips}), {counts}"


def _block(measured: Measured) -> Iterator[Sequence[str]]:
    """Rows of one block."""
    yield (heading(measured),)
    for side, record in measured.records.items():
        name = side.replace(":1", ", 1 thread").replace(":", ", ")
        if "failed" in record:
            yield name, f"{main_step(side)}: {record['failed']}"
        elif measured.ours is None:
            yield name, "nothing to compare with"
        else:
            agreement = measured.agreements.get(side)
            yield _solution(name, side, record, measured.ours, agreement)
            yield from _covariances(name, record, main_seconds("photogram", measured.ours), agreement)


def _solution(
    name: str, side: str, record: Record, ours: Record, agreement: Agreement | None
) -> Sequence[str]:
    """Return the row of a solution."""
    step, bold = main_step(side), "**" if side == "photogram" else ""
    everything = "solution, **all covariances, all redundancy numbers**"
    what = everything if step == "everything" else step
    seconds, total = record["seconds"][step], record["weighted_sum_of_squares"]
    return (
        f"{bold}{name}{bold}",
        what if record["converged"] else f"{what}, not converged",
        f"{bold}{seconds:.3g}{bold}",
        f"{seconds / main_seconds('photogram', ours):.2f}",
        f"{record['peak'][step] / GIB:.2f}",
        str(record["iterations"]),
        f"{(total / ours['degrees_of_freedom']) ** 0.5:.7f}",
        f"{total:.4f}",
        f"{agreement.photos:.0e}" if agreement else "",
        f"{agreement.points:.0e}" if agreement else "",
    )


def _covariances(
    name: str, record: Record, reference: float, agreement: Agreement | None
) -> Iterator[Sequence[str]]:
    """Rows of the covariances alone."""
    seconds = record["seconds"]
    differ = ["", ""]
    if agreement and agreement.photo_cofactors is not None:
        differ[0] = f"{agreement.photo_cofactors:.0e}"
    if agreement and agreement.point_cofactors is not None:
        differ[1] = f"{agreement.point_cofactors:.0e}"
    if "marginals" in record:
        done, all_of_them = record["marginals"]
        took = seconds["factor of marginals"] + seconds["marginals"] * all_of_them / done
        what = "" if done == all_of_them else f" (from {done:,} of {all_of_them:,})"
        peak = record["peak"]["marginals"]
        yield _covariance_row(name, f"all marginals{what}", took, reference, peak, differ)
    elif "covariances" in seconds:
        what, peak = "covariances of poses; of points with fixed poses", record["peak"]["covariances"]
        yield _covariance_row(name, what, seconds["covariances"], reference, peak, differ)
    elif "phases" in record and name == "photogram":
        took = covariance_seconds(record)
        yield _covariance_row(name, "its covariances and redundancy numbers", took, reference, None, differ)


def _covariance_row(
    name: str, what: str, seconds: float, reference: float, peak: float | None, differ: Sequence[str]
) -> Sequence[str]:
    memory = "" if peak is None else f"{peak / GIB:.2f}"
    return name, what, f"{seconds:.3g}", f"{seconds / reference:.2f}", memory, "", "", "", *differ


PHASES = ("phase", "seconds", "share", "10⁹ multiply-adds", "10⁹ a second", "of the product rate")


def phase_table(measured: Measured, record: Record) -> str:
    """Return the table of the phases of one adjustment."""
    rows = []
    for phase in phases.phases(record):
        counted = "" if phase.operations is None else f"{phase.operations / 1e9:.3g}"
        rate = "" if phase.rate is None else f"{phase.rate / 1e9:.3g}"
        part = "" if phase.rate is None else f"{phase.rate / measured.product:.0%}"
        name = phases.NAMES.get(phase.name, phase.name)
        rows.append((name, f"{phase.seconds:.3g}", f"{phase.share:.0%}", counted, rate, part))
    return table(PHASES, rows)


def target_table(targets: Iterable[Target]) -> str:
    """Return the table of the targets."""
    rows = [
        (
            target.name,
            target.bound,
            f"{target.reached:.3g}{target.unit}",
            "met" if target.met else "**missed**",
        )
        for target in targets
    ]
    return table(("target", "set", "reached", "met or missed"), rows)


def page(
    results: Sequence[Measured],
    small: Mapping[str, float],
    command: str,
    about: str,
    reasons: Mapping[str, str],
) -> str:
    """Return the whole page; `about` says what is compared, `reasons` why targets are missed."""
    ran = f"The tables were printed by `{command}` on {machine.processor()}; {_versions(results)}.\n"
    parts = [
        "# Performance\n",
        about,
        ran,
        "## Solutions and covariances\n",
        comparison(results),
        "## Phases\n",
    ]
    for measured in results:
        if ours := measured.ours:
            parts.append(
                f"{heading(measured)}; {ours['formations']} formations and factorisations, ordering "
                f"`{ours['ordering']}`; matrix product {measured.product / 1e9:.3g} × 10⁹ a second.\n"
            )
            parts.append(phase_table(measured, ours))
    parts.append("## Growth\n\nExponent of the total time as a function of the number of photos:\n")
    grown = [
        f"* {each.kind} from {each.smallest} to {each.largest}: {each.exponent:.3f}"
        for each in growth(results)
    ]
    parts.append("\n".join(grown or ["* not measured: one size only"]) + "\n")
    judged = list(targets(results, small))
    parts += ["## Targets\n", target_table(judged)]
    missed: dict[str, list[str]] = {}
    for target in judged:
        if not target.met and target.name in reasons:
            missed.setdefault(reasons[target.name], []).append(target.name)
    if missed:
        parts.append("Each list of missed targets is followed by the reason and by attempts to reach them.\n")
        for reason, names in missed.items():
            parts += ["\n".join(f"* {name}" for name in names) + "\n", f"{reason}\n"]
    return "\n".join(parts)


def _versions(results: Sequence[Measured]) -> str:
    """Return the versions that ran."""
    records = [item for measured in results for item in measured.records.items()]
    ran = {package(side): record["version"] for side, record in records if "version" in record}
    packages = [f"{name} {ran[name]}" for name in sorted(ran)]
    return ", ".join([f"Python {platform.python_version()}", *packages, f"numpy {version('numpy')}"])
