"""Cameras that were calibrated elsewhere are observations of a block, with their full covariance.

A star plate calibrates a camera (`photogram stellar-camera`); a grid plate calibrates the comparator that its
plates are read on (`photogram comparator`). Blocks of such plates take both calibrations as weighted priors,
and say what is known of the camera afterwards.
"""

from importlib.resources import files
from pathlib import Path

from photogram import Camera, Result, adjust, camera_from, comparator, simulate
from photogram.stellar import calibrate, camera_document, read_plain

EXAMPLES = Path(str(files("photogram") / "examples"))


def plate_camera(folder: Path) -> Camera:
    """Calibrate the packaged star plate, write its camera file and read that as a camera of blocks."""
    file = folder / "camera.json"
    file.write_bytes(camera_document(calibrate(read_plain(EXAMPLES / "stellar" / "plate.toml"))))
    return camera_from(file, "star camera")


def camera_on_comparator() -> Camera:
    """Calibrate the packaged comparator and lay a camera on it, known to 0.02 mm."""
    calibration = comparator.calibrate(comparator.read([EXAMPLES / "comparator" / "comparator-3.txt"])[0])
    camera = Camera("brown", {"c": -150.0}, sd={"c": 0.02}, name="on comparator 3")
    return calibration.joint.correction.as_camera(camera)


def block_with(camera: Camera) -> Result:
    """Adjust a small block whose photos the camera has taken."""
    simulation = simulate(
        strips=2, photos_per_strip=4, frame_size=90.0, seed=7, cameras=[camera], start_cameras=[camera]
    )
    return adjust(simulation.block)


def main(folder: Path) -> None:
    """Print what the calibrations know of their cameras, and what the blocks know afterwards."""
    for camera in (plate_camera(folder), camera_on_comparator()):
        adjusted = block_with(camera).cameras[0]
        print(f"{camera.name}: {camera.model}, {adjusted.photos} photos")
        rows = zip(camera.names, camera.deviations, adjusted.sd, adjusted.redundancy, strict=True)
        for name, before, after, redundancy in rows:
            if before > 0:
                print(f"  {name:8}  sd {before:9.3g} before, {after:9.3g} after; redundancy {redundancy:.3f}")


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        main(Path(place))
