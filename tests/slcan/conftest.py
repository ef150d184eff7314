"""A bus behind an adapter at a pseudo-terminal."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from torquerig.driver.bus.slcan import SlcanBus

sys.path.insert(0, str(Path(__file__).parent))  # for adapter_host


@pytest.fixture
def link(tmp_path: Path) -> Path:
    return tmp_path / "ttyRIG"


@pytest.fixture
def bus(link: Path) -> Iterator[SlcanBus]:
    bus = SlcanBus(link, bitrate=1_000_000)
    yield bus
    bus.close()
