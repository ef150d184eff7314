"""Both SDO machines against the library canopen, which shares no code with them."""

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from canopen.sdo import SdoAbortedError, SdoClient

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.master.sdo_client import SdoDownload, SdoUpload
from torquerig.driver.wire.sdo import SdoAbort

LENGTHS = [1, 2, 3, 4, 5, 7, 8, 14, 15, 100, 889, 2000]


class DirectLine:
    """Stands in for canopen's network: each request is answered at once, in the same thread."""

    def __init__(self, server):
        self.server = server
        self.client = None

    def send_message(self, _can_id, data, _remote=False):
        response = self.server.handle(bytes(data))
        if response is not None:
            self.client.on_response(0x581, bytearray(response), 0.0)


class Recorder:
    """Stands in for canopen's network on the server's side: keeps what it sends."""

    def __init__(self):
        self.sent = []

    def send_message(self, _can_id, data, _remote=False):
        self.sent.append(bytes(data))


def canopen_client(shelf):
    line = DirectLine(SdoServer(shelf))
    client = SdoClient(0x601, 0x581, canopen.ObjectDictionary())
    client.network = line
    line.client = client
    return client


def canopen_server():
    """canopen's LocalNode with one object for any bytes, and its SDO server on a recorder."""
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


@pytest.mark.parametrize("length", LENGTHS)
def test_canopens_client_writes_and_reads_our_server(shelf, length):
    value = bytes(i % 251 for i in range(length))
    shelf.objects[0x2000, 1] = b""
    client = canopen_client(shelf)
    client.download(0x2000, 1, value)
    assert shelf.objects[0x2000, 1] == value
    assert client.upload(0x2000, 1) == value


def test_canopens_client_can_force_segments_on_a_short_object(shelf):
    shelf.objects[0x2000, 1] = b""
    canopen_client(shelf).download(0x2000, 1, b"ab", force_segment=True)
    assert shelf.objects[0x2000, 1] == b"ab"


def test_canopens_client_hears_our_abort_codes(shelf):
    client = canopen_client(shelf)
    shelf.objects[0x2000, 2] = b"x"
    shelf.read_only.add((0x2000, 2))
    with pytest.raises(SdoAbortedError) as caught:
        client.upload(0x2000, 1)
    assert caught.value.code == 0x06020000
    with pytest.raises(SdoAbortedError) as caught:
        client.download(0x2000, 2, b"y")
    assert caught.value.code == 0x06010002


@pytest.mark.parametrize("length", LENGTHS)
def test_our_client_writes_and_reads_canopens_server(length):
    value = bytes(i % 251 for i in range(length))
    server = canopen_server()
    play(SdoDownload(0x2000, 0, value), server)
    upload = SdoUpload(0x2000, 0)
    play(upload, server)
    assert upload.done
    assert upload.result == value


def test_our_client_hears_canopens_abort():
    with pytest.raises(SdoAbort, match="object does not exist"):
        play(SdoUpload(0x2001, 0), canopen_server())
