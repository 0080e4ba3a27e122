"""The files of GIANT (Elassal and Malhotra, NOAA 1987): COMMON, CAMERAS, IMAGES, FRAMES and GROUND."""

from photogram.arguments.annotations import check_arguments
from photogram.giant import checking  # noqa: F401  (how a project is diagnosed)
from photogram.giant.cameras import Camera
from photogram.giant.common import Common
from photogram.giant.diagnostics import ErrorWarning, error_warnings
from photogram.giant.frames import Frame
from photogram.giant.ground import GroundPoint
from photogram.giant.images import ImageFrame
from photogram.giant.limits import Limits
from photogram.giant.listing import listing
from photogram.giant.project import Project, read_project, write_project

__all__ = [
    "Camera",
    "Common",
    "ErrorWarning",
    "Frame",
    "GroundPoint",
    "ImageFrame",
    "Limits",
    "Project",
    "error_warnings",
    "listing",
    "read_project",
    "write_project",
]

check_arguments(globals(), set(__all__) - {"ErrorWarning", "ImageFrame", "Project"})
