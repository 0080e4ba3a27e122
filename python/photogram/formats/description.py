"""Description of a project without adjustment, and a check of the conventions of its reader."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.images import Y_DOWN
from photogram.formats.models import attitude_matrices, known_cameras
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.trajectories import shared_trajectories
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message, coded, listed
from photogram.network.cameras import Camera, images_of
from photogram.network.film_reduction import camera_images, camera_unit
from photogram.network.motion import given_poses, on_shared, timed_images
from photogram.network.observations import Control
from photogram.network.trajectories import Basis, Coefficient, Polynomial
from photogram.results.datum import point_kinds
from photogram.show.judgement import remarks_section
from photogram.show.page import Document, Fact, Facts, Remarks, Section, Text, significant
from photogram.show.quantity import Quantity, Table, column, of_each

MOST_TRAJECTORIES = 12  # Largest number of trajectories in reports
MOST_RAYS = 10  # Points with more rays are counted together


def described(project: Project) -> Document:
    """Return the document of a project: sizes, cameras, trajectories, units, missing data."""
    remarks = [*project.messages, *doubts(project)]
    size, members = _size(project)
    block, found = project.block, agreement(project)
    down = {each.image_y for each in known_cameras(block)[0]} == {"down"}
    corner = "pixels from the upper-left corner" if down else ""
    conventions = [Fact("Frame", str(project.frame)), Fact("Unit", block.linear_unit)]
    conventions.append(Fact("Image coordinates", block.image_unit, note=corner))
    if images := len(found.xy):
        note = f"{images} images with the positions of the file"
        residual = Fact.of("Median residual", found.median, camera_unit(block), figures=3, note=note)
        conventions.append(residual)
    return Document(
        "Project",
        project.title,
        sections=[
            Section("read", "Read", [Text(f"{project.path}: {project.title}")]),
            Section("given-size", "Size", [size]),
            Section("given-cameras", "Cameras", [_cameras(project)]),
            Section("given-trajectories", "Trajectories", _trajectories(project)),
            Section("conventions", "Units and axes", [Facts("", conventions)]),
            Section("lacking", "Lacking", [Remarks([*map(str, project.lacks)])]),
            remarks_section(remarks),
        ],
        members={
            "path": str(project.path),
            "title": project.title,
            **members,
            "frame": project.frame,
            "unit": project.block.linear_unit,
            "image_unit": project.block.image_unit,
            "median_residual": found.median,
            "lacks": coded(project.lacks),
            "messages": coded(remarks),
        },
    )


def _size(project: Project) -> tuple[Facts, dict[str, Any]]:
    """Return numbers of photos, observations and points as facts, and as members of JSON."""
    block = project.block
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    counts = np.bincount(np.minimum(rays[rays > 0], MOST_RAYS), minlength=MOST_RAYS + 1).tolist()
    of_rays = {f"{k}{' or more' * (k == MOST_RAYS)}": count for k, count in enumerate(counts) if count}
    kinds, of_points = Counter(each.label for each in block.observations), point_kinds(block)
    others = {name for each in block.observations if not isinstance(each, Control) for name in each.points}
    measured = (rays > 0) | np.isin(block.point_ids, list(others))
    control, checks = (int(np.count_nonzero(measured & (of_points == kind))) for kind in ("control", "check"))
    idle = [block.point_ids[row] for row in np.flatnonzero(~measured & (of_points != "pass"))]
    members: dict[str, Any] = {
        "photos": len(block.photo_ids),
        "photos_with_position": int(np.count_nonzero(np.isfinite(block.photo_positions).all(axis=1))),
        "images": len(block.image_xy),
        "points": int(np.count_nonzero(rays)),
        "rays": of_rays,
        "control_points": control,
        "check_points": checks,
        "control_without_observations": idle,
        "observations": dict(kinds),
        "features": list(project.features),
        "photos_on_frames": len(block.mounts),
    }
    facts = [
        Fact.of("Photos", members["photos"], note=f"{members['photos_with_position']} with a position"),
        Fact.of("Images", members["images"], note=f"of {members['points']} points"),
        Fact("Rays of points", ", ".join(f"{count} with {k}" for k, count in of_rays.items()) or "none"),
        Fact.of("Control points", control),
        Fact.of("Check points", checks),
        *([Fact("Control without observations", listed(idle))] if idle else []),
        *(Fact.of(f"Observations, {kind}", count) for kind, count in kinds.items()),
    ]
    if project.features:
        facts.append(Fact.of("Features", len(project.features), note=listed(list(project.features))))
    if block.mounts:
        facts.append(Fact.of("Photos on frames with others", len(block.mounts)))
    return Facts("", facts), members


def _cameras(project: Project) -> Table:
    cameras, which = known_cameras(project.block)
    sizes = [*project.sizes, *[None] * len(cameras)][: len(cameras)]
    given = [{name: value for name, value in each.parameters.items() if value} for each in cameras]
    values = [", ".join(f"{name} {significant(value, 7)}" for name, value in own.items()) for own in given]
    columns = [
        of_each(cameras, "title", kind="name", name="name", head="Camera"),
        of_each(cameras, "model", kind="name", name="model", head="Model"),
        Quantity([(size and " x ".join(map(str, size))) or "" for size in sizes], kind="name", head="Pixels"),
        Quantity(sizes, member="pixels"),
        column("photos", [which.count(row) for row in range(len(cameras))], "Photos"),
        of_each(cameras, "unit", kind="name", name="unit", head="Unit"),
        Quantity(values, kind="name", head="Parameters"),
        Quantity([dict(each.parameters) for each in cameras], member="parameters"),
    ]
    return Table("cameras", "Cameras", columns)


def _trajectories(project: Project) -> list[Facts | Table]:
    """Return numbers of photos on trajectories, and the trajectories of several photos."""
    block, facts = project.block, list[Fact]()
    shared = shared_trajectories(block)
    if block.timed:
        kinds = {
            "with a rolling shutter": sum(each.shutter is not None for each in block.timed),
            "of a line scanner": sum(each.lines is not None for each in block.timed),
            "with a motion of their own": sum(each.trajectory is None for each in block.timed),
        }
        facts = [Fact.of(f"Photos {what}", count) for what, count in kinds.items() if count]
        facts.insert(0, Fact.of("Photos on trajectories", len(block.timed)))
    settings = project.details.get("settings")
    if (block.timed or shared) and isinstance(settings, Settings) and settings.times:
        facts.append(Fact("Times", str(settings.times)))
    moments = [(each.moment.trajectory, each.label) for each in block.observations if each.moment is not None]
    kinds_on = [Counter(label for one, label in moments if one is each) for each in shared]
    counted_kinds = [listed([f"{n} {kind}" for kind, n in each.items()]) for each in kinds_on]
    columns = [
        of_each(shared, "name", kind="name", name="name", head="Trajectory"),
        column("photos", [sum(one.trajectory is each for one in block.timed) for each in shared], "Photos"),
        column("positions", [len(each.table.times) for each in shared], "Records of positions"),
        column("attitudes", [len(each.table.attitude_times) for each in shared], "Of attitudes"),
        column("start_s", [each.table.span[0] for each in shared], "Start, s", decimals=1),
        column("end_s", [each.table.span[1] for each in shared], "End, s", decimals=1),
        *(
            column(
                name,
                [_basis(getattr(each, name), each.coefficients[k]) for each in shared],
                head,
                kind="name",
            )
            for k, (name, head) in enumerate({"position": "Position", "rotation": "Rotation"}.items())
        ),
        Quantity(counted_kinds, kind="name", head="Observations"),
        Quantity([dict(each) for each in kinds_on], member="observations"),
    ]
    hidden = len(shared) - MOST_TRAJECTORIES
    note = f"{hidden} more trajectories" if hidden > 0 else ""
    rows = np.arange(min(len(shared), MOST_TRAJECTORIES))
    return [Facts("", facts), Table("trajectories", "Trajectories", columns, note, shown=rows)]


def _basis(basis: Basis | None, coefficients: tuple[Coefficient, ...]) -> str:
    if basis is None:
        return "as given"
    kind = "polynomial" if isinstance(basis, Polynomial) else "spline"
    known = ", fixed" if all(each.is_held for each in coefficients) else ""
    return f"{kind} of degree {basis.degree}, {len(coefficients)} coefficients{known}"


MOST = 20_000  # Largest number of observations used
GROSS, PART = 50.0, 0.1  # Pixels, and part of the width: median residuals that exceed both are doubtful
BETTER = 10.0  # Smallest improvement of the residual for which another convention is reported
NEARLY_ALL = 0.9


@dataclass(frozen=True)
class Agreement:
    """Observations used, for comparison with the images of the positions of a file."""

    cameras: list[Camera]
    which: Indices
    vectors: Floats  # From the projection centres to the points
    matrices: Floats  # Object to photo
    xy: Floats

    @property
    def directions(self) -> Floats:
        """Directions to the points in the axes of the photos."""
        return np.asarray(np.einsum("nij,nj->ni", self.matrices, self.vectors))

    @property
    def median(self) -> float:
        """Median length of residuals, in the unit of the images; NaN without any."""
        directions = self.directions
        with np.errstate(all="ignore"):
            images = images_of(self.cameras, self.which, directions)
        lengths = np.linalg.norm(images - self.xy, axis=1)
        seen = np.isfinite(lengths) & (directions[:, 2] < 0)
        return float(np.median(np.where(seen, lengths, np.inf))) if len(self.xy) else np.nan

    def mirrored(self, axis: int) -> Agreement:
        """Return the observations reversed about the principal point."""
        xy, axes = self.xy.copy(), np.tile([0.0, 0.0, -1.0], (len(self.xy), 1))
        middle = images_of(self.cameras, self.which, axes)
        xy[:, axis] = 2 * middle[:, axis] - xy[:, axis]
        return replace(self, xy=xy)


def agreement(project: Project) -> Agreement:
    block = project.block
    points, matrices = project.positions(), attitude_matrices(block)
    poses = np.column_stack([matrices.reshape(-1, 9), block.photo_positions])
    # The pose of a photo on a trajectory is only approximate.
    posed: Bools = np.asarray(np.isfinite(poses).all(axis=1)) | on_shared(block)
    placed: Bools = np.asarray(np.isfinite(points).all(axis=1))
    good = posed[block.image_photos] & placed[block.image_points]
    if block.geographic:
        good = np.zeros_like(good)
    rows = np.flatnonzero(good)
    rows = rows[:: max(1, len(rows) // MOST)]
    photos = block.image_photos[rows]
    cameras, photo_cameras = known_cameras(block)
    sampled = np.full(len(block.image_xy), -1)
    sampled[rows] = np.arange(len(rows))
    places, axes, xy = block.photo_positions[photos], matrices[photos], camera_images(block)[rows]
    for own, trajectory, _, images in timed_images(block):
        of_photo = sampled[images][sampled[images] >= 0]
        if not len(of_photo):
            continue
        time, since, xy[of_photo] = own.images(xy[of_photo])
        scale = 1.0 if own.readout is None else float(own.readout.position[0])
        offset = 0.0 if own.offset is None else float(own.offset.position[0])
        flown, turned = given_poses(trajectory, np.clip(time + offset + scale * since, *trajectory.reach))
        places[of_photo], axes[of_photo] = flown, turned
        if own.sensor is not None:
            places[of_photo] += turned @ own.sensor.position
            axes[of_photo] = turned @ own.sensor.attitude
    which = np.asarray(photo_cameras, dtype=np.int64)[photos]
    vectors = points[block.image_points[rows]] - places
    return Agreement(cameras, which, vectors, axes.transpose(0, 2, 1), xy)


def doubts(project: Project) -> list[Message]:
    """Return messages on disagreement, with a convention that fits.

    The project is not changed.
    """
    found = agreement(project)
    if not len(found.xy):
        return []
    messages, behind, median = list[Message](), float(np.mean(found.directions[:, 2] > 0)), found.median
    if behind > 0:
        code = "agreement.mirrored" if behind > NEARLY_ALL else "agreement.behind"
        messages.append(Message.of(code, percent=100 * behind))
    widths = [size[0] for size in project.sizes if size is not None]
    scale = float(np.median(project.block.camera_scales()))
    limit = max(GROSS, PART * min(widths)) if widths and camera_unit(project.block) == "px" else PART * scale
    if median > limit:
        helps = [name for name, change in _OTHERS.items() if change(found).median * BETTER < median]
        code = "agreement.convention" if helps else "agreement.residuals"
        fields = {"median": median, "unit": camera_unit(project.block), "names": helps}
        messages.append(Message.of(code, **fields, factor=BETTER))
    return messages


_OTHERS: dict[str, Callable[[Agreement], Agreement]] = {
    "y (rows) in the opposite direction": lambda found: found.mirrored(1),
    "x (columns) in the opposite direction": lambda found: found.mirrored(0),
    "transposed rotations": lambda found: replace(found, matrices=found.matrices.transpose(0, 2, 1)),
    "photos in the opposite direction": lambda found: replace(found, matrices=Y_DOWN @ found.matrices),
}
