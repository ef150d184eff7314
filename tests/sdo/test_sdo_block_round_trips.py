"""Client and server together in blocks: any length, any block sizes, and a line that loses segments."""

import random
from collections import deque

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.master.sdo_block_client import SdoBlockDownload, SdoBlockUpload
from torquerig.driver.master.sdo_client import SdoUpload
from torquerig.driver.wire.sdo import SdoAbort

BEFORE = b"before"
MAX_BYTES = 5000

values = st.builds(
    lambda length, seed: random.Random(seed).randbytes(length), st.integers(0, MAX_BYTES), st.integers(0, 2**32)
)
seeds = st.integers(0, 2**32)
losses = st.sampled_from([0.0, 0.0, 0.01, 0.1, 0.3])
block_sizes = st.integers(1, 127) | st.sampled_from([1, 2, 127])


class OneObject:
    def __init__(self, value=BEFORE):
        self.value = value

    def read(self, _index, _subindex):
        return self.value

    def write(self, _index, _subindex, data):
        self.value = data


class Line:
    """Carries frames both ways in order, and loses some: segments only, or any."""

    def __init__(self, transfer, server, *, chance=None, loss=0.0, any_frame=False, vary_sizes=False):
        self.transfer, self.server = transfer, server
        self.chance, self.loss = chance or random.Random(0), loss
        self.any_frame, self.vary_sizes = any_frame, vary_sizes
        self.to_server = deque([transfer.request])
        self.to_client = deque()
        self.lost = 0

    def loses(self, is_segment):
        lost = (is_segment or self.any_frame) and self.chance.random() < self.loss
        self.lost += lost
        return lost

    def step(self):
        """Moves one frame; False when the line is silent."""
        if self.vary_sizes:
            self.server.block_size = self.transfer.block_size = self.chance.randint(1, 127)
        if self.to_server:
            request = self.to_server.popleft()
            if not self.loses(self.server.receiving):
                self.queue(self.to_client, self.server.handle(request), self.server)
        elif self.to_client:
            response = self.to_client.popleft()
            if not self.loses(getattr(self.transfer, "receiving", False)):
                self.queue(self.to_server, self.transfer.step(response), self.transfer)
        else:
            return False
        return True

    @staticmethod
    def queue(line, first, side):
        if first is not None:
            line.extend([first, *side.pending])

    def run(self):
        """Carries on until the line stays silent, whoever receives asking for what is missing."""
        while True:
            while self.step():
                pass
            if self.server.receiving and (message := self.server.overdue()) is not None:
                self.to_client.append(message)
            elif getattr(self.transfer, "receiving", False) and (message := self.transfer.overdue()) is not None:
                self.to_server.append(message)
            else:
                return


@settings(deadline=None)
@given(value=values, seed=seeds, loss=losses, block_size=block_sizes, vary=st.booleans(), options=st.data())
def test_what_is_written_arrives_whatever_segments_are_lost(value, seed, loss, block_size, vary, options):
    crc, sized, server_crc = (options.draw(st.booleans()) for _ in range(3))
    loss = loss if (crc and server_crc) or sized else 0.0  # nobody asks again where a mistake would not show
    access = OneObject()
    server = SdoServer(access, max_bytes=MAX_BYTES, block_size=block_size, crc=server_crc)
    download = SdoBlockDownload(0x2000, 1, value, crc=crc, indicate_size=sized)
    line = Line(download, server, chance=random.Random(seed), loss=loss, vary_sizes=vary)
    line.run()
    assert download.done
    assert access.value == value
    assert download.ignored == 0


@settings(deadline=None)
@given(value=values, seed=seeds, loss=losses, block_size=block_sizes, vary=st.booleans(), options=st.data())
def test_what_is_read_is_what_is_there_whatever_segments_are_lost(value, seed, loss, block_size, vary, options):
    crc, server_crc = (options.draw(st.booleans()) for _ in range(2))
    server = SdoServer(OneObject(value), crc=server_crc)
    upload = SdoBlockUpload(0x2000, 1, crc=crc, block_size=block_size)
    line = Line(upload, server, chance=random.Random(seed), loss=loss, vary_sizes=vary)
    line.run()
    assert upload.done
    assert upload.result == value
    assert server.skipped == 0


@settings(deadline=None)
@given(value=values, seed=seeds, loss=st.sampled_from([0.01, 0.1]), block_size=block_sizes, upwards=st.booleans())
def test_a_line_that_loses_anything_breaks_transfers_and_never_data(value, seed, loss, block_size, upwards):
    access = OneObject(value if upwards else BEFORE)
    server = SdoServer(access, max_bytes=MAX_BYTES, block_size=block_size)
    transfer = SdoBlockUpload(0x2000, 1, block_size=block_size) if upwards else SdoBlockDownload(0x2000, 1, value)
    try:
        Line(transfer, server, chance=random.Random(seed), loss=loss, any_frame=True).run()
    except SdoAbort:
        assert not transfer.done
    if upwards:
        assert not transfer.done or transfer.result == value
    else:
        assert access.value in {BEFORE, value}
        assert not transfer.done or access.value == value


@pytest.mark.parametrize("length", [*range(30), 127 * 7 - 1, 127 * 7, 127 * 7 + 1, 2000, MAX_BYTES])
def test_every_short_length_and_the_edges_of_blocks_go_both_ways(length):
    value = bytes(i % 251 for i in range(length))
    access = OneObject()
    server = SdoServer(access, max_bytes=MAX_BYTES)
    Line(SdoBlockDownload(0x2000, 1, value), server).run()
    upload = SdoBlockUpload(0x2000, 1)
    Line(upload, server).run()
    assert access.value == upload.result == value


@given(length=st.integers(0, 300), threshold=st.integers(0, 255))
def test_a_server_that_may_switch_does_so_up_to_the_threshold(length, threshold):
    value = bytes(i % 251 for i in range(length))
    server = SdoServer(OneObject(value))
    switches = server.handle(SdoBlockUpload(0x2000, 1, switch_threshold=threshold).request)[0] >> 5 == 2
    assert switches == (threshold > 0 and length <= threshold)
    upload = SdoBlockUpload(0x2000, 1, switch_threshold=threshold)
    Line(upload, server).run()
    assert upload.done
    assert upload.result == value


@given(frames=st.integers(0, 60), value=st.binary(min_size=100, max_size=200), upwards=st.booleans())
def test_after_a_transfer_broken_off_anywhere_the_next_one_works(frames, value, upwards):
    server = SdoServer(OneObject(value), block_size=10)
    transfer = SdoBlockUpload(0x2000, 1, block_size=10) if upwards else SdoBlockDownload(0x2000, 1, value)
    line = Line(transfer, server)
    for _ in range(frames):
        line.step()
    assert server.handle(transfer.abort()) is None
    upload = SdoUpload(0x2000, 1)
    Line(upload, server).run()
    assert upload.result == value


def test_a_block_download_beyond_the_servers_bound_raises_at_the_client():
    with pytest.raises(SdoAbort, match="out of memory"):
        Line(SdoBlockDownload(0x2000, 1, bytes(101)), SdoServer(OneObject(), max_bytes=100)).run()
    with pytest.raises(SdoAbort, match="out of memory"):
        Line(SdoBlockDownload(0x2000, 1, bytes(1001), indicate_size=False), SdoServer(OneObject(), max_bytes=100)).run()
