"""Figures of procedures: one style, drawn without a window."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from torquerig.picture import COLOURS, DESIRED, INK, STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COLOURS", "DESIRED", "INK", "SIZE", "drawn"]

SIZE: Final = (11.0, 6.0)


@contextmanager
def drawn(path: Path, title: str, size: tuple[float, float] = SIZE) -> Iterator["Figure"]:
    """A figure that is saved at the end.

    Args:
        path: The PNG file.
        title: What it is a figure of.
        size: Width and height [inch].

    Yields:
        The figure, empty but for its title.

    Raises:
        OSError: If the file cannot be written.
    """
    import matplotlib as mpl  # noqa: PLC0415  (takes half a second, and most commands draw nothing)
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size, dpi=150, layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, x=0.01, ha="left", fontsize=14, fontweight="bold", color=INK)
        yield figure
        figure.savefig(path)
