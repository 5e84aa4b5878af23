"""Dense depth from the images of an ordinary camera whose motion is known (Chapters 2 to 4).

`DepthFilter` is the best; `FlowObserver`, `DepthObserver`, `sobolev_depth` and `tv_l1_depth` are
the thesis's own methods, with what is printed wrong put right.
"""

from sphereflow._native import (
    DepthFilter,
    DepthObserver,
    DepthResult,
    FlowObserver,
    VariationalDepth,
    sobolev_depth,
    tv_l1_depth,
)

__all__ = [
    "DepthFilter",
    "DepthObserver",
    "DepthResult",
    "FlowObserver",
    "VariationalDepth",
    "sobolev_depth",
    "tv_l1_depth",
]
