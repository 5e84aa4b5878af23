"""The experiments that need no recording run at their small size and leave pictures and curves."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benches/experiments"
SMALL = {
    "figure_2_1": ["figure_2_1"],
    "theorem_4": ["theorem_4"],
    "propositions_9_10": ["propositions_9_10"],
    "kalman_counterparts": ["kalman_counterparts"],
    "position_gains": ["position_gains"],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_experiment_draws_its_pictures_with_their_curves(name, tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(str(FOLDER))
    sys.modules.pop(name, None)
    importlib.import_module(name).main(tmp_path)
    assert capsys.readouterr().out
    for picture in SMALL[name]:
        assert (tmp_path / f"{picture}.png").stat().st_size > 10_000
        if name != "figure_2_1":  # isolines alone
            rows = (tmp_path / "curves" / f"{picture}.csv").read_text().splitlines()
            assert rows[0] == "axes,curve,x,y"
            assert len(rows) > 10


def test_every_experiment_that_is_run_by_name_exists(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    names = importlib.import_module("run_all")
    for name in (*names.EXPERIMENTS, *names.ON_REQUEST):
        assert (FOLDER / f"{name}.py").is_file()
