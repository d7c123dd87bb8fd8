"""The monitor in a real terminal: nothing is cut on a narrow one, only what has changed is written, q and Ctrl-C end it."""

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
import threading
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from rich.text import Text

from gateway.cli.live_monitor.history import Track
from gateway.cli.live_monitor.poll import Poller, WriterSource
from gateway.cli.live_monitor.register_table import View, Writer
from gateway.cli.live_monitor.screen import Screen
from gateway.cli.master.client import GatewayClient
from gateway.cli.master.local_gateways import find_state_behind
from gateway.cli.master.value_text import format_value
from gateway.cli.master.wires import TcpWire
from gateway.cli.terminal import can_write_over
from gateway.codes.all_codes import CATALOGUE
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.registers import RegisterMap
from gateway.registers.words import State, StatusBit
from tests.cli.live_monitor.test_monitor import poll_of, text_of


def test_why_there_are_no_writers_is_said_in_the_last_line(fake, register_map: RegisterMap) -> None:
    assert find_state_behind(TcpWire("10.0.0.5", 5020), Path("/nowhere"))[1] == (
        "last writers: only where the gateway runs on this machine"
    )
    wire = TcpWire("127.0.0.1", fake.port)
    with GatewayClient(wire, 1, register_map) as client:
        poller = Poller(client, WriterSource(lambda: find_state_behind(wire, Path("/nowhere"))), lambda: 0.0)
        poller.poll()
        lines = text_of(poller.view(80, 24, "q quits"))
    assert lines[-2].startswith("q quits · last writers: no gateway of this user below /nowhere says")
    assert lines[-1].endswith("--state DIR names its directory")


@pytest.mark.parametrize("width", [60, 80])
@pytest.mark.parametrize("writers", [None, {"command": Writer("192.168.125.101", "50001", 3.0)}])
def test_nothing_is_cut_on_a_narrow_terminal(width: int, writers, register_map: RegisterMap) -> None:
    """Every word of the header, of the alarm and of the values is there, if need be in a further line."""
    track = Track()
    values = {"state": State.FAULT, "fault_code": FaultCode.CELL_LOST, "warning_word": WarningBit.TARGET_UNREACHABLE}
    track.add(0.0, poll_of(register_map, status_word=sum(StatusBit), **values))
    lines = text_of(View(track, "192.168.125.100:5020", width, 90, "", writers, "q quits"))
    assert max(map(len, lines)) <= width
    words = set(re.split(r"[\s│]+", "\n".join(lines)))
    readings = " ".join(f"{name} {format_value(reading)}" for name, reading in track.readings.items())
    alarms = " ".join(CATALOGUE[code].title + " " + CATALOGUE[code].do for code in ("A318", "A301"))
    wanted = set(f"{readings} {alarms} 192.168.125.100:5020 pulling switching q quits".split())
    assert wanted - words == set()
    assert ("192.168.125.101" in words) == (writers is not None)


@pytest.mark.parametrize(
    ("status", "requested", "has_error"),
    [(StatusBit.ENABLED, 12.0, True), (0, 0.0, False), (StatusBit.ENABLED, 0.0, False)],
)
def test_a_force_that_nobody_asks_for_has_no_error(
    status: int, requested: float, has_error: bool, register_map: RegisterMap
) -> None:
    """What rests on the cell of a gateway that is off was shown as an error of +0.98 N, and a ladder's force as one of 59 N."""
    track = Track()
    told = {"force_requested": requested, "force_measured": 1.0, "output_voltage": 1500.0, "status_word": status}
    track.add(0.0, poll_of(register_map, **told))
    lines = text_of(View(track, "127.0.0.1:5020", 80, 24))
    top = next(place for place, line in enumerate(lines) if "error N" in line)
    assert ("–" in "".join(line[40:60] for line in lines[top + 1 : top + 4])) is not has_error


@pytest.mark.parametrize("state", State)
def test_the_header_begins_with_the_state_by_its_name(state: State, register_map: RegisterMap) -> None:
    track = Track()
    track.add(0.0, poll_of(register_map, state=state))
    assert text_of(View(track, "127.0.0.1:5020", 80, 24))[0].split()[0] == state.name


@pytest.mark.parametrize(("bits", "scale"), [(0, "0 .. 20 N (line"), (StatusBit.PULLING, "0 .. 20 N of pull (line")])
def test_the_chart_of_a_pull_says_that_it_is_one(bits: int, scale: str, register_map: RegisterMap) -> None:
    """Beside -15.00 N measured it stood at 15 N, without a word."""
    track = Track()
    force_n = -15.0 if bits else 15.0
    track.add(0.0, poll_of(register_map, force_requested=15, force_measured=force_n, status_word=bits))
    assert scale in "\n".join(text_of(View(track, "127.0.0.1:5020", 60, 24)))


def test_a_frame_like_the_last_one_writes_nothing_and_a_change_its_line() -> None:
    console = Console(width=20, height=5, file=StringIO(), force_terminal=True, color_system=None)
    screen = Screen(console)
    screen.show([Text("one"), Text("two"), Text("three")], (20, 5))
    begin = console.file.tell()
    screen.show([Text("one"), Text("two"), Text("three")], (20, 5))
    assert console.file.tell() == begin
    screen.show([Text("one"), Text("TWO")], (20, 5))
    assert console.file.getvalue()[begin:] == "\x1b[2;1HTWO\x1b[K\x1b[3;1H\x1b[J"


@pytest.mark.parametrize("key", [b"q", b"\x03"])
def test_q_and_ctrl_c_leave_the_live_page_cleanly(fake, key: bytes) -> None:
    fake.bank.set("state", State.HOLDING)
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    process = subprocess.Popen(
        [sys.executable, "-m", "gateway", "monitor", "--gateway", fake.address],
        stdin=theirs,
        stdout=theirs,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: fcntl.ioctl(theirs, termios.TIOCSCTTY, 0),
        start_new_session=True,
        env=os.environ | {"TERM": "xterm-256color"},
    )
    os.close(theirs)
    shown = b""
    while b"quits" not in shown:
        shown += os.read(ours, 65536)
    os.write(ours, key)
    patience = threading.Timer(20.0, process.kill)  # a key that does nothing fails the test, it does not hold it up
    patience.start()
    try:
        while chunk := os.read(ours, 65536):
            shown += chunk
    except OSError:  # the far end is closed: the process has ended
        pass
    os.close(ours)
    patience.cancel()
    patience.join()
    assert process.stderr
    with process.stderr:
        assert process.stderr.read() == b""
    assert process.wait(10) == 0
    assert b"\x1b[?25h" in shown[-40:]  # the cursor is shown again ...
    assert b"\x1b[?1049l" in shown[-40:]  # ... and the screen as it was
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode())
    assert "measured N" in plain
    assert "q quits" in plain


@pytest.mark.parametrize(("term", "draws"), [("xterm", True), ("dumb", False)])
def test_a_dumb_terminal_gets_one_frame_as_a_pipe_does(term: str, draws: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """It showed `[?1049h` and the like, and each frame below the last."""
    monkeypatch.setenv("TERM", term)
    with StringIO() as pipe, StringIO() as terminal:
        monkeypatch.setattr(terminal, "isatty", lambda: True)
        assert (can_write_over(terminal), can_write_over(pipe)) == (draws, False)
