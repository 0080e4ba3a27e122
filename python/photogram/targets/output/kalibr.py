"""`camchain.yaml` of Kalibr: cameras one after the other, each with its pose to the one before."""

from __future__ import annotations

from photogram.io.yaml_text import figures
from photogram.targets.output.rig import Rig, Terms, terms_of
from photogram.targets.vision import inverted

TITLE = "camchain.yaml of Kalibr"
TERMS = 4


def kalibr_camchain(rig: Rig) -> dict[str, bytes]:
    """Return the file.

    `radtan` has k1, k2, p1, p2; `equidistant` k1 to k4. `T_cn_cnm1` takes points from the axes of the camera
    before to those of this one.
    """
    lines = []
    for row in range(len(rig.cameras)):
        lens = _lens(rig, row)
        width, height = rig.size(row)
        lines += [
            f"cam{row}:",
            "  camera_model: pinhole",
            f"  intrinsics: {figures([*lens.focal, *lens.centre])}",
            f"  distortion_model: {'equidistant' if lens.fisheye else 'radtan'}",
            f"  distortion_coeffs: {figures(lens.first(TERMS) or [])}",
            f"  resolution: [{width}, {height}]",
            f"  rostopic: /{rig.files[row]}/image_raw",
        ]
        if row:
            from_before = rig.sensors[row] @ inverted(rig.sensors[row - 1])
            lines += ["  T_cn_cnm1:", *(f"  - {figures(each)}" for each in from_before)]
    return {"camchain.yaml": "\n".join([*lines, ""]).encode()}


def _lens(rig: Rig, row: int) -> Terms:
    if not (rig.tied(row) and rig.tied(max(row - 1, 0))):
        raise rig.refusal(row, TITLE, ["opencv4"], ", which is not tied to the one before")
    found = terms_of(rig.cameras[row])
    if found is None or found.first(TERMS) is None:
        raise rig.refusal(
            row, TITLE, ["opencv4", "opencv_fisheye"], "" if found is None else ", with its terms"
        )
    return found
