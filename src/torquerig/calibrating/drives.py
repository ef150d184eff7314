"""What procedures are told of the drives: what they are believed to be fitted with."""

from torquerig.calibration.installation import Gearing
from torquerig.schema import Rig


def gearing(rig: Rig) -> Gearing:
    """What the drives are believed to be fitted with."""
    first, second, third = rig.axes.legs
    return Gearing(
        (first.gear, second.gear, third.gear), (first.encoder_counts, second.encoder_counts, third.encoder_counts)
    )
