"""Bundle adjustment and pose graphs: the best poses and points for all measurements together."""

from sphereflow._native import (
    BundleProblem,
    ImuPreintegration,
    InertialWindow,
    Motion,
    PoseGraph,
    SimilarityGraph,
    SolverResult,
)

__all__ = [
    "BundleProblem",
    "ImuPreintegration",
    "InertialWindow",
    "Motion",
    "PoseGraph",
    "SimilarityGraph",
    "SolverResult",
]
