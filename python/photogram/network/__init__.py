"""Network classes in addition to the names of `photogram`, and network geometry.

A :class:`photogram.Block` accepts

* observations, each an `Observation`, or many as `Observations`: of photos `Attitude`, `Range`, `Rate`,
  `Relative`, `Velocity` and `photogram.Position`; of points `Control`, `Difference`, `EqualHeight`,
  `OnLevel`, `OnLine`, `OnPlane`, `OnPlumbLine` and `photogram.Distance`; of marks `Fiducial`; of unknowns
  `Base`, `KnownFilm`, `KnownTogether`, `Prior`, `Smoothness`;
* unknowns shared by observations, each an `Unknown`: `Boresight`, `Drift`, `Instrument`, `Level`, `Line`,
  `Plane`, `PlumbLine`, `Shift` and `photogram.LeverArm`;
* moving photos, `Timed`: with a `Shutter`, or `Lines` of a `LineSensor` behind a `Lens`; each on its
  `Trajectory`: a `Table` corrected by a `Polynomial` or a `Spline`, with `Clock`, `Readout` and `GyroBias`;
* rigs: the `Mount` of a photo on a `Sensor`;
* films and plates: the `Scan` of a `Film`, of `FilmPlacement`, `FilmSize`, `FilmBend`, `Roll`, `Readings` of
  a `Scanner` with its `ScannerCurve`, `Pattern` or `Reseau` with `Weights`; the `Mark` of a `Fiducial`;
* boards that bend: a `Figure` with its `Bend`.

`RollingShutter` and `LineScanner` move the cameras of simulated blocks. `with_distances`, `with_gnss`,
`with_inertial` and `with_rig` add observations to them. `project` and `projected` compute image
coordinates for photos at rest and on trajectories, `structure` the bandwidth of normal equations.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
