"""Settings: defaults of the compiled module, TOML round trips, errors with the dotted key."""

from __future__ import annotations

import dataclasses
import math
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
import sphereflow as sf
from hypothesis import given, settings
from hypothesis import strategies as st
from sphereflow import _native, config
from sphereflow.cli import app
from sphereflow.config.toml import meanings_of
from typer.testing import CliRunner

CLASSES = [getattr(config, name) for name in config.__all__ if name not in ("CONFIGS", "Config")]
CAMERA = sf.Camera.pinhole(60.0, 60.0, 39.5, 29.5, 80, 60)
each_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)


@each_class
def test_config_defaults_are_those_of_the_compiled_module(kind: type[config.Config]) -> None:
    assert kind().as_dict() == _native._default_config(kind.__name__)


@each_class
def test_config_default_survives_toml_dict_and_pickle(kind: type[config.Config]) -> None:
    for comments in (False, True):
        assert kind.from_toml(kind().to_toml(comments=comments)) == kind()
    assert kind.from_dict(kind().as_dict()) == kind()
    assert pickle.loads(pickle.dumps(kind())) == kind()


@each_class
def test_config_every_setting_is_documented(kind: type[config.Config]) -> None:
    assert list(meanings_of(kind)) == [field.name for field in dataclasses.fields(kind)]


@each_class
def test_config_optional_settings_are_none_by_default(kind: type[config.Config]) -> None:
    """TOML has no None: what is left out must mean it."""
    for name, hint in get_type_hints(kind).items():
        if type(None) in get_args(hint):
            assert getattr(kind(), name) is None, name


@settings(max_examples=20, deadline=None)  # no deadline: the first call imports
@each_class
@given(st.data())
def test_config_with_other_values_survives_toml(kind: type[config.Config], data: Any) -> None:
    changed = _changed(kind, data)
    again = kind.from_toml(changed.to_toml(comments=data.draw(st.booleans())))
    assert again == changed


def _changed(kind: type[config.Config], data: Any) -> config.Config:
    """Other words, flags, and numbers a little smaller than the default: they stay in range."""
    values: dict[str, Any] = {}
    for name, hint in get_type_hints(kind).items():
        if name.startswith("_"):
            continue
        value = getattr(kind(), name)
        if isinstance(value, config.Config):
            values[name] = _changed(type(value), data)
        elif isinstance(value, float) and math.isfinite(value):
            values[name] = value * data.draw(st.floats(0.7, 1.0))
        elif isinstance(value, bool) and not isinstance(kind(), config.SelfCalibrationConfig):
            values[name] = data.draw(st.booleans())
        elif get_origin(hint) is not None and isinstance(value, str):
            values[name] = data.draw(st.sampled_from(get_args(hint)))
    return kind(**values)


