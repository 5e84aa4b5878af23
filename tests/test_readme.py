"""What the README shows works as it stands."""

import re
from pathlib import Path

import sphereflow as sf
from sphereflow.cli import app
from typer.testing import CliRunner

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_readme_python_runs(capsys) -> None:
    room = sf.sim.Simulator(duration_s=0.2, imu=False)
    frames = [(frame.stamp_ns, frame.depth_m) for frame in room.frames()]
    blocks = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert blocks
    for block in blocks:
        exec(block, {"my_frames": frames})
    assert "tracked" in capsys.readouterr().out


def test_readme_verbs_exist_with_their_options() -> None:
    for verb, rest in re.findall(r"^\$ sphereflow (\w+) ?([^\n#]*)", README, flags=re.MULTILINE):
        # A group's options are those of the verb that follows it.
        words = [verb, rest.split()[0]] if verb == "calib" else [verb]
        helped = CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": "200"})
        assert helped.exit_code == 0, words
        for option in re.findall(r"--[\w-]+", rest):
            assert option in helped.output, f"{words} has no {option}"


def test_readme_links_lead_somewhere() -> None:
    for page in ROOT.glob("*.md"):
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
            if "://" not in target:
                assert (ROOT / target).exists(), f"{page.name} links to {target}"
