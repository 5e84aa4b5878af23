"""`sphereflow depth` on loose images that have no times: laid out as a TUM folder first."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import sphereflow as sf
from sphereflow.cli import app
from typer.testing import CliRunner

CAMERA = """model = "pinhole"
width = 640
height = 480
depth_scale = {scale}

[parameters]
fx = {fx}
fy = {fy}
cx = {cx}
cy = {cy}
"""


def lay_out(
    folder: Path, colours: list[Path], depths: list[Path], poses: list[str], **camera: float
) -> Path:
    """A TUM folder whose images are a thirtieth of a second apart: files are copied and listed."""
    folder.mkdir()
    for name, files in (("rgb", colours), ("depth", depths)):
        (folder / name).mkdir()
        rows = []
        for index, file in enumerate(files):
            shutil.copy(file, folder / name / file.name)
            rows.append(f"{index / 30:.6f} {name}/{file.name}\n")
        (folder / f"{name}.txt").write_text("".join(rows))
    timed = [f"{index / 30:.6f} {pose.strip()}\n" for index, pose in enumerate(poses)]
    (folder / "groundtruth.txt").write_text("".join(timed))
    (folder / "calibration.toml").write_text(CAMERA.format(**camera))
    return folder


def depth(data: Path, out: Path) -> tuple[int, str]:
    """Exit status, and what was said of errors in one line."""
    arguments = ["depth", str(data), "--poses", str(data / "groundtruth.txt"), "--out", str(out)]
    done = CliRunner().invoke(app, arguments)
    print(done.output)
    return done.exit_code, re.sub(r"\s+", " ", done.stderr)


def test_depth_of_a_pair_two_centimetres_apart_claims_only_what_it_knows(
    recordings: Path, tmp_path: Path
) -> None:
    case = recordings / "rgbd-pairs" / "tum-fr1-xyz-pairs" / "case_1"
    order = ("prev", "curr")
    data = lay_out(
        tmp_path / "pair",
        [case / f"img_{name}.png" for name in order],
        [case / f"dep_{name}.png" for name in order],
        [(case / f"pose_{name}.txt").read_text() for name in order],
        scale=5000,
        fx=525,
        fy=525,
        cx=319.5,
        cy=239.5,
    )
    code, _ = depth(data, tmp_path / "out")
    assert code == 0
    for frame in sf.io.open_recording(data).frames(0, 2):
        assert frame.depth_m is not None
        error = np.nanmedian(np.abs(1 / frame.depth_m - 1))
        print(f"a metre of depth everywhere, the start: median error {100 * error:.1f} %")
    report: dict[str, Any] = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["statuses"] == {"started": 1, "updated": 1}
    # One baseline of two centimetres: nothing is claimed better than a fifth, and none is written.
    assert report["error"] is None
    for claim in report["by_std"]:
        assert claim["std_percent"][0] >= 20
        assert claim["normalised"] < 1.5


def test_depth_of_five_views_half_a_metre_apart_is_refused(
    recordings: Path, tmp_path: Path
) -> None:
    case = recordings / "rgbd-pairs" / "slambook-joinmap"
    data = lay_out(
        tmp_path / "views",
        [case / "color" / f"{index}.png" for index in range(1, 6)],
        [case / "depth" / f"{index}.pgm" for index in range(1, 6)],
        (case / "pose.txt").read_text().strip().splitlines(),
        scale=1000,
        fx=518,
        fy=519,
        cx=325.5,
        cy=253.5,
    )
    code, said = depth(data, tmp_path / "out")
    assert code == 1
    assert "expected a video" in said
    assert "give the images in between" in said
    assert not (tmp_path / "out").exists()


def test_depth_of_loose_images_says_what_to_do(recordings: Path, tmp_path: Path) -> None:
    case = recordings / "rgbd-pairs" / "slambook-joinmap"
    poses = case / "pose.txt"
    out = tmp_path / "out"
    arguments = ["depth", str(case), "--poses", str(poses), "--out", str(out)]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code != 0
    said = re.sub(r"\s+", " ", done.stderr)
    assert "7 columns" in said
    assert "rgb.txt" in said
    assert not out.exists()
