"""The command: help that teaches, errors in one line, exit statuses, figures."""

from __future__ import annotations

import json

import fakes
import numpy as np
import pytest
import sphereflow
from sphereflow.cli import app
from typer.testing import CliRunner

VERBS = ("run", "depth", "demo", "sim", "info", "ape", "rpe", "traj", "view")
runner = CliRunner()


def invoke(*arguments):
    return runner.invoke(app, [str(argument) for argument in arguments])


def assert_user_error(result, status, text):
    assert result.exit_code == status, result.output
    assert text in result.stderr
    assert "Traceback" not in result.output + result.stderr
    assert result.stderr.count("error: ") == 1


@pytest.fixture
def pair(tmp_path):
    truth, estimate = tmp_path / "truth.tum", tmp_path / "estimate.tum"
    trajectory = fakes.trajectory(60)
    trajectory.write(truth, format="tum")
    moved = np.asarray(trajectory.position_m) * 1.25 + [1.0, 2.0, 3.0]
    sphereflow.Trajectory(trajectory.stamp_ns, moved, trajectory.quat_xyzw).write(
        estimate, format="tum"
    )
    return truth, estimate


def test_help_without_a_verb_lists_every_verb():
    output = invoke("--help").output
    assert all(verb in output for verb in VERBS)
    assert "sphereflow demo --out demo" in output


@pytest.mark.parametrize("verb", VERBS)
def test_help_of_each_verb_has_examples(verb):
    result = invoke(verb, "--help")
    assert result.exit_code == 0
    assert "Examples" in result.output
    assert f"sphereflow {verb} " in result.output


def test_unknown_verb_is_a_usage_error():
    assert invoke("fly").exit_code == 2


def test_ape_with_alignment_prints_the_table(pair):
    result = invoke("ape", *pair, "-as")
    assert result.exit_code == 0, result.stderr
    lines = dict(line.split()[:2] for line in result.output.splitlines()[1:] if line.count("  "))
    assert lines["rmse"] == "0.000000"
    assert lines["scale"] == "0.8"
    assert "matched poses  60" in result.output


def test_ape_json_has_the_statistics_and_the_transformation(pair):
    values = json.loads(invoke("ape", *pair, "--align", "--json").output)
    assert values["align"] == "se3"
    assert values["pairs"] == 60
    assert set(values["statistics"]) == {"rmse", "mean", "median", "std", "min", "max", "sse"}
    assert np.shape(values["reference_from_estimate"]) == (4, 4)


