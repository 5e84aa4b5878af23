"""Depth cameras of today through their makers' Python packages: frames in metres with stamps."""

from sphereflow.sensors.azure_kinect import AzureKinect
from sphereflow.sensors.realsense import RealSense
from sphereflow.sensors.samples import CameraSample, ImuReading

__all__ = ["AzureKinect", "CameraSample", "ImuReading", "RealSense"]
