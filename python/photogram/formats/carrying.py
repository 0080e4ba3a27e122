"""A model in a frame of its own, carried to where it is on the earth."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.writing import attitude_matrices
from photogram.formats.project import Frame, Project
from photogram.messages import Message
from photogram.network.attitudes import Attitudes


def is_free(project: Project) -> bool:
    """Whether nothing but its first values says where the model of a project is.

    Trajectories say it: what is known of them beforehand is in the axes of the project.
    """
    block = project.block
    return not (block.observations or block.timed or np.isfinite(block.photo_position_sd).any())


def carried(project: Project, by: tuple[float, Floats, Floats], frame: Frame, message: Message) -> Project:
    """Return a project whose model is carried into a frame by a similarity.

    Parameters
    ----------
    project
        The project; nothing of it is held.
    by
        The scale, the (3, 3) rotation and the (3,) shift.
    frame
        What it is carried into.
    message
        What is said of it.
    """
    block = project.block
    scale, turn, shift = by
    matrices = attitude_matrices(block)
    posed = np.isfinite(matrices).all(axis=(1, 2))
    angles = block.photo_attitudes.copy()
    angles[posed] = Attitudes(turn @ matrices[posed]).values("omega_phi_kappa")
    return project.replace(
        block=block.replace(
            photo_positions=scale * block.photo_positions @ turn.T + shift,
            photo_attitudes=angles,
            photo_to_ground=False,
        ),
        starts=scale * project.starts @ turn.T + shift,
        frame=frame,
        messages=(*project.messages, message),
    )
