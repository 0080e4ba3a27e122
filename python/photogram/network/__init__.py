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

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
