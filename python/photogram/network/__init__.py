"""What networks are built of, beside what `photogram` has at the top, and their geometry.

A :class:`photogram.Block` takes

* observations, each an `Observation`: of photos `Attitude`, `Range`, `Rate`, `Relative`, `Velocity` and
  `photogram.Position`; of points `Control`, `Difference`, `EqualHeight`, `OnLevel`, `OnLine`, `OnPlane`,
  `OnPlumbLine` and `photogram.Distance`; of marks `Fiducial`; of unknowns alone `Base`, `KnownFilm`,
  `KnownTogether`, `Prior`, `Smoothness`;
* what observations have in common, each an `Unknown`: `Boresight`, `Drift`, `Instrument`, `Level`, `Line`,
  `Plane`, `PlumbLine`, `Shift` and `photogram.LeverArm`;
* photos that move, `Timed`: with a `Shutter`, or `Lines` of a `LineSensor` behind a `Lens`; each on its
  `Trajectory`: a `Table` corrected by a `Polynomial` or a `Spline`, with `Clock`, `Readout` and `GyroBias`;
* rigs: the `Mount` of a photo on a `Sensor`;
* films and plates: the `Scan` of a `Film`, of `FilmPlacement`, `FilmSize`, `FilmBend`, `Roll`, `Readings` of
  a `Scanner` with its `ScannerCurve`, `Pattern` or `Reseau` with `Weights`; the `Mark` of a `Fiducial`;
* boards that bend: a `Figure` with its `Bend`.

Cameras of simulated blocks move by `RollingShutter` and `LineScanner`; `with_distances`, `with_gnss`,
`with_inertial` and `with_rig` measure more of these blocks. `project` and `projected` say where points are
seen, by photos at rest and on trajectories, `structure` how wide a band normal equations have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.network.films import (
        Film,
        FilmBend,
        FilmPlacement,
        FilmSize,
        Mark,
        Pattern,
        Readings,
        Reseau,
        Roll,
        Scan,
        Scanner,
        ScannerCurve,
        Weights,
    )
    from photogram.network.geometry import (
        geocentric_to_geographic,
        geographic_to_geocentric,
        lengths_of_units,
        local_frames,
        project,
        refraction_shift,
        rotation_angles,
        rotation_matrix,
        viewing_directions,
    )
    from photogram.network.lens import Lens
    from photogram.network.moving_photos import Lines, LineSensor, Shutter, Timed
    from photogram.network.observations import (
        Attitude,
        Base,
        Control,
        Difference,
        EqualHeight,
        Fiducial,
        KnownFilm,
        KnownTogether,
        Observation,
        OnLevel,
        OnLine,
        OnPlane,
        OnPlumbLine,
        Prior,
        Range,
        Rate,
        Relative,
        Smoothness,
        Velocity,
    )
    from photogram.network.passages import Bend, Figure
    from photogram.network.projecting import projected
    from photogram.network.rigs import Mount
    from photogram.network.simulated_motion import LineScanner, RollingShutter
    from photogram.network.simulated_observations import with_distances, with_gnss, with_inertial, with_rig
    from photogram.network.structuring import Structure, structure
    from photogram.network.trajectories import Clock, GyroBias, Polynomial, Readout, Spline, Table, Trajectory
    from photogram.network.unknowns import (
        Boresight,
        Drift,
        Instrument,
        Level,
        Line,
        Plane,
        PlumbLine,
        Sensor,
        Shift,
        Unknown,
    )

__all__ = [
    "Attitude",
    "Base",
    "Bend",
    "Boresight",
    "Clock",
    "Control",
    "Difference",
    "Drift",
    "EqualHeight",
    "Fiducial",
    "Figure",
    "Film",
    "FilmBend",
    "FilmPlacement",
    "FilmSize",
    "GyroBias",
    "Instrument",
    "KnownFilm",
    "KnownTogether",
    "Lens",
    "Level",
    "Line",
    "LineScanner",
    "LineSensor",
    "Lines",
    "Mark",
    "Mount",
    "Observation",
    "OnLevel",
    "OnLine",
    "OnPlane",
    "OnPlumbLine",
    "Pattern",
    "Plane",
    "PlumbLine",
    "Polynomial",
    "Prior",
    "Range",
    "Rate",
    "Readings",
    "Readout",
    "Relative",
    "Reseau",
    "Roll",
    "RollingShutter",
    "Scan",
    "Scanner",
    "ScannerCurve",
    "Sensor",
    "Shift",
    "Shutter",
    "Smoothness",
    "Spline",
    "Structure",
    "Table",
    "Timed",
    "Trajectory",
    "Unknown",
    "Velocity",
    "Weights",
    "geocentric_to_geographic",
    "geographic_to_geocentric",
    "lengths_of_units",
    "local_frames",
    "project",
    "projected",
    "refraction_shift",
    "rotation_angles",
    "rotation_matrix",
    "structure",
    "viewing_directions",
    "with_distances",
    "with_gnss",
    "with_inertial",
    "with_rig",
]

_HOMES = {
    "Attitude": "observations",
    "Base": "observations",
    "Bend": "passages",
    "Boresight": "unknowns",
    "Clock": "trajectories",
    "Control": "observations",
    "Difference": "observations",
    "Drift": "unknowns",
    "EqualHeight": "observations",
    "Fiducial": "observations",
    "Figure": "passages",
    "Film": "films",
    "FilmBend": "films",
    "FilmPlacement": "films",
    "FilmSize": "films",
    "geocentric_to_geographic": "geometry",
    "geographic_to_geocentric": "geometry",
    "GyroBias": "trajectories",
    "Instrument": "unknowns",
    "KnownFilm": "observations",
    "KnownTogether": "observations",
    "lengths_of_units": "geometry",
    "Lens": "lens",
    "Level": "unknowns",
    "Line": "unknowns",
    "Lines": "moving_photos",
    "LineScanner": "simulated_motion",
    "LineSensor": "moving_photos",
    "local_frames": "geometry",
    "Mark": "films",
    "Mount": "rigs",
    "Observation": "observations",
    "OnLevel": "observations",
    "OnLine": "observations",
    "OnPlane": "observations",
    "OnPlumbLine": "observations",
    "Pattern": "films",
    "Plane": "unknowns",
    "PlumbLine": "unknowns",
    "Polynomial": "trajectories",
    "Prior": "observations",
    "project": "geometry",
    "projected": "projecting",
    "Range": "observations",
    "Rate": "observations",
    "Readings": "films",
    "Readout": "trajectories",
    "refraction_shift": "geometry",
    "Relative": "observations",
    "Reseau": "films",
    "Roll": "films",
    "RollingShutter": "simulated_motion",
    "rotation_angles": "geometry",
    "rotation_matrix": "geometry",
    "Scan": "films",
    "Scanner": "films",
    "ScannerCurve": "films",
    "Sensor": "unknowns",
    "Shift": "unknowns",
    "Shutter": "moving_photos",
    "Smoothness": "observations",
    "Spline": "trajectories",
    "Structure": "structuring",
    "structure": "structuring",
    "Table": "trajectories",
    "Timed": "moving_photos",
    "Trajectory": "trajectories",
    "Unknown": "unknowns",
    "Velocity": "observations",
    "viewing_directions": "geometry",
    "Weights": "films",
    "with_distances": "simulated_observations",
    "with_gnss": "simulated_observations",
    "with_inertial": "simulated_observations",
    "with_rig": "simulated_observations",
}
"""The module of each name, loaded when it is first asked for: most networks need few of them."""

__getattr__, __dir__ = on_demand(__name__, _HOMES)
