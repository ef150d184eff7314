"""Maps of what redundancy gives: the pictures, and the command that writes them."""

from dataclasses import replace

import numpy as np
import pytest

from torquerig.cli.app import main
from torquerig.maps import grid, singularity_figure, stiffness_figure, transmission_figure, workspace
from torquerig.mechanism import Manipulator

THESIS = Manipulator.thesis()


def labels(figure):
    return {text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text}


def titles(figure):
    return [title for axes in figure.axes if (title := axes.get_title(loc="left"))]


@pytest.mark.parametrize("draw", [stiffness_figure, transmission_figure, singularity_figure])
def test_every_map_names_its_axes_with_units(draw):
    figure = draw(THESIS)
    assert {"x [mm]", "y [mm]"} <= labels(figure)
    assert figure.get_suptitle()
    panels = [axes for axes in figure.axes if axes.get_xlabel() == "x [mm]"]
    assert len(panels) == len(titles(figure))


def test_the_transmission_map_shows_three_actuators_and_every_pair_with_their_means():
    assert titles(transmission_figure(THESIS)) == [
        "Three actuators: mean 0.58",
        "Legs 1 and 2 alone: mean 0.40",
        "Legs 1 and 3 alone: mean 0.30",
        "Legs 2 and 3 alone: mean 0.72",
    ]


def test_the_singularity_map_tells_where_there_are_none():
    legend = singularity_figure(THESIS).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == [
        "a leg stretched",
        "Legs 1 and 2 alone",
        "Legs 1 and 3 alone",
        "Legs 2 and 3 alone: nowhere",
        "Three actuators: nowhere",
    ]
    other = singularity_figure(replace(THESIS, branches=(1, -1, 1))).axes[0].get_legend()
    assert other.get_texts()[-1].get_text() == "Three actuators"


def test_the_workspace_reaches_the_corners_of_the_thesis_figure():
    (left, right), (low, high) = workspace(THESIS)
    corners = np.array([(0.059, 0.062), (0.125, -0.002), (0.125, 0.127)])  # Figure 6.1, printed in cm to one decimal
    assert (corners >= (left, low)).all()
    assert (corners <= (right, high)).all()
    points = grid((left, right), (low, high), 401).reshape(-1, 2)
    reached = points[[THESIS.singularity_distance(point) >= 0.0 for point in points]]
    assert reached.min(axis=0) == pytest.approx((0.059, -0.002), abs=1.0e-3)
    assert reached.max(axis=0) == pytest.approx((0.140, 0.127), abs=1.0e-3)


def test_a_machine_of_another_size_is_drawn_over_its_own_workspace():
    twice = replace(THESIS, bases=tuple((2 * x, 2 * y) for x, y in THESIS.bases), link_length=0.14)
    axes = transmission_figure(twice).axes[0]
    assert axes.get_xlim() == pytest.approx((88, 280), abs=0.5)
    assert [text.get_text() for text in axes.texts] == ["home"]
    assert titles(stiffness_figure(twice))[0] == "Three actuators"


def test_a_machine_whose_legs_reach_no_common_place_is_refused(tmp_path, capsys):
    (tmp_path / "short.toml").write_text("[model]\nlink_length = 0.04\nhome = [0.092, 0.062]\n")
    assert main(["maps", "--config", str(tmp_path / "short.toml"), "--out", str(tmp_path)]) == 4
    assert capsys.readouterr().err.startswith("torquerig: no place is in reach of all three legs")


def test_the_command_writes_the_pictures(tmp_path, capsys):
    assert main(["maps", "--out", str(tmp_path / "new" / "maps")]) == 0
    files = sorted(path.name for path in (tmp_path / "new" / "maps").iterdir())
    assert files == ["singularities.png", "stiffness.png", "transmission.png"]
    assert capsys.readouterr().out.count(".png") == 3


def test_a_folder_that_cannot_be_made_is_told_in_one_sentence(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["maps", "--out", str(tmp_path / "file" / "maps")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("torquerig: ")
    assert "maps" in error
    assert error.count("\n") == 1


def test_a_folder_that_the_file_system_refuses_is_told_in_one_sentence(capsys):
    assert main(["maps", "--out", "/proc/maps-of-mine"]) == 2
    assert "/proc/maps-of-mine cannot be made: No such file or directory" in capsys.readouterr().err
