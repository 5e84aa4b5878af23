"""Runs in the rerun viewer: record while tracking, show a result, read a recording back.

Needs the extra ``viz`` (rerun-sdk). Nothing here is used by the algorithms.
"""

from sphereflow.viz.read_back import rows_by_entity
from sphereflow.viz.recorder import RunRecorder
from sphereflow.viz.show import open_viewer, record_data, record_result

__all__ = [
    "RunRecorder",
    "open_viewer",
    "record_data",
    "record_result",
    "rows_by_entity",
]
