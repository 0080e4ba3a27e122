"""The files of GIANT (Elassal and Malhotra, NOAA 1987): COMMON, CAMERAS, IMAGES, FRAMES and GROUND."""

from photogram.arguments.annotations import check_arguments
from photogram.checks import Check, Finding, Section
from photogram.giant.cameras import Camera
from photogram.giant.checking import check
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
    "Check",
    "Common",
    "ErrorWarning",
    "Finding",
    "Frame",
    "GroundPoint",
    "ImageFrame",
    "Limits",
    "Project",
    "Section",
    "check",
    "error_warnings",
    "listing",
    "read_project",
    "write_project",
]

check_arguments(
    globals(), set(__all__) - {"Check", "ErrorWarning", "Finding", "ImageFrame", "Project", "Section"}
)
