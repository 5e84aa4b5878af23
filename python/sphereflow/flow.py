"""Optical flow between two images, and denoising: the variational methods of section 2.1."""

from sphereflow._native import horn_schunck, rof_denoise, tv_l1

__all__ = ["horn_schunck", "rof_denoise", "tv_l1"]
