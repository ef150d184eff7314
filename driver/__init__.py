"""The wire and the drives: buses, CANopen, CiA 402, axes and groups of axes. Raw counts never leave it."""

if __name__ == "driver":
    raise ImportError("import torquerig.driver: this folder is part of torquerig, not a package of its own")

from torquerig.driver.bus.url import open_bus
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.profile import DriveProfile, load_profile
from torquerig.driver.master.samples import AxisSample, RawSample
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.scan import ScannedNode, scan
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.master.stop import reset, stop

__all__ = [
    "AxisGroup",
    "AxisSample",
    "AxisSettings",
    "DriveProfile",
    "GroupSettings",
    "RawSample",
    "ScannedNode",
    "load_profile",
    "open_bus",
    "reset",
    "scan",
    "stop",
]
