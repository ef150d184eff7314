"""Simulated drives, motors, encoders, plant and wire: all advance by a given time, none reads a clock."""

if __name__ == "device_sim":
    raise ImportError("import torquerig.device_sim: this folder is part of torquerig, not a package of its own")
