"""In which order the drives hear their commands."""

from torquerig.schema import Rig


def places_on_the_wire(rig: Rig) -> tuple[int, ...]:
    """How many RPDOs of other drives go before that of each axis: the lowest identifier first (CAN arbitration).

    Args:
        rig: The configuration, of a loop without a group RPDO.

    Returns:
        A place for each axis, from 0.
    """
    nodes = [axis.node_id for axis in rig.axes.legs]
    return tuple(sorted(nodes).index(node) for node in nodes)
