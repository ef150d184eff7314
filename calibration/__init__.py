"""calibration."""

if __name__ == "calibration":
    raise ImportError("import torquerig.calibration: this folder is part of torquerig, not a package of its own")
