"""Compiled loops of the fits, in a folder of their own: their cache goes stale with it, not with every procedure."""

from torquerig.calibration.kernels.equation import equation, least_torques

__all__ = ["equation", "least_torques"]
