"""Polls a gateway and keeps the track, through lost connections; writers come from the control socket where it is known."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from gateway.cli.control_socket import ask
from gateway.cli.errors import CliError
from gateway.cli.live_monitor.history import Track
from gateway.cli.live_monitor.register_table import View, Writer
from gateway.cli.master.client import GatewayClient, RefusedError

POLL_S: Final = 0.1
"""Refresh period of the live page: ten frames a second look continuous and are two requests each."""


class Poller:
    """Reads a gateway: one poll is two requests, the command block and the status block."""

    def __init__(self, client: GatewayClient, state: Path | None, clock: Callable[[], float]) -> None:
        self.track = Track()
        self.trouble = ""
        self._client = client
        self._state = state
        self._clock = clock

    def poll(self) -> None:
        """Read both blocks; CliError or RefusedError when that fails."""
        readings = [*self._client.read_block("command"), *self._client.read_block("status")]
        self.track.add(self._clock(), readings)
        self.trouble = ""

    def poll_or_note(self) -> None:
        """Poll, with trouble noted for the page instead of raised; the next poll connects again."""
        try:
            self.poll()
        except (CliError, RefusedError) as error:
            self.trouble = str(error)

    def view(self, width: int, height: int) -> View:
        """Return what a frame of this size is drawn from."""
        return View(self.track, self._client.where, width, height, self.trouble, self._writers())

    def _writers(self) -> dict[str, Writer] | None:
        """Who wrote each register last, and how long ago; None without a state directory or a gateway on it."""
        if self._state is None:
            return None
        try:
            writers = ask(self._state, {"do": "last-writer"})["writers"]
            now_s = self._clock()
            return {name: _writer(entry, now_s) for name, entry in writers.items()}
        except (CliError, KeyError, TypeError, ValueError):
            return {}


def _writer(entry: dict[str, Any], now_s: float) -> Writer:
    """From the control socket's answer; its times are of this machine's monotonic clock, as ours are."""
    host, _, port = str(entry["peer"]).rpartition(":")
    return Writer(host or port, port if host else "", now_s - float(entry["time_s"]))
