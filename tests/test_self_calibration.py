"""Self-calibration of a depth camera from Python and the command line."""

import json

import numpy as np
import pytest
import sphereflow
from sphereflow.calibration import calibrate_depth, calibrate_rolling_shutter
from sphereflow.cli import app
from typer.testing import CliRunner

READOUT_S = 0.03


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    """Three seconds of a camera with a rolling shutter whose calibration does not say so."""
    folder = tmp_path_factory.mktemp("recordings") / "moving"
    camera = sphereflow.Camera.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)
    simulator = sphereflow.sim.Simulator(
        camera=camera, duration_s=3.0, readout_s=READOUT_S, depth_noise="none", imu=False
    )
    simulator.write(folder)
    file = folder / "calibration.toml"
    lines = file.read_text().splitlines(keepends=True)
    assert any(line.startswith("readout_s") for line in lines)
    file.write_text("".join(line for line in lines if not line.startswith("readout_s")))
    return folder


def test_rolling_shutter_of_a_simulated_recording_is_found_and_written(moving, tmp_path):
    told = []
    calibrated = calibrate_rolling_shutter(
        moving, max_pairs=60, progress=lambda *args: told.append(args)
    )
    found = calibrated.found
    assert found.status == "calibrated"
    assert found.reason is None
    assert found.readout_s == pytest.approx(READOUT_S, abs=2e-3)
    assert found.residual_after < found.residual_before
    assert found.covariance.shape == (1, 1)
    assert found.parameters[0]["name"] == "readout_s"
    assert found.parameters[0]["observable"]
    assert {what for what, _, _ in told} == {"track", "calibrate"}
    path = tmp_path / "camera.toml"
    calibrated.write(path)
    recording = sphereflow.io.open_recording(moving, calibration=path)
    assert recording.readout_s == pytest.approx(found.readout_s)
    assert not recording.depth_corrected


def test_depth_calibration_is_applied_when_the_recording_is_opened(moving, tmp_path):
    calibrated = calibrate_depth(moving, max_frames=60, max_pairs=40)
    found = calibrated.found
    assert found.status == "calibrated"
    assert len(found.parameters) == 24
    assert set(found.depth_correction) == {"relative", "additive"}
    path = tmp_path / "camera.toml"
    calibrated.write(path)
    corrected = sphereflow.io.open_recording(moving, calibration=path)
    assert corrected.depth_corrected
    assert corrected.camera == found.camera
    stored = calibrated.recording.frame(0).depth_m
    ray = found.camera.unproject([[20.0, 30.0]])[0]
    z1, z2 = ray[:2] / ray[2]
    r2 = z1 * z1 + z2 * z2
    terms = dict(
        one=1.0, z1=z1, z2=z2, z1_z1=z1 * z1, z1_z2=z1 * z2, z2_z2=z2 * z2,
        r2_z1=r2 * z1, r2_z2=r2 * z2, r4=r2 * r2,
    )  # fmt: skip
    field = found.depth_correction
    factor = 1 + sum(field["relative"][name] * term for name, term in terms.items())
    offset = sum(field["additive"][name] * term for name, term in terms.items())
    expected = 1 / (factor / stored[30, 20] + offset)
    assert corrected.frame(0).depth_m[30, 20] == pytest.approx(expected, rel=1e-6)
    with pytest.raises(sphereflow.DataError, match="corrected already"):
        calibrate_depth(moving, calibration=path)


@pytest.fixture
def standing(tmp_path):
    """One second of a camera that does not move."""
    folder = tmp_path / "standing"
    camera = sphereflow.Camera.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)
    writer = sphereflow._native.RecordingWriter(folder, camera)
    rows, columns = np.mgrid[:120, :160]
    rng = np.random.default_rng(1)
    for index in range(30):
        noise = rng.normal(0, 1e-3, (120, 160))
        depth = (1 / (0.4 + 1e-3 * columns + 1e-3 * rows + noise)).astype(np.float32)
        writer.push(depth, index * 33_000_000)
    writer.finish()
    return folder


def test_calib_verbs_of_a_standing_camera_fail_and_write_nothing(standing, tmp_path):
    out = tmp_path / "camera.toml"
    for verb in ("depth", "rolling-shutter"):
        result = CliRunner().invoke(app, ["calib", verb, str(standing), "--out", str(out)])
        assert result.exit_code == 1, result.output
        assert "not observable" in result.output
        assert not out.exists()


def test_calib_rolling_shutter_prints_the_parameter_and_writes_the_file(moving, tmp_path):
    out = tmp_path / "camera.toml"
    command = ["calib", "rolling-shutter", str(moving), "--out", str(out), "--max-pairs", "60"]
    result = CliRunner().invoke(app, [*command, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["status"] == "calibrated"
    assert found["readout_s"] == pytest.approx(READOUT_S, abs=2e-3)
    assert "readout_s" in out.read_text()
    text = CliRunner().invoke(app, command).output
    assert "readout_s" in text
    assert "sphereflow run DATA --calibration" in text


def test_calib_help_teaches_what_to_record():
    for verb in ("depth", "rolling-shutter"):
        result = CliRunner().invoke(app, ["calib", verb, "--help"])
        assert result.exit_code == 0
        assert "What to record" in result.output


@pytest.mark.parametrize(
    ("settings", "name"),
    [({"max_frames": 0}, "max_frames"), ({"max_pairs": 1}, "max_pairs")],
)
def test_calibrate_depth_of_wrong_settings_names_them(moving, settings, name):
    with pytest.raises(sphereflow.ValueRangeError, match=name):
        calibrate_depth(moving, **settings)
