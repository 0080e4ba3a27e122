"""Scanned film from readings to ground: each photo by its marks alone, then all inside one adjustment.

The project is the packaged example of an archive (`photogram new DIR --kind archive`). Prints how well the
affine fit of each photo agrees with the certificate, which an error of the certificate or a pattern of the
film spoils on all photos; then the films as the adjustment has them, the marks that it moved most, and what
the usual two steps would have made of the points' standard deviations.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from photogram import Result, adjust, formats
from photogram.film import Interior, interior_orientation
from photogram.network import Fiducial

ARCHIVE = files("photogram") / "examples" / "archive"


def adjusted(interior: str = "inside") -> Result:
    """Return the archive adjusted, films inside or fitted before."""
    with TemporaryDirectory() as folder:
        for each in ARCHIVE.iterdir():
            text = each.read_text(encoding="utf-8")
            text = text.replace('interior = "inside"', f'interior = "{interior}"')
            (Path(folder) / each.name).write_text(text, encoding="utf-8")
        return adjust(formats.read(folder).block, unit_variance="unity")


def alone(result: Result) -> dict[str, Interior]:
    """Return the interior orientation of each photo from its marks alone."""
    found = {}
    for row, film in result.films:
        photo = result.block.photo_ids[row]
        every = [each for each in result.block.observations if isinstance(each, Fiducial)]
        read = [each for each in every if each.photo == photo]
        found[photo] = interior_orientation(
            np.array([each.mark.position[:2] for each in read]),
            np.array([each.reading for each in read]),
            "affine",
            sd=np.array([each.sd for each in read]),
            counted=film.readings,
            scanner=film.scanner,
            mirrored=film.mirrored,
        )
    return found


def main() -> None:
    """Print what marks alone say, and what the adjustment does."""
    result = adjusted()
    forms = result.film_forms
    print("photo   p alone   scale x    scale y   shear arcsec   sd")
    for photo, fit in alone(result).items():
        form, shear = forms[photo], np.degrees(3600.0)
        print(
            f"{photo:<6}{fit.p:>9.4f}{form.scale_x:>11.6f}{form.scale_y:>11.6f}"
            f"{shear * form.between_axes:>12.1f}{shear * form.sd[2]:>8.1f}"
        )
    moved = sorted(result.fiducials.values(), key=lambda mark: -np.hypot(*mark.change))
    for mark in moved[:2]:
        x, y = (1e3 * mark.change).tolist()
        print(f"{mark.name} lies {x:+.1f}, {y:+.1f} um beside its certificate")
    inside, before = (np.nanmedian(each.point_sd[:, 2]) for each in (result, adjusted("before")))
    print(f"sd of heights, median: {inside:.3f} m; with films fitted before {before:.3f} m")


if __name__ == "__main__":
    main()
