"""Polls a gateway and keeps the track, through lost connections; writers come from the control socket where it is known."""

from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any, Final

from gateway.cli.control_socket import ask
from gateway.cli.errors import CliError
from gateway.cli.live_monitor.history import Track
from gateway.cli.live_monitor.register_table import View, Writer
from gateway.cli.master.client import GatewayClient, RefusedError
from gateway.registers.writes.ownership import serial_place

POLL_S: Final = 0.25
"""Refresh period of the live page. A frame costs 2 to 4 ms of processor, nearly all of it drawing: four a second are one or two
hundredths of a core, ten were more than a tenth on a slow machine."""
_WRITERS_S: Final = 1.0  # between two looks at who wrote
_ASK_AGAIN_S: Final = 5.0  # between two searches for the gateway's directory


class Poller:
    """Reads a gateway: one poll is two requests, the command block and the status block."""

    def __init__(self, client: GatewayClient, writers: "WriterSource", clock: Callable[[], float]) -> None:
        self.track = Track()
        self.trouble = ""
        self._client = client
        self._source = writers
        self._clock = clock
        self._is_map_checked = False
        self._blocks = [block.name for block in client.register_map.blocks if block.name in ("command", "status")]

    def poll(self) -> None:
        """Read both blocks; CliError or RefusedError when that fails, or when they are another map's."""
        if not self._is_map_checked:  # at first, and after each trouble: another gateway may be there
            self._client.check_map()
            self._is_map_checked = True
        readings = [reading for name in self._blocks for reading in self._client.read_block(name)]
        self.track.add(self._clock(), readings)
        self.trouble = ""

    def poll_or_note(self) -> None:
        """Poll, with trouble noted for the page instead of raised; the next poll connects again."""
        try:
            self.poll()
        except (CliError, RefusedError) as error:
            self.trouble, self._is_map_checked = str(error), False

    def view(self, width: int, height: int, hint: str = "") -> View:
        """Return what a frame of this size is drawn from. hint: what a key does."""
        writers = self._source.read(self._clock())
        words = " · ".join(part for part in (hint, self._source.why_none) if part)
        return View(self.track, self._client.where, width, height, self.trouble, writers, words)


class WriterSource:
    """Who wrote each register last: from the gateway's control socket, where it runs on this machine.

    find: finds its state directory, and says why there is none; asked again now and then, for a gateway may come later.
    """

    def __init__(self, find: Callable[[], tuple[Path | None, str]]) -> None:
        self.why_none = ""
        self._find = find
        self._state: Path | None = None
        self._ask_again_s = -inf
        self._entries: dict[str, tuple[str, str, float]] | None = None

    def read(self, now_s: float) -> dict[str, Writer] | None:
        """Return who wrote each register, and how long ago; None where nobody can tell: `why_none` says why."""
        if now_s >= self._ask_again_s:
            self._look(now_s)
        if self._entries is None:
            return None
        return {name: Writer(host, port, now_s - time_s) for name, (host, port, time_s) in self._entries.items()}

    def _look(self, now_s: float) -> None:
        if self._state is None:
            self._state, self.why_none = self._find()
        self._entries = None if self._state is None else _ask_writers(self._state)
        self._ask_again_s = now_s + (_ASK_AGAIN_S if self._state is None else _WRITERS_S)


def _ask_writers(state: Path) -> dict[str, tuple[str, str, float]]:
    """Return host, port and time of each register's last write; nothing where no gateway answers."""
    try:
        writers = ask(state, {"do": "last-writer"})["writers"]
        return {name: _writer(entry) for name, entry in writers.items()}
    except (CliError, KeyError, TypeError, ValueError):
        return {}


def _writer(entry: dict[str, Any]) -> tuple[str, str, float]:
    """From the control socket's answer; its times are of this machine's monotonic clock, as ours are. Of a certificate its
    name is shown, which is who it is, wherever it connects from."""
    peer, time_s = str(entry["peer"]), float(entry["time_s"])
    name, is_certificate, _ = peer.partition(" (")
    host, colon, port = name.rpartition(":")
    has_port = colon and not is_certificate and serial_place(name) is None
    return (host, port, time_s) if has_port else (name, "", time_s)
