"""`bundleout.txt`: settings, counts, images and points in the order of jigsaw."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from photogram.formats.isis.csv_files import accuracy, rms
from photogram.formats.isis.network import POINT_TYPES
from photogram.formats.isis.outcome import Outcome
from photogram.formats.isis.parameters import KM, Parameter, parameters
from photogram.formats.isis.settings import PARAMETERS, Settings
from photogram.network.trajectories import Coefficient, Trajectory

__all__ = ["bundleout"]

_WORDS = {"first": "ANGLES", "second": "VELOCITIES", "third": "ACCELERATIONS", "all": "ALL", "none": "NONE"}


def bundleout(outcome: Outcome) -> bytes:
    """Return the text of the file."""
    parts = (_head, _settings, _results, _image_summary, _images, _points_summary, _points)
    return "".join(f"{line}\n" for part in parts for line in part(outcome)).encode()


def _title(text: str) -> list[str]:
    return ["", text, "=" * len(text), ""]


def _rows(facts: Mapping[str, object]) -> Iterator[str]:
    for name, value in facts.items():
        yield f"{name:>40}: {value}"


def _head(outcome: Outcome) -> Iterator[str]:
    network = outcome.contents.network
    yield from _title("JIGSAW: BUNDLE ADJUSTMENT")
    yield from _rows(
        {
            "Network Id": network.network_id or "",
            "Network Filename": outcome.contents.path,
            "Network Description": network.description or "",
            "Target": network.target or "",
            "Linear Units": "kilometers",
            "Angular Units": "decimal degrees",
        }
    )


def _settings(outcome: Outcome) -> Iterator[str]:
    yield from _title("INPUT: SETTINGS")
    own = outcome.contents.settings
    yield from _rows({name: _setting(own, name) for name in PARAMETERS})


def _setting(settings: Settings, name: str) -> str:
    """Return the value of a setting as jigsaw is told it."""
    parameter = PARAMETERS[name]
    value = getattr(settings, parameter.field)
    if parameter.place is not None:
        value = value[parameter.place]
    if isinstance(value, bool):
        return "YES" if value else "NO"
    if parameter.field == "positions" and value == "first":
        return "POSITION"
    return "NONE" if value is None else _WORDS.get(value, str(value).upper())


def _results(outcome: Outcome) -> Iterator[str]:
    result, network = outcome.result, outcome.contents.network
    used = int(result.used_images.sum())
    given = [each.deviations for own in result.trajectories.values() for each in _all(own.given)]
    sd = np.concatenate([np.zeros(0), *given])
    points = result.block.point_sd[result.used_points]
    controls = 3 * len(result.block.observations)
    weighted = int(((points > 0) & np.isfinite(points)).sum()) + controls
    variance = result.variance_of_unit_weight
    yield from _title("JIGSAW: RESULTS")
    yield from _rows(
        {
            "Images": len(outcome.contents.different),
            "Points": int(result.used_points.sum()),
            "Total Measures": used + int(outcome.rejected.sum()),
            "Total Observations": 2 * (used + int(outcome.rejected.sum())),
            "Good Observations": 2 * used,
            "Rejected Observations": 2 * int(outcome.rejected.sum()),
            "Constrained Point Parameters": weighted,
            "Constrained Image Parameters": int(((sd > 0) & np.isfinite(sd)).sum()),
            "Unknowns": int((sd > 0).sum() + (points > 0).sum()),
            "Degrees of Freedom": f"{result.degrees_of_freedom:g}",
            "Iterations": len(result.iterations),
            "Status": result.status,
            "Sigma0": "N/A" if variance is None else f"{np.sqrt(variance):.10f}",
            "Ignored Points": int(network.points.ignore.sum()),
        }
    )


def _all(trajectory: Trajectory) -> list[Coefficient]:
    return [each for own in trajectory.coefficients for each in own]


def _image_summary(outcome: Outcome) -> Iterator[str]:
    used = outcome.result.used_images
    yield from _title("IMAGE MEASURES SUMMARY")
    yield f"{'Measures':>9}{'rms sample':>14}{'rms line':>14}{'rms':>14}  Image Serial Number"
    for image in outcome.contents.different:
        mine = outcome.rows[image][used[outcome.rows[image]]]
        sizes = "".join(f"{each:14.6f}" for each in rms(outcome.residuals[mine]))
        yield f"{len(mine):9d}{sizes}  {image.serial}"


_PARAMETER = "{:>6} {:>14}{:>22}{:>22}{:>22}{:>18}{:>18}"


def _images(outcome: Outcome) -> Iterator[str]:
    yield from _title("IMAGE EXTERIOR ORIENTATION")
    trajectories = outcome.result.trajectories
    for image in outcome.contents.different:
        yield f"Image Full File Name: {image.path}"
        yield f"Image Serial Number: {image.serial}"
        yield _PARAMETER.format("Image", "", "Initial", "Total", "Final", "Initial", "Final")
        yield _PARAMETER.format("", "", "Value", "Correction", "Value", "Accuracy", "Accuracy")
        for each in parameters(image, trajectories[image.solving.trajectory.name]):
            yield _parameter(each)
        yield ""


def _parameter(own: Parameter) -> str:
    unit = own.unit if own.power == 0 else f"{own.unit}/t^{own.power}"
    values = [f"{value:.10f}" for value in (own.initial, own.correction, own.final)]
    sigma = "N/A" if own.apriori == 0 else f"{own.adjusted:.10f}"
    return _PARAMETER.format(own.name, f"({unit})", *values, accuracy(own.apriori), sigma)


def _points_summary(outcome: Outcome) -> Iterator[str]:
    yield from _title("POINTS SUMMARY")
    yield (
        f"{'Label':<32}{'Status':>12}{'Rays':>6}{'RMS':>12}{'Latitude':>16}{'Longitude':>16}{'Radius':>16}"
        f"{'Sigma lat':>14}{'Sigma lon':>14}{'Sigma rad':>14}"
    )
    yield f"{'':<66}{'(dd)':>12}{'(dd)':>16}{'(km)':>16}{'(m)':>14}{'(m)':>14}{'(m)':>14}"
    for name, status, row in _rows_of_points(outcome):
        latitude, longitude, radius = outcome.latitudes[row]
        sigmas = "".join(f"{each:14.6f}" for each in outcome.local_sigmas[row])
        yield (
            f"{name:<32}{status:>12}{outcome.result.point_rays[row]:6d}{outcome.point_rms[row]:12.6f}"
            f"{np.rad2deg(latitude):16.10f}{np.rad2deg(longitude):16.10f}{radius / KM:16.8f}{sigmas}"
        )


def _rows_of_points(outcome: Outcome) -> Iterator[tuple[str, str, int]]:
    """Yield name, status and row of the points that took part."""
    types = outcome.contents.network.points.types
    for row in np.flatnonzero(outcome.result.used_points).tolist():
        status = POINT_TYPES[types[outcome.point_rows[row]]].upper()
        yield outcome.result.block.point_ids[row], status, row


def _points(outcome: Outcome) -> Iterator[str]:
    yield from _title("POINTS DETAIL")
    head = f"{'':>14}{'Initial':>20}{'Correction (m)':>18}{'Final':>20}{'Sigma (m)':>16}"
    for name, status, row in _rows_of_points(outcome):
        yield f"Label: {name}"
        yield f"Status: {status}"
        yield f"Rays: {outcome.result.point_rays[row]}"
        yield head
        units = np.array([np.rad2deg(1.0), np.rad2deg(1.0), 1 / KM])
        rows = zip(
            ("LATITUDE", "LONGITUDE", "RADIUS"),
            outcome.before[row] * units,
            outcome.corrections[row],
            outcome.latitudes[row] * units,
            outcome.local_sigmas[row],
            strict=True,
        )
        for axis, before, change, after, sigma in rows:
            yield f"{axis:>14}{before:20.10f}{change:18.6f}{after:20.10f}{sigma:16.8f}"
        yield ""
