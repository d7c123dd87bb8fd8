"""The simulated rig's process from its arguments on: what it keeps, how it ends, and whose bytes are whose."""

import asyncio
import errno
import json
import os
import signal
import socket
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.processes import exit_codes
from gateway.profiles import ProfileError
from gateway.service import simulated_rig
from gateway.service.simulated_rig import SimulatedLines, _make_pty
from gateway.service.simulation.kept_settings import KeptSettings
from tests.service.rigs import demo


@pytest.fixture
def arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.setattr("gateway.processes.scheduling.priority.set_nice", lambda _nice: None)
    ours, theirs = socket.socketpair()
    descriptor = os.dup(ours.fileno())
    ours.close()
    theirs.close()
    options = {"state": str(tmp_path), "rig": "demo", "simulate": True, "run": "this one"}
    return [str(descriptor), json.dumps(options)]


def test_what_is_set_is_kept_for_this_run_of_the_gateway(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    served = list[KeptSettings]()

    async def serve(rig: object, link: socket.socket, kept: KeptSettings, log: object) -> None:
        served.append(kept)

    monkeypatch.setattr(simulated_rig, "_serve_process", serve)
    assert simulated_rig.main(arguments) == 0
    assert served[0].run == "this one"


def test_a_rig_file_that_was_edited_since_is_no_internal_error(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The guardian's line is closed behind it: with PYTHONWARNINGS=error each stop of the gateway ended in a traceback."""

    def refuse(_name: str, *, simulated: bool, memory: int | None) -> None:
        raise ProfileError(())

    monkeypatch.setattr(simulated_rig, "kept_rig", refuse)
    assert simulated_rig.main(arguments) == exit_codes.CONFIGURATION
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(int(arguments[0]))


def test_a_machine_without_pseudo_terminals_is_told_so(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """As in a chroot or container without /dev/pts: four tracebacks without the kernel's reason, and `exit 1`."""

    def refuse() -> None:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))

    monkeypatch.setattr(os, "openpty", refuse)
    assert simulated_rig.main(arguments) == exit_codes.DEVICE
    told = capfd.readouterr().err
    assert "E106 no pseudo-terminal for the simulated lines: No such file or directory" in told
    assert "Traceback" not in told


def test_a_stop_that_every_process_is_told_leaves_it_to_the_ramp_and_the_end_of_its_line_ends_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It ended at once, and each stop of a simulated service said that its output was gone and the tool might still press."""
    told: list[bool] = []

    async def until_ended(*given: Any) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(10):  # it answers some turns later
            await asyncio.sleep(0)
        told.append(given[-1].is_set())

    monkeypatch.setattr(simulated_rig, "serve", until_ended)

    unheard: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _frame: unheard.append(number))
    try:
        asyncio.run(simulated_rig._serve_process(None, None, None, None))  # type: ignore[arg-type]
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (unheard, told) == ([], [False]), "it would have been ended without a word"


def test_the_guardians_word_behind_the_end_of_its_line_leaves_no_trace_in_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of a Ctrl-C now and then the last thing seen was a traceback: the guardian's SIGTERM met a loop that was half closed."""

    class Told(asyncio.SelectorEventLoop):
        def _close_self_pipe(self) -> None:
            super()._close_self_pipe()  # type: ignore[misc]
            os.kill(os.getpid(), signal.SIGTERM)

    async def at_once(*given: Any) -> None:
        told.append(len(given))

    told: list[int] = []
    monkeypatch.setattr(simulated_rig, "serve", at_once)
    before = signal.getsignal(signal.SIGTERM)
    try:
        with asyncio.Runner(loop_factory=Told) as runner:
            runner.run(simulated_rig._serve_process(None, None, None, None))  # type: ignore[arg-type]
    finally:
        signal.signal(signal.SIGTERM, before)
    assert told and capfd.readouterr().err == ""


def test_each_line_hears_its_own_bytes_at_its_own_frame() -> None:
    lines = SimulatedLines(demo())
    assert lines._ptys["output"]._on_bytes == lines.world.on_output_bytes
    assert lines._ptys["load_cell"]._on_bytes == lines.world.on_cell_bytes
    device = demo().load_cell.device
    for parity, bits in (("none", 10), ("even", 11)):
        serial = replace(device.serial, parity=parity)
        assert _make_pty(replace(device, serial=serial), lambda chunk, now_s: None)._bits_per_character == bits
