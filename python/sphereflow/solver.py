"""Bundle adjustment and pose graphs: the best poses and points for all measurements together."""

from sphereflow._native import BundleProblem, PoseGraph, SimilarityGraph, SolverResult

__all__ = ["BundleProblem", "PoseGraph", "SimilarityGraph", "SolverResult"]
