"""A loop of the gateway's wake-ups with nothing in them: what the machine and the interpreter take of each by themselves.

    python tools/bench/harness/empty_loop.py OUTPUT_PTY CELL_PTY LOOP_HZ

Reads each sentence of the cell and each tick of the clock, and drops them; writes one sentence to the output for each request
on its TCP port, which it prints first. No bank, no control, no codec: a peer of the gateway in `loop.py`, not a part of it.
"""

import asyncio
import contextlib
import os
import sys
from collections.abc import Callable
from typing import Any

from gateway.processes.clock_tick import ClockTick
from gateway.processes.scheduling import priority


class EmptyAnswer(asyncio.BufferedProtocol):
    """Writes to the wire first, then answers with the beginning of the request."""

    def __init__(self, write: Callable[[], object]) -> None:
        self._write = write
        self._buffer = bytearray(1024)

    def connection_made(self, transport: Any) -> None:
        """Keep the connection."""
        self._transport = transport

    def get_buffer(self, _size_hint: int) -> bytearray:
        """Lend the buffer."""
        return self._buffer

    def buffer_updated(self, size: int) -> None:
        """Answer a request."""
        self._write()
        self._transport.write(bytes(self._buffer[: min(size, 12)]))


async def serve(output: str, cell: str, loop_hz: float) -> None:
    """Serve until the process is ended."""
    loop = asyncio.get_running_loop()
    lines = [os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK) for path in (output, cell)]
    for line in lines:
        loop.add_reader(line, os.read, line, 4096)
    server = await loop.create_server(lambda: EmptyAnswer(lambda: os.write(lines[0], b"SET 512\r\n")), "127.0.0.1", 0)
    ClockTick(1.0 / loop_hz, lambda expirations, late_s: None).start()
    print(server.sockets[0].getsockname()[1], flush=True)
    await asyncio.Event().wait()


def main() -> None:
    """Run on the event loop that the gateway would take."""
    factory: Any = None
    with contextlib.suppress(ImportError):
        import uvloop

        factory = uvloop.new_event_loop
    priority.set_nice(priority.LOOP_NICE)
    with asyncio.Runner(loop_factory=factory) as runner:
        runner.run(serve(sys.argv[1], sys.argv[2], float(sys.argv[3])))


if __name__ == "__main__":
    main()
