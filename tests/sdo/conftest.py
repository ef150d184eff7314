"""Shared by the SDO tests: an object dictionary of plain bytes."""

import pytest

from torquerig.driver.wire.sdo import AbortCode, SdoAbort


class Shelf:
    """Objects as bytes; what is absent, read-only or write-only is refused as a node does."""

    def __init__(self):
        self.objects = {}
        self.read_only = set()
        self.write_only = set()
        self.written = []

    def read(self, index, subindex):
        if (index, subindex) not in self.objects:
            raise SdoAbort(AbortCode.NO_OBJECT)
        if (index, subindex) in self.write_only:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        return self.objects[index, subindex]

    def write(self, index, subindex, data):
        if (index, subindex) not in self.objects:
            raise SdoAbort(AbortCode.NO_OBJECT)
        if (index, subindex) in self.read_only:
            raise SdoAbort(AbortCode.READ_ONLY)
        self.written.append(data)
        self.objects[index, subindex] = data


@pytest.fixture
def shelf():
    return Shelf()