@pytest.mark.parametrize(
    ("kind", "text", "words"),
    [
        ("engine", "[odometry.alignment]\nblocks = 2", "odometry.alignment.blocks: expected"),
        ("engine", "[odometry.alignment]\nblock = 0", "odometry.alignment.block: expected 1 to 32"),
        ("engine", "[odometry.alignment]\nblock = 2.5", "alignment.block: expected an integer"),
        ("engine", "[odometry.alignment]\nblock = true", "alignment.block: expected an integer"),
        (
            "engine",
            "[odometry.keyframes]\nenabled = 1",
            "keyframes.enabled: expected true or false",
        ),
        ("engine", "[odometry.alignment.noise]\nshare = -1.0", "odometry.alignment.noise.share:"),
        ("engine", "[odometry.alignment.covariance]\nscale = 0", "alignment.covariance.scale:"),
        ("engine", "odometry = 3", "odometry: expected a table"),
        ("engine", "world = 'up'", "world: expected 'auto' or 'first-camera', found 'up'"),
        ("engine", "[map.cloud]\nvoxel_m = nan", "map.cloud.voxel_m: expected"),
        ("engine", "[graph]\nmin_overlap = 2.0", "graph.min_overlap: expected"),
        ("odometry", "readout_s = 5.0", "readout_s: expected"),
        ("depth-filter", "lags = [3, 1]", "lags: expected"),
        ("depth-filter", "lags = [1, 'x']", r"lags\[1\]: expected an integer"),
        ("navigation", "gravity_m_s2 = [0.0, 9.81]", "gravity_m_s2: expected 3 values, found 2"),
        ("navigation", "body_from_camera = [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", "body_from"),
        ("imu-bias", "[gains]\nk_v = -1", "gains.k_v: expected"),
        ("velocity-bias", "[gains]\nk_v = -1", "gains.k_v: expected"),
        ("tv-l1", "median_radius = 5", "median_radius: expected"),
        ("rof", "tau = 1.0", "tau: expected"),
        ("horn-schunck", "alpha = 0.0", "alpha: expected"),
        ("tv-l1-depth", "weight = 0.0", "expected"),
        ("sobolev-depth", "tolerance = 0.0", "tolerance: expected"),
        ("flow-observer", "gain = 0.0", "gain: expected"),
        ("range-flow", "levels = [4, 8]", "levels: expected"),
        ("thesis", "domains = 2", "domains: expected"),
        ("attitude", "tau_mag_s = 0.0", "tau_mag_s: expected"),
        ("self-calibration", "min_gap = 0", "min_gap: expected"),
    ],
)
def test_config_wrong_setting_names_the_dotted_key(kind: str, text: str, words: str) -> None:
    with pytest.raises(sf.ValueRangeError, match=words):
        config.CONFIGS[kind].from_toml(text)


def test_config_text_that_is_no_toml_names_the_line(tmp_path: Path) -> None:
    with pytest.raises(sf.DataError, match="line 2"):
        config.EngineConfig.from_toml("a = 1\nb = ]\n")
    with pytest.raises(sf.MissingFileError, match="none"):
        config.EngineConfig.from_toml(tmp_path / "none.toml")


