"""Block transfers against the library canopen, which shares no code with ours.

Its client judges our server. It has no block server: its LocalNode answers a block upload with a plain one, and refuses
a block download, which is what our client's ways back are for.
"""

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from canopen.sdo import SdoAbortedError, SdoClient, SdoCommunicationError

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.master.sdo_block_client import SdoBlockDownload, SdoBlockUpload
from torquerig.driver.wire.sdo import SdoAbort

LENGTHS = [1, 4, 6, 7, 8, 9, 14, 100, 127 * 7 - 1, 127 * 7, 127 * 7 + 1, 2000, 4096]
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


class LossyLine:
    """Stands in for canopen's network: each request is answered at once, and chosen frames get lost."""

    def __init__(self, server):
        self.server = server
        self.client = None
        self.requests = self.responses = 0
        self.lost_requests = set()
        self.lost_responses = set()
        self.sent = []

    def send_message(self, _can_id, data, _remote=False):
        self.requests += 1
        self.sent.append(bytes(data))
        if self.requests in self.lost_requests:
            return
        response = self.server.handle(bytes(data))
        for message in () if response is None else (response, *self.server.pending):
            self.responses += 1
            if self.responses not in self.lost_responses:
                self.client.on_response(0x581, bytearray(message), 0.0)


@pytest.fixture
def connect(shelf):
    def connect(**options):
        line = LossyLine(SdoServer(shelf, **options))
        client = SdoClient(0x601, 0x581, canopen.ObjectDictionary())
        client.RESPONSE_TIMEOUT = 0.02
        client.network, line.client = line, client
        return client, line

    return connect


def pattern(length):
    return bytes(i % 251 for i in range(length))


def read(client, **options):
    with client.open(0x2000, 1, "rb", block_transfer=True, **options) as stream:
        return stream.read()


def write(client, value, **options):
    with client.open(0x2000, 1, "wb", size=len(value), block_transfer=True, buffering=0, **options) as stream:
        for start in range(0, len(value), 7):
            assert stream.write(value[start : start + 7])


@pytest.mark.parametrize("length", [0, *LENGTHS])
@pytest.mark.parametrize("crc", [True, False])
def test_canopens_client_reads_our_server_in_blocks(shelf, connect, length, crc):
    shelf.objects[0x2000, 1] = pattern(length)
    client, line = connect()
    assert read(client, request_crc_support=crc) == pattern(length)
    assert line.sent[-1] == b"\xa1" + bytes(7)
    assert line.server.aborted == 0


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("crc", [True, False])
@pytest.mark.parametrize("block_size", [1, 10, 127])
def test_canopens_client_writes_our_server_in_blocks(shelf, connect, length, crc, block_size):
    shelf.objects[0x2000, 1] = b""
    client, line = connect(block_size=block_size)
    write(client, pattern(length), request_crc_support=crc)
    assert shelf.written == [pattern(length)]
    assert (line.server.aborted, line.server.skipped) == (0, 0)


def test_canopens_client_and_a_server_without_check_sum(shelf, connect):
    shelf.objects[0x2000, 1] = b""
    client, _ = connect(crc=False)
    write(client, pattern(300))
    assert read(client) == pattern(300)


@pytest.mark.parametrize("lost", [{2}, {5}, {10}, {2, 3, 4}, {5, 9}])
def test_canopens_client_sends_again_what_our_server_misses(shelf, connect, lost):
    # in blocks of 10, not the last segment of one: our server has no clock, and canopen would wait
    shelf.objects[0x2000, 1] = b""
    client, line = connect(block_size=10)
    line.lost_requests = lost
    write(client, pattern(300))
    assert shelf.written == [pattern(300)]
    assert line.server.skipped > 0


@pytest.mark.parametrize("lost", [{2}, {5}, {127}, {2, 3, 4}, {5, 200}, set(range(2, 128))])
def test_our_server_sends_again_what_canopens_client_misses(shelf, connect, lost):
    # not the last segment of a block, frame 128: after its timeout canopen drops the first one of the next
    shelf.objects[0x2000, 1] = pattern(2000)
    client, line = connect()
    line.lost_responses = lost
    assert read(client) == pattern(2000)
    assert line.responses > 1 + 286 + 1


def test_canopens_client_hears_our_aborts_of_block_transfers(shelf, connect):
    client, _ = connect(max_bytes=100)
    with pytest.raises(SdoAbortedError) as caught:
        client.open(0x2000, 1, "rb", block_transfer=True)
    assert caught.value.code == 0x06020000
    with pytest.raises(SdoAbortedError) as caught:
        client.open(0x2000, 1, "wb", block_transfer=True, size=101)
    assert caught.value.code == 0x05040005
    shelf.objects[0x2000, 1] = b""
    shelf.read_only.add((0x2000, 1))
    with pytest.raises(SdoAbortedError) as caught:
        write(client, pattern(20))
    assert caught.value.code == 0x06010002


def test_canopens_client_with_a_wrong_check_sum_is_told_so(shelf, connect):
    shelf.objects[0x2000, 1] = pattern(20)
    client, line = connect()

    class WrongSum(client.crc_cls):
        def final(self):
            return super().final() ^ 1

    client.crc_cls = WrongSum
    with pytest.raises(SdoAbortedError) as caught:
        write(client, pattern(100))
    assert caught.value.code == 0x05040004
    assert shelf.written == []
    with pytest.raises(SdoCommunicationError, match="CRC"):
        read(client)
    assert line.server.aborted == 1


# our client and canopen's LocalNode


class Recorder:
    """Stands in for canopen's network on the server's side: keeps what it sends."""

    def __init__(self):
        self.sent = []

    def send_message(self, _can_id, data, _remote=False):
        self.sent.append(bytes(data))


@pytest.fixture
def local_node():
    dictionary = canopen.ObjectDictionary()
    variable = ODVariable("object", 0x2000, 0)
    variable.data_type = datatypes.DOMAIN
    dictionary.add_object(variable)
    node = canopen.LocalNode(1, dictionary)
    node.sdo.network = Recorder()
    return node.sdo


def play(transfer, server):
    request = transfer.request
    while request is not None:
        server.on_request(0x601, bytearray(request), 0.0)
        request = transfer.step(server.network.sent.pop())
        assert transfer.pending == ()


@pytest.mark.parametrize("length", LENGTHS)
def test_our_client_falls_back_with_canopens_server(local_node, length):
    download = SdoBlockDownload(0x2000, 0, pattern(length), fall_back=True)
    play(download, local_node)
    assert download.done
    upload = SdoBlockUpload(0x2000, 0, fall_back=True)
    play(upload, local_node)
    assert upload.done
    assert upload.result == pattern(length)


def test_our_client_takes_canopens_plain_upload_below_the_threshold(local_node):
    play(SdoBlockDownload(0x2000, 0, pattern(30), fall_back=True), local_node)
    upload = SdoBlockUpload(0x2000, 0, switch_threshold=30)
    play(upload, local_node)
    assert upload.result == pattern(30)


def test_our_client_hears_that_canopens_server_has_no_block_download(local_node):
    with pytest.raises(SdoAbort, match="command specifier"):
        play(SdoBlockDownload(0x2000, 0, pattern(30)), local_node)
