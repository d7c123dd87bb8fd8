"""Requests as bytes, and connections that are driven by hand."""

import asyncio

from gateway.modbus import Adu, pdu
from gateway.modbus.mbap import encode

READ = pdu.read_request(3, 0, 2)
READ_ANSWER = bytes.fromhex("0304") + bytes(4)


def framed(request: bytes, transaction: int = 1, unit: int = 1) -> bytes:
    return encode(Adu(transaction, unit, request))


async def end_of(reader: asyncio.StreamReader) -> bytes:
    """Everything up to the end of the connection, however it ends."""
    found = b""
    try:
        while chunk := await reader.read(65536):
            found += chunk
    except ConnectionError:
        pass
    return found


async def exchange(port: int, data: bytes, size: int) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(data)
    found = await reader.readexactly(size)
    writer.close()
    await writer.wait_closed()
    return found