def test_config_file_round_trip_and_its_path_in_errors(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    changed = config.EngineConfig(map=config.MapConfig(every=7))
    changed.write(path)
    assert config.EngineConfig.from_toml(path) == changed
    path.write_text("every = 3\n")
    with pytest.raises(sf.ValueRangeError, match=r"settings\.toml: every"):
        config.EngineConfig.from_toml(path)


def test_config_numbers_and_arrays_are_made_its_own() -> None:
    made = config.DepthFilterConfig(lags=np.array([1, 4]), initial_range_m=2)  # type: ignore[arg-type]
    assert (made.lags, made.initial_range_m) == ((1, 4), 2.0)
    assert isinstance(made.initial_range_m, float)
    hash(made)
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.binning = 3  # type: ignore[misc]


def test_odometry_of_a_config_and_of_keywords_is_the_same() -> None:
    depth = [np.full((60, 80), 2.0, np.float32) + np.float32(0.01 * i) for i in range(3)]

    def poses(odometry: sf.odometry.DepthOdometry) -> np.ndarray:
        return np.array(
            [odometry.push(d, i * 10**8).world_from_camera for i, d in enumerate(depth)]
        )

    alignment = config.AlignmentConfig(block=4, levels=1, domains=100, max_std_m=0.5)
    whole = config.OdometryConfig(
        alignment=alignment, keyframes=config.KeyframeConfig(enabled=False)
    )
    by_config = sf.odometry.DepthOdometry(CAMERA, config=whole)
    keywords = {"domains": 100, "max_std_m": 0.5, "keyframes": False}
    by_keywords = sf.odometry.DepthOdometry(CAMERA, method="single", **keywords)
    np.testing.assert_array_equal(poses(by_config), poses(by_keywords))


def test_config_of_another_class_is_refused_by_name() -> None:
    with pytest.raises(
        sf.DtypeError, match=r"sphereflow\.config\.OdometryConfig, found GraphConfig"
    ):
        sf.odometry.DepthOdometry(CAMERA, config=config.GraphConfig())  # type: ignore[arg-type]


def test_every_class_with_settings_takes_a_config() -> None:
    image = np.arange(4800, dtype=np.float32).reshape(60, 80) % 97
    motion: dict[str, Any] = {"v_m_s": [0.1, 0, 0], "omega_rad_s": [0, 0, 0], "dt_s": 0.1}
    sf.odometry.RangeFlow(CAMERA, config=config.RangeFlowConfig(levels=(8, 4)))
    sf.odometry.SelfCalibrator(CAMERA, config=config.SelfCalibrationConfig(max_pairs=20))
    sf.depth.DepthFilter(CAMERA, config=config.DepthFilterConfig(memory=0.9))
    sf.depth.FlowObserver(CAMERA, config=config.FlowObserverConfig(farthest_m=5.0))
    sf.depth.DepthObserver(CAMERA, config=config.DepthObserverConfig())
    sf.depth.sobolev_depth(CAMERA, image, image, config=config.SobolevConfig(), **motion)
    sf.depth.tv_l1_depth(CAMERA, image, image, config=config.TvDepthConfig(iterations=5), **motion)
    sf.flow.horn_schunck(image, image, config=config.HornSchunckConfig(solver="sor"))
    sf.flow.tv_l1(image, image, config=config.TvL1Config(levels=1))
    sf.flow.rof_denoise(image, config=config.RofConfig(tau=0.2))
    sf.attitude.AttitudeFilter(config=config.AttitudeConfig(world="rdf"))
    sf.observers.ImuBiasEstimator(config=config.ImuBiasConfig(gate=20.0))
    sf.observers.VelocityBiasEstimator(CAMERA, config=config.VelocityBiasConfig(max_width=80))
    sf.navigation.NavigationFilter(config=config.NavigationConfig(patience_s=2.0))
    depth = np.full((60, 80), 2.0, np.float32)
    thesis = config.ThesisConfig(domains=100)
    sf.odometry.estimate_velocity(CAMERA, depth, depth, 0.1, config=config.AlignmentConfig())
    sf.odometry.estimate_velocity(CAMERA, depth, depth, 0.1, config=thesis, method="thesis")


def test_cli_config_dump_is_what_check_accepts(tmp_path: Path) -> None:
    runner = CliRunner()
    for name in config.CONFIGS:
        dumped = runner.invoke(app, ["config", "dump", name])
        assert dumped.exit_code == 0, dumped.output
        path = tmp_path / f"{name}.toml"
        path.write_text(dumped.stdout)
        checked = runner.invoke(app, ["config", "check", str(path), "--as", name])
        assert checked.exit_code == 0, checked.output
        assert "every setting has its default" in checked.stdout


def test_cli_config_check_tells_what_differs_and_what_is_wrong(tmp_path: Path) -> None:
    runner, path = CliRunner(), tmp_path / "settings.toml"
    path.write_text("[map]\nevery = 5\n")
    found = runner.invoke(app, ["config", "check", str(path)])
    assert found.exit_code == 0
    assert "map.every" in found.stdout
    assert "5 (default 3)" in found.stdout
    path.write_text("[map]\nevry = 5\n")
    wrong = runner.invoke(app, ["config", "check", str(path)])
    assert wrong.exit_code == 2
    assert "map.evry" in wrong.stderr
    path.write_text("[map\n")
    assert runner.invoke(app, ["config", "check", str(path)]).exit_code == 1
    assert runner.invoke(app, ["config", "dump", "nonsense"]).exit_code == 2
    assert "Examples" in runner.invoke(app, ["config", "dump", "--help"]).stdout


def test_public_names_are_there_and_nothing_else_is_listed() -> None:
    assert dir(sf) == sorted(sf.__all__)
    assert {"run", "config", "calibration"} <= set(dir(sf))
    assert all(hasattr(sf, name) for name in dir(sf))
    assert not {"Any", "TYPE_CHECKING"} & set(vars(sf))
    assert sf.io.RecordingWriter is _native.RecordingWriter
    with pytest.raises(AttributeError, match="nonsense"):
        sf.nonsense  # noqa: B018


def test_import_of_the_package_leaves_the_rest_for_later() -> None:
    code = "import sphereflow, sys; print([m for m in sys.modules if 'sphereflow.' in m])"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert "sphereflow.config" not in loaded.stdout
    assert "sphereflow.pipeline" not in loaded.stdout
