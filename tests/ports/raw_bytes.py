"""Bytes of a descriptor, as they come."""

import asyncio
import os


def read_all(descriptor: int) -> bytes:
    data = b""
    try:
        while chunk := os.read(descriptor, 65536):
            data += chunk
    except BlockingIOError:
        pass
    return data


async def gather(descriptor: int, length: int) -> bytes:
    """Read a master until that many bytes have come."""
    loop = asyncio.get_running_loop()
    data, ready = b"", asyncio.Event()
    loop.add_reader(descriptor, ready.set)
    try:
        async with asyncio.timeout(5.0):
            while len(data) < length:
                await ready.wait()
                ready.clear()
                data += read_all(descriptor)
    finally:
        loop.remove_reader(descriptor)
    return data
