"""How far an estimated trajectory is from the truth: absolute and relative pose error.

The definitions and the options are those of *evo*, the tool the field compares with, so the
numbers can be put side by side. Nothing here prints or draws; see ``sphereflow.plots``.
"""

from sphereflow.eval.absolute import ape
from sphereflow.eval.alignment import Alignment, umeyama
from sphereflow.eval.arrays import TrajectoryLike
from sphereflow.eval.relative import rpe
from sphereflow.eval.result import PoseError, Statistics

__all__ = ["Alignment", "PoseError", "Statistics", "TrajectoryLike", "ape", "rpe", "umeyama"]
