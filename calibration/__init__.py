"""Torque scale, homing and identification: a pure fit and a scripted procedure each. None yet."""

if __name__ == "calibration":
    raise ImportError("import torquerig.calibration: this folder is part of torquerig, not a package of its own")
