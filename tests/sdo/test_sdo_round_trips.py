"""Client and server together: any length, both ways."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.master.sdo_client import SdoDownload, SdoUpload
from torquerig.driver.wire.sdo import SdoAbort

objects = {"index": st.integers(0x1000, 0xFFFF), "subindex": st.integers(0, 0xFF)}
lengths = st.integers(0, 2000)
values = st.one_of(
    st.binary(max_size=30),
    st.builds(lambda n, seed: bytes((seed + i) % 256 for i in range(n)), lengths, st.integers(0, 255)),
)


class OneObject:
    def __init__(self, where, value=b""):
        self.where, self.value = where, value

    def read(self, index, subindex):
        assert (index, subindex) == self.where
        return self.value

    def write(self, index, subindex, data):
        assert (index, subindex) == self.where
        self.value = data


def play(transfer, server):
    request, requests = transfer.request, 0
    while request is not None:
        request = transfer.step(server.handle(request))
        requests += 1
    return requests


@given(value=values, **objects)
def test_what_is_written_is_what_arrives(index, subindex, value):
    access = OneObject((index, subindex))
    download = SdoDownload(index, subindex, value)
    requests = play(download, SdoServer(access))
    assert download.done
    assert access.value == value
    assert requests == (1 if 1 <= len(value) <= 4 else 1 + max(1, -(-len(value) // 7)))


@given(value=values, **objects)
def test_what_is_read_is_what_is_there(index, subindex, value):
    upload = SdoUpload(index, subindex)
    requests = play(upload, SdoServer(OneObject((index, subindex), value)))
    assert upload.done
    assert upload.result == value
    assert upload.ignored == 0
    assert requests == (1 if 1 <= len(value) <= 4 else 1 + max(1, -(-len(value) // 7)))


@pytest.mark.parametrize("length", [*range(30), 2000])
def test_every_short_length_and_the_longest_go_both_ways(length):
    value = bytes(i % 251 for i in range(length))
    access = OneObject((0x2000, 1))
    server = SdoServer(access)
    play(SdoDownload(0x2000, 1, value), server)
    upload = SdoUpload(0x2000, 1)
    play(upload, server)
    assert access.value == upload.result == value


@given(st.integers(0, 40), st.binary(min_size=20, max_size=60))
def test_after_a_transfer_broken_off_anywhere_the_next_one_works(steps, value):
    access = OneObject((0x2000, 1), value)
    server = SdoServer(access)
    broken = SdoUpload(0x2000, 1)
    request = broken.request
    for _ in range(steps):
        if request is None:
            break
        request = broken.step(server.handle(request))
    assert server.handle(broken.abort()) is None
    upload = SdoUpload(0x2000, 1)
    play(upload, server)
    assert upload.result == value


def test_a_download_beyond_the_servers_bound_raises_at_the_client():
    with pytest.raises(SdoAbort, match="out of memory"):
        play(SdoDownload(0x2000, 1, bytes(101)), SdoServer(OneObject((0x2000, 1)), max_bytes=100))