def test_ape_plot_writes_a_picture(pair, tmp_path):
    assert invoke("ape", *pair, "-a", "--plot", tmp_path / "error.png").exit_code == 0
    assert (tmp_path / "error.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("spelling", [("--t_max_diff",), ("--t-max-diff",)])
def test_options_are_read_with_underscores_and_with_dashes(pair, spelling):
    assert invoke("ape", *pair, "-a", *spelling, 0.02).exit_code == 0


def test_rpe_takes_the_options_of_evo(pair):
    result = invoke("rpe", *pair, "-d", 5, "-u", "f", "-r", "angle_deg", "--all_pairs", "-as")
    assert result.exit_code == 0, result.stderr
    assert "rotation_deg, over 5 frames, all pairs, align sim3 (deg)" in result.output
    assert "pairs   55" in result.output


def test_ape_of_a_missing_file_is_one_line_and_a_next_step(pair, tmp_path):
    result = invoke("ape", pair[0], tmp_path / "nothing.tum")
    assert_user_error(result, 1, "nothing.tum")
    assert "next: " in result.stderr


def test_ape_without_overlap_is_one_line_with_both_spans(pair, tmp_path):
    later = tmp_path / "later.tum"
    trajectory = fakes.trajectory(20)
    sphereflow.Trajectory(
        trajectory.stamp_ns + 10**12, trajectory.position_m, trajectory.quat_xyzw
    ).write(later, format="tum")
    result = invoke("ape", pair[0], later)
    assert_user_error(result, 1, "1700001000.123456789 to")


def test_rpe_with_an_impossible_step_exits_2(pair):
    assert_user_error(invoke("rpe", *pair, "-d", 0), 2, "delta must be above 0")


def test_align_and_align_origin_together_exit_2(pair):
    result = invoke("ape", *pair, "-a", "--align_origin")
    assert result.exit_code == 2
    assert "cannot be used" in result.stderr


def test_traj_prints_what_a_file_holds(pair):
    result = invoke("traj", pair[0])
    assert result.exit_code == 0, result.stderr
    assert "60" in result.output
    assert "30.00 Hz" in result.output


def test_traj_converts_one_file_but_not_two(pair, tmp_path):
    copy = tmp_path / "copy.tum"
    assert invoke("traj", pair[0], "--save_as_tum", copy).exit_code == 0
    assert np.array_equal(sphereflow.Trajectory.read(copy, format="tum").stamp_ns, fakes.stamps(60))
    assert invoke("traj", *pair, "--save_as_tum", copy).exit_code == 2


def test_traj_plot_draws_all_files(pair, tmp_path):
    assert invoke("traj", *pair, "--plot", tmp_path / "both.png").exit_code == 0
    assert (tmp_path / "both.png").stat().st_size > 10_000


def test_file_that_repeats_a_stamp_is_read_with_a_warning(pair, tmp_path):
    lines = pair[0].read_text().splitlines()
    repeated = tmp_path / "repeated.tum"
    repeated.write_text("\n".join([*lines[:9], lines[8], lines[4], *lines[9:]]) + "\n")
    result = invoke("ape", repeated, pair[1], "-as")
    assert result.exit_code == 0, result.stderr
    assert "row with the stamp of the row before left out" in result.stderr
    assert "row with a stamp before the last one left out" in result.stderr
    assert "matched poses  60" in result.output


def test_ape_of_a_file_that_is_no_trajectory_names_the_line(pair, tmp_path):
    text = tmp_path / "text.tum"
    text.write_text("1.0 2.0 three\n")
    assert_user_error(invoke("ape", pair[0], text), 1, "text.tum:1")


@pytest.fixture
def recording(monkeypatch, known_answers):
    import sphereflow.io
    import sphereflow.sim

    made = fakes.FakeRecording(40)
    monkeypatch.setattr(sphereflow.io, "open_recording", lambda path, **options: made)
    monkeypatch.setattr(sphereflow.sim, "demo", lambda **options: made)
    return made


@pytest.mark.usefixtures("recording")
def test_run_prints_a_summary_and_exits_0(tmp_path):
    result = invoke("run", "data", "--out", tmp_path / "out", "--no-pictures")
    assert result.exit_code == 0, result.stderr
    assert "100.0 % of the frames have a pose" in result.output
    assert (tmp_path / "out" / "report.json").is_file()


def test_run_prints_both_errors_and_what_the_pose_graph_did(tmp_path, recording, known_answers):
    known_answers.drift_m = 0.002
    recording.readout_s, recording.depth_corrected = 0.02, True
    result = invoke("run", "data", "--out", tmp_path / "out", "--no-pictures")
    assert result.exit_code == 0, result.stderr
    lines = {line.split("  ")[1]: line for line in result.output.splitlines()}
    assert "4 keyframes, 8 edges, 1 rejected, largest change 78.0 mm" in lines["pose graph"]
    assert "20 ms (recording)" in lines["read-out"]
    assert "made up for a test; depth corrected" in lines["calibration"]
    assert "rmse 0.000000 m" in lines["ape"]
    assert "rmse 0.000000 m" not in lines["odometry_ape"]
    assert "rpe_1s_rotation" in lines
    assert "odometry_rpe_1s_rotation" in lines
    assert "at the final poses" in lines["map"]


@pytest.mark.usefixtures("recording")
def test_run_options_reach_the_engine(tmp_path, known_answers):
    known_answers.drift_m = 0.002
    options = ("--no-pose-graph", "--readout", 0.03, "--no-pictures")
    result = invoke("run", "data", "--out", tmp_path / "out", *options)
    assert result.exit_code == 0, result.stderr
    assert known_answers.made[-1].calibration.readout_s == 0.03
    assert known_answers.made[-1].graph is None
    assert "none: not asked for" in result.output
    assert "30 ms (given)" in result.output
    assert "odometry_ape" not in result.output
    result = invoke("demo", "--out", tmp_path / "demo", "--no-pose-graph", "--no-pictures")
    assert "none: not asked for" in result.output


@pytest.mark.parametrize("readout", [1.0, "nan"])
def test_run_with_an_impossible_readout_exits_2(tmp_path, readout):
    room, out = tmp_path / "room", tmp_path / "out"
    assert invoke("sim", "--out", room, "--duration", 0.1).exit_code == 0
    assert_user_error(invoke("run", room, "--out", out, "--readout", readout), 2, "readout_s")
    assert not out.exists()


def test_run_and_info_take_a_calibration_with_readout_and_depth_correction(tmp_path):
    room, file = tmp_path / "room", tmp_path / "camera.toml"
    assert invoke("sim", "--out", room, "--duration", 0.4).exit_code == 0
    own = sphereflow.Calibration.read(room / "calibration.toml")
    sphereflow.Calibration(
        own.depth,
        depth_scale=own.depth_scale,
        readout_s=0.01,
        depth_field={"relative": {"one": 0.02}},
    ).write(file)
    told = invoke("info", room, "--calibration", file)
    assert told.exit_code == 0, told.stderr
    lines = [line.split() for line in told.output.splitlines()]
    assert ["read-out", "10", "ms"] in lines
    assert ["depth", "distortion", "corrected", "by", "the", "calibration"] in lines
    plain = " ".join(invoke("info", room).output.split())
    assert "read-out unknown depth distortion not known" in plain
    done = invoke("run", room, "--out", tmp_path / "out", "--calibration", file, "--no-pictures")
    assert done.exit_code == 0, done.stderr
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert (report["readout_s"], report["readout_source"]) == (0.01, "recording")
    assert report["depth_corrected"] is True
    assert report["calibration"]["source"] == str(file)
    assert f"{file}; depth corrected" in done.output


def test_run_help_says_when_to_calibrate():
    output = " ".join(invoke("run", "--help").output.split())
    for command in (
        "sphereflow calib depth my_recording --out camera.toml",
        "sphereflow run my_recording --out result --calibration camera.toml",
        "sphereflow calib rolling-shutter",
    ):
        assert command in output


@pytest.mark.parametrize("verb", ["depth", "rolling-shutter"])
def test_help_of_each_calibration_has_examples(verb):
    result = invoke("calib", verb, "--help")
    assert result.exit_code == 0
    assert f"sphereflow calib {verb} " in result.output


def test_run_with_low_coverage_writes_all_and_exits_1(tmp_path, recording, known_answers):
    known_answers.lost = tuple(range(20, 40))
    result = invoke("run", "data", "--out", tmp_path / "out", "--no-pictures")
    assert_user_error(result, 1, "coverage 0.500 is below 0.9; first reason: 20 usable domains")
    assert (tmp_path / "out" / "trajectory.tum").is_file()
    again = ("run", "data", "--out", tmp_path / "out", "--no-pictures", "--overwrite")
    assert invoke(*again, "--min-coverage", 0.5).exit_code == 0


@pytest.mark.usefixtures("recording")
def test_run_into_a_full_folder_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    assert_user_error(invoke("run", "data", "--out", tmp_path), 1, "is not empty")


@pytest.mark.usefixtures("recording")
def test_demo_tracks_and_prints_the_error_against_the_truth(tmp_path):
    result = invoke("demo", "--out", tmp_path / "out", "--no-pictures")
    assert result.exit_code == 0, result.stderr
    assert "rmse 0.000000 m over 40" in result.output


def test_sim_writes_a_recording_that_can_be_read(tmp_path):
    result = invoke("sim", "--out", tmp_path / "room", "--duration", 0.2, "--rate", 20)
    assert result.exit_code == 0, result.stderr
    found = json.loads(invoke("info", tmp_path / "room", "--json").output)
    assert found["frames"] in (4, 5)
    assert found["truth_poses"] > 0
    assert found["depth"]["known_share"] > 0.5


def test_sim_into_a_full_folder_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    result = invoke("sim", "--out", tmp_path, "--duration", 0.1)
    assert result.exit_code == 1, result.output
    assert result.stderr.count("error: ") == 1


@pytest.mark.usefixtures("recording")
def test_info_prints_streams_calibration_and_depth():
    result = invoke("info", "data")
    assert result.exit_code == 0, result.stderr
    for text in ("30.00 Hz, no gaps", "pinhole 32x24", "5000 counts per metre", "% known"):
        assert text in result.output
    assert json.loads(invoke("info", "data", "--json").output)["truth_poses"] == 40


def test_info_of_a_wrong_depth_scale_says_which_would_fit(recording):
    recording.depth_factor, recording.depth_scale = 1000.0, 1.0
    output = " ".join(invoke("info", "data").output.split())
    assert "is the depth scale 1 right? 1000 (Kinect, RealSense, 7-Scenes) would make it" in output


def test_view_of_nothing_is_one_line(tmp_path):
    pytest.importorskip("rerun")
    assert_user_error(invoke("view", tmp_path / "nothing"), 1, "no such file")


@pytest.mark.usefixtures("recording")
def test_view_of_a_result_and_of_data_writes_files_that_open(tmp_path):
    pytest.importorskip("rerun")
    from sphereflow.viz import rows_by_entity

    assert invoke("run", "data", "--out", tmp_path / "out", "--no-pictures").exit_code == 0
    assert invoke("view", tmp_path / "out", "--save", tmp_path / "out.rrd").exit_code == 0
    assert rows_by_entity(tmp_path / "out.rrd")["/world/path"] == 1
    (tmp_path / "data").mkdir()
    assert invoke("view", tmp_path / "data", "--save", tmp_path / "data.rrd").exit_code == 0
    assert rows_by_entity(tmp_path / "data.rrd")["/world/camera/depth"] == 14


def test_view_without_rerun_says_how_to_install_it(tmp_path, monkeypatch):
    import importlib

    def without(name, *rest):
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", without)
    (tmp_path / "a.rrd").write_bytes(b"")
    result = invoke("view", tmp_path / "a.rrd")
    assert_user_error(result, 1, 'pip install "sphereflow[viz]"')
