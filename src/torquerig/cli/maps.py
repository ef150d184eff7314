"""`torquerig maps`: what redundancy gives, over the workspace."""

from pathlib import Path

import click

from torquerig.cli.options import config_option, configure
from torquerig.cli.places import check_folder


@click.command("maps")
@config_option
@click.option(
    "--out",
    "folder",
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("maps"),
    show_default=True,
    help="The folder for the pictures; made if need be.",
)
def command(config_file: Path | None, folder: Path) -> None:
    """Draw stiffness, force transmission and singularities over the workspace.

    For the machine of the configuration's [model], driven by three legs and by any two: stiffness.png (thesis, Figure
    2.2), transmission.png (Figure 2.3) and singularities.png.
    """
    from torquerig.building import manipulator  # noqa: PLC0415  (after the options: a wrong one is told at once)
    from torquerig.maps import singularity_figure, stiffness_figure, transmission_figure  # noqa: PLC0415
    from torquerig.picture import save  # noqa: PLC0415

    check_folder(folder)
    _make(folder)
    geometry = configure(config_file).rig.model
    model = manipulator(geometry, geometry)
    pictures = (("stiffness", stiffness_figure), ("transmission", transmission_figure))
    for name, draw in (*pictures, ("singularities", singularity_figure)):
        path = folder / f"{name}.png"
        save(draw(model), path)
        click.echo(path)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:  # a disk that is full, a file system that takes no folders
        raise click.BadParameter(f"{folder} cannot be made: {error.strerror}", param_hint="--out") from error
