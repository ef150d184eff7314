"""Which drive hears its command first."""

from pathlib import Path

import pytest

from torquerig.configuration import load_configuration
from torquerig.delays import places_on_the_wire
from torquerig.driver.master.profile import PROFILES


def places(keys):
    return places_on_the_wire(load_configuration(options=keys).rig)


@pytest.mark.parametrize(
    ("nodes", "expected"), [((1, 2, 3), (0, 1, 2)), ((3, 2, 1), (2, 1, 0)), ((7, 2, 5), (2, 0, 1))]
)
def test_the_lowest_identifier_goes_first(nodes, expected):
    assert places({f"axes.{leg}.node_id": node for leg, node in enumerate(nodes, 1)}) == expected


def test_another_rpdo_has_another_identifier(tmp_path: Path):
    text = (PROFILES / "torquerig.toml").read_text()
    assert "[rpdo]\nnumber = 1\n" in text
    (tmp_path / "second.toml").write_text(text.replace("[rpdo]\nnumber = 1\n", "[rpdo]\nnumber = 2\n"))
    assert places({"axes.1.profile": str(tmp_path / "second.toml")}) == (2, 0, 1)


def test_on_buses_of_their_own_nobody_waits():
    keys = {"bus.url": "unix:/a", "axes.2.bus": "unix:/b", "axes.3.bus": "unix:/b"}
    assert places(keys) == (0, 0, 1)
