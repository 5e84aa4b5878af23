"""The main job around an odometry that knows the answer: files, report, statuses, atomicity."""

from __future__ import annotations

import json

import fakes
import numpy as np
import pytest
import sphereflow
from sphereflow.pipeline import run

EXACT = 1e-6
"""The trajectory is written with nine digits."""


@pytest.fixture(autouse=True)
def known(known_answers):
    return known_answers


def test_run_of_a_recording_writes_every_file(tmp_path):
    result = run(fakes.FakeRecording(), tmp_path / "out")
    names = sorted(p.relative_to(result.folder).as_posix() for p in result.folder.rglob("*.*"))
    assert names == [
        "map.ply",
        "odometry.tum",
        "pictures/depth.png",
        "pictures/error.png",
        "pictures/map.png",
        "pictures/trajectory.png",
        "pictures/velocities.png",
        "report.json",
        "trajectory.tum",
    ]
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert result.covered
    assert result.coverage == 1.0
    assert result.ape.statistics.rmse < EXACT
    written = sphereflow.Trajectory.read(result.folder / "trajectory.tum")
    assert np.array_equal(written.stamp_ns, fakes.stamps(60))


def test_run_report_counts_what_became_of_every_frame(tmp_path, known):
    known.lost = (20, 21, 30)
    recording = fakes.FakeRecording(bad=(7,), blind=(11, 12), warnings=["a line was skipped"])
    result = run(recording, tmp_path / "out", pictures=False)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report == json.loads(json.dumps(result.report))
    outcomes = report["outcomes"]
    counts = {name: outcome["frames"] for name, outcome in outcomes.items()}
    assert counts == {
        "started": 1,
        "tracked": 53,
        "weak": 0,
        "lost": 5,
        "skipped": 0,
        "unreadable": 1,
    }
    reasons = {reason["first"]: reason["frames"] for reason in outcomes["lost"]["reasons"]}
    assert reasons == {
        "the frame has no depth image": 2,
        "20 usable domains, 8 needed": 3,
    }
    assert "depth/7.png: 17 bytes" in outcomes["unreadable"]["reasons"][0]["first"]
    assert report["frames"] == 60
    assert report["frames_with_depth"] == 57
    assert report["coverage"] == pytest.approx(54 / 60)
    assert report["warnings"] == {"count": 1, "texts": ["a line was skipped"]}
    assert set(report["seconds"]) == {"decode", "odometry", "map", "evaluate", "write"}
    assert report["odometry_ms_per_frame"] == pytest.approx({"pyramid": 0.5, "solve": 1.5})
    assert report["timing"]["rate_hz"] == pytest.approx(1e9 / fakes.STEP_NS)
    assert report["timing"]["gaps"]["count"] == 0
    assert report["peak_memory_bytes"] > 1_000_000
    assert report["truth"]["ape"]["pairs"] == 54


def test_run_writes_no_pose_for_a_lost_frame(tmp_path, known):
    known.lost = (5, 6)
    result = run(fakes.FakeRecording(20), tmp_path / "out", pictures=False)
    written = sphereflow.Trajectory.read(result.folder / "trajectory.tum")
    assert len(written) == 18
    assert not set(fakes.stamps(20)[[5, 6]]) & set(np.asarray(written.stamp_ns).tolist())
    assert result.coverage == 0.9
    assert result.covered


def test_run_without_any_pose_is_not_covered_and_writes_no_trajectory(tmp_path, known):
    known.lost = tuple(range(10))
    result = run(fakes.FakeRecording(10), tmp_path / "out")
    assert not result.covered
    assert result.trajectory is None
    assert not (result.folder / "trajectory.tum").exists()
    assert result.report["truth"] == {"ape": "no frame has a pose"}


def test_run_stops_at_max_frames(tmp_path):
    seen = []
    run(
        fakes.FakeRecording(60),
        tmp_path / "out",
        max_frames=12,
        pictures=False,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen[-1] == (12, 12)


def test_run_into_a_full_folder_is_refused_and_changes_nothing(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.doc").write_text("years of work")
    with pytest.raises(sphereflow.DataError, match="is not empty"):
        run(fakes.FakeRecording(), tmp_path / "out")
    with pytest.raises(sphereflow.DataError, match="is no result of an earlier run"):
        run(fakes.FakeRecording(), tmp_path / "out", overwrite=True)
    assert (tmp_path / "out" / "thesis.doc").read_text() == "years of work"


def test_run_with_overwrite_replaces_an_earlier_result(tmp_path):
    run(fakes.FakeRecording(30), tmp_path / "out")
    result = run(fakes.FakeRecording(12), tmp_path / "out", overwrite=True, pictures=False)
    assert result.report["frames"] == 12
    assert not (tmp_path / "out" / "pictures").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_run_that_fails_leaves_nothing_behind(tmp_path, known, monkeypatch):
    def broken(self, depth_m, stamp_ns):
        raise RuntimeError("a defect")

    monkeypatch.setattr(known, "push", broken)
    with pytest.raises(RuntimeError):
        run(fakes.FakeRecording(), tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"method": "magic"}, "method must be one of depth"),
        ({"max_frames": 0}, "max_frames"),
        ({"min_coverage": 1.5}, "min_coverage"),
        ({"voxel_m": 0.0}, "voxel_m"),
    ],
)
def test_run_with_an_impossible_option_is_an_error(tmp_path, options, text):
    with pytest.raises(sphereflow.ValueRangeError, match=text):
        run(fakes.FakeRecording(), tmp_path / "out", **options)


def test_run_without_matplotlib_says_so_in_the_report(tmp_path, monkeypatch):
    import builtins

    real = builtins.__import__

    def without(name, *rest, **kwargs):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *rest, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    result = run(fakes.FakeRecording(10), tmp_path / "out")
    assert 'pip install "sphereflow[plot]"' in result.report["warnings"]["texts"][0]


def test_run_records_for_the_viewer_a_file_that_opens(tmp_path):
    pytest.importorskip("rerun")
    from sphereflow.viz import rows_by_entity

    run(fakes.FakeRecording(45), tmp_path / "out", rrd=tmp_path / "out" / "run.rrd", pictures=False)
    rows = rows_by_entity(tmp_path / "out" / "run.rrd")
    for axis in "xyz":
        assert rows[f"/motion/linear_m_s/{axis}"] == 45
    assert rows["/motion/score"] == rows["/log/status"] == 45
    assert rows["/world/camera/depth"] == rows["/world/camera/colour"] == 15
    assert rows["/world/path"] == rows["/world/truth"] == 1
    assert rows["/world/map"] >= 1
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


def test_run_recording_outside_the_result_is_removed_when_the_run_fails(
    tmp_path, known, monkeypatch
):
    pytest.importorskip("rerun")

    def broken(self, depth_m, stamp_ns):
        raise RuntimeError("a defect")

    monkeypatch.setattr(known, "push", broken)
    with pytest.raises(RuntimeError):
        run(fakes.FakeRecording(), tmp_path / "out", rrd=tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == []


def test_run_of_a_recording_that_breaks_off_does_not_cover_the_rest(tmp_path):
    result = run(fakes.FakeRecording(40, ends=30), tmp_path / "out", pictures=False)
    assert result.coverage == 0.75
    assert not result.covered
    unreadable = result.report["outcomes"]["unreadable"]
    assert unreadable["frames"] == 10
    assert "ended before" in unreadable["reasons"][0]["first"]
