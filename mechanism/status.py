"""From a kernel's status to the error that says why."""

from math import hypot

from torquerig.mechanism import kernels
from torquerig.mechanism.errors import ReachError, SingularPoseError
from torquerig.mechanism.parameters import Point
from torquerig.mechanism.values import Array


def require_ok(status: int, position: Array, bases: tuple[Point, ...], link_length: float) -> None:
    """Raises what a kernel's status other than OK means.

    Args:
        status: The kernel's.
        position: Where it was asked, shape (2,) [m].
        bases: The machine's base joints [m].
        link_length: Of every link [m].

    Raises:
        ReachError: A leg is too short; the message names leg, distance and reach.
        SingularPoseError: A leg is stretched or folded, or the machine is singular as a whole.
    """
    if status == kernels.OK:
        return
    if status == kernels.SINGULAR:
        raise SingularPoseError("the elbows do not determine the position: a direct singularity")
    x, y = position.tolist()
    leg = status - (kernels.OUT_OF_REACH if status < kernels.SINGULAR_LEG else kernels.SINGULAR_LEG)
    r = hypot(x - bases[leg][0], y - bases[leg][1])
    where = f"position ({x:g}, {y:g}) m: leg {leg + 1}, at distance {r:.6g} m with reach {2 * link_length:g} m,"
    if status < kernels.SINGULAR_LEG:
        raise ReachError(f"{where} cannot get there")
    raise SingularPoseError(f"{where} is stretched or folded")
