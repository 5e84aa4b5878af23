"""Simulated rooms, cameras and inertial sensors with honest noise; a seed is a world."""

from sphereflow._native import SimulatedFrame, SimulatedFrames, Simulator

__all__ = ["SimulatedFrame", "SimulatedFrames", "Simulator", "demo"]


def demo(*, seed: int = 0) -> Simulator:
    """Once around the table of a furnished room and back, seen by a Kinect.

    Parameters
    ----------
    seed
        Decides the furniture, the walk and all noise.

    Returns
    -------
    Simulator
        25 s at 30 Hz, 640x480, with Kinect noise, image noise and an inertial sensor.
    """
    return Simulator(seed=seed)
