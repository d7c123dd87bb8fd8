"""The faces that a restart could not serve, each tried again until it is: an address that has gone with its interface or is
held by another program, a TLS face whose files are not good at the moment. Ending over one would take the others' faces, use
up the restarts within seconds, and let go of the force.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Final

from gateway.service.banner import ServedFace
from gateway.service.running_rig.control_loop import Log
from gateway.service.running_rig.starting import StartError

AGAIN_S: Final = 5.0  # an attempt binds a port and reads three files; nobody waits for it to the second

Serve = Callable[[], Awaitable[ServedFace]]
"""Serves on one face, or says by a StartError why it cannot."""


class FacesToCome:
    """on_served: called when one of them is served. sleep: an argument for tests."""

    def __init__(
        self, log: Log, on_served: Callable[[], None], sleep: Callable[[float], Awaitable[None]] = asyncio.sleep
    ) -> None:
        self._log, self._on_served, self._sleep = log, on_served, sleep
        self._trying: set[asyncio.Task[None]] = set()

    def add(self, name: str, serve: Serve, error: StartError) -> None:
        """Say what is missing and why, and try again from now on, until `close`."""
        self._log(f"face {name}", f"{error}; it goes on without this face, tried again every {AGAIN_S:g} s")
        attempts = asyncio.get_running_loop().create_task(self._try_again(name, serve, str(error)))
        self._trying.add(attempts)
        attempts.add_done_callback(self._trying.discard)

    async def close(self) -> None:
        """Try no more."""
        trying = tuple(self._trying)
        for attempts in trying:
            attempts.cancel()
        await asyncio.gather(*trying, return_exceptions=True)

    async def _try_again(self, name: str, serve: Serve, told: str) -> None:
        while True:
            await self._sleep(AGAIN_S)
            try:
                face = await serve()
            except StartError as error:
                if str(error) != told:
                    told = str(error)
                    self._log(f"face {name}", told)
                continue
            self._log(f"face {name}", f"modbus {face.type} {face.where} is served again")
            self._on_served()
            return
