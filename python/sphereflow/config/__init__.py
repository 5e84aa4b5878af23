"""Settings as frozen dataclasses, to and from TOML.

    config = sf.config.OdometryConfig(readout_s=0.03)
    odometry = sf.odometry.DepthOdometry(camera, config=config)
    print(config.to_toml(comments=True))

An unknown key, a wrong type or a value out of its range raises ``ValueRangeError`` with the dotted
key. Defaults are those of the compiled module: a test holds them equal.
"""

from sphereflow.config.alignment import AlignmentConfig, CovarianceConfig, NoiseConfig
from sphereflow.config.attitude import AttitudeConfig
from sphereflow.config.base import Config
from sphereflow.config.baselines import RangeFlowConfig, ThesisConfig
from sphereflow.config.depth import (
    DepthFilterConfig,
    DepthObserverConfig,
    FlowObserverConfig,
    SobolevConfig,
    TvDepthConfig,
)
from sphereflow.config.engine import CloudConfig, EngineConfig, MapConfig
from sphereflow.config.flow import HornSchunckConfig, RofConfig, TvL1Config
from sphereflow.config.imu_bias import ImuBiasConfig, ImuBiasGains
from sphereflow.config.navigation import NavigationConfig
from sphereflow.config.odometry import GraphConfig, KeyframeConfig, OdometryConfig
from sphereflow.config.self_calibration import SelfCalibrationConfig
from sphereflow.config.velocity_bias import VelocityBiasConfig, VelocityBiasGains

__all__ = [
    "CONFIGS",
    "AlignmentConfig",
    "AttitudeConfig",
    "CloudConfig",
    "Config",
    "CovarianceConfig",
    "DepthFilterConfig",
    "DepthObserverConfig",
    "EngineConfig",
    "FlowObserverConfig",
    "GraphConfig",
    "HornSchunckConfig",
    "ImuBiasConfig",
    "ImuBiasGains",
    "KeyframeConfig",
    "MapConfig",
    "NavigationConfig",
    "NoiseConfig",
    "OdometryConfig",
    "RangeFlowConfig",
    "RofConfig",
    "SelfCalibrationConfig",
    "SobolevConfig",
    "ThesisConfig",
    "TvDepthConfig",
    "TvL1Config",
    "VelocityBiasConfig",
    "VelocityBiasGains",
]

CONFIGS: dict[str, type[Config]] = {
    "engine": EngineConfig,
    "odometry": OdometryConfig,
    "alignment": AlignmentConfig,
    "keyframes": KeyframeConfig,
    "graph": GraphConfig,
    "map": MapConfig,
    "cloud": CloudConfig,
    "self-calibration": SelfCalibrationConfig,
    "depth-filter": DepthFilterConfig,
    "flow-observer": FlowObserverConfig,
    "depth-observer": DepthObserverConfig,
    "sobolev-depth": SobolevConfig,
    "tv-l1-depth": TvDepthConfig,
    "tv-l1": TvL1Config,
    "horn-schunck": HornSchunckConfig,
    "rof": RofConfig,
    "range-flow": RangeFlowConfig,
    "thesis": ThesisConfig,
    "attitude": AttitudeConfig,
    "imu-bias": ImuBiasConfig,
    "velocity-bias": VelocityBiasConfig,
    "navigation": NavigationConfig,
}
"""The configs that stand by themselves, under the names of ``sphereflow config``."""
