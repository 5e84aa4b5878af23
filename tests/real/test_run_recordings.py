"""The main job on real recordings: full coverage, all files, honest error, a view that opens."""

from pathlib import Path

import pytest
import sphereflow as sf
from sphereflow.cli import app
from sphereflow.viz import rows_by_entity
from typer.testing import CliRunner

# Frame-to-frame odometry without keyframes or calibration; the acceptance figures of this step.
LIMITS_M = {"tum-fr1-rpy-a": 0.045, "sevenscenes-kitchen-a": 0.060}


@pytest.mark.parametrize("name", LIMITS_M)
def test_run_on_a_recording_covers_every_frame(name: str, recordings: Path, tmp_path: Path) -> None:
    out, view = tmp_path / "result", tmp_path / "view.rrd"
    arguments = ["run", recordings / name, "--out", out, "--rrd", view]
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == 0, done.output
    written = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert written >= {"trajectory.tum", "odometry.tum", "map.ply", "report.json"}
    assert written >= {f"pictures/{part}.png" for part in ("trajectory", "depth", "map")}
    recording = sf.io.open_recording(recordings / name)
    estimate = sf.Trajectory.read(out / "trajectory.tum")
    assert len(estimate) == len(recording)
    assert recording.truth is not None
    error = sf.eval.ape(recording.truth, estimate, max_difference_s=0.02)
    assert error.statistics.rmse < LIMITS_M[name]
    rows = rows_by_entity(view)
    assert rows["/world/camera/depth"] > 50
    assert rows["/motion/linear_m_s/x"] == len(recording)
