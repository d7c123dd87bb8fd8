"""The ports of a running rig: what came over a wire before a question is no answer to it."""

import asyncio
import os
from collections.abc import Callable, Iterator

import pytest

from gateway.ports import PortError, Pty
from gateway.profiles import load_rig
from gateway.service.running_rig.lines.rig_ports import RigPorts

LINES = ("output", "load_cell", "valve")


class Ear:
    """Stands for the control loop: keeps what each line has heard."""

    cell_lost = False

    def __init__(self) -> None:
        self.heard = dict.fromkeys(LINES, b"")
        self.on_output_bytes, self.on_cell_bytes, self.on_valve_bytes = map(self._keeper, LINES)
        self._changed = asyncio.Event()

    def _keeper(self, line: str) -> Callable[[bytes, float], None]:
        def keep(chunk: bytes, now_s: float) -> None:
            self.heard[line] += chunk
            self._changed.set()

        return keep

    async def next_bytes(self) -> None:
        async with asyncio.timeout(5.0):
            await self._changed.wait()

    def on_output_opened(self) -> None: ...

    def on_cell_opened(self) -> None: ...

    def on_valve_opened(self) -> None: ...


@pytest.fixture
def far_ends() -> Iterator[dict[str, Pty]]:
    far_ends = {line: Pty() for line in LINES}
    yield far_ends
    for pty in far_ends.values():
        pty.close()


@pytest.mark.parametrize("line", LINES)
def test_what_came_before_a_question_is_no_answer_to_it(far_ends: dict[str, Pty], line: str) -> None:
    """A late answer to the question before would else be taken for this one's, and each that follows would be one behind."""
    here, far_end = far_ends[line], far_ends[line].fd

    async def scene() -> None:
        paths = {name: pty.path for name, pty in far_ends.items()}
        ports = RigPorts(load_rig("paper-pull"), paths, lambda descriptor: None, lambda cause, sentence: None)
        ports.loop = ear = Ear()  # type: ignore[assignment]
        await ports.open(is_restart=False)
        try:
            os.write(far_end, b"late")
            ask = {"output": ports.write_output, "load_cell": ports.write_cell, "valve": ports.write_valve}[line]
            ask(b"?")
            os.write(far_end, b"fresh")
            await ear.next_bytes()
            assert ear.heard == dict.fromkeys(LINES, b"") | {line: b"fresh"}
        finally:
            ports.close()

    asyncio.run(scene())
    assert os.read(here.fd, 16) == b"?"


def test_a_port_that_is_there_and_does_not_open_is_told_in_the_log(far_ends: dict[str, Pty]) -> None:
    said: list[str] = []
    paths = {name: pty.path for name, pty in far_ends.items()}
    ports = RigPorts(load_rig("paper-pull"), paths, lambda descriptor: None, lambda cause, text: said.append(text))
    for port in (ports.output, ports.cell, ports.valve):
        assert port
        port._on_refused(PortError("E101", f"{port.path}: user anna may not open it"))
    assert said == [f"E101 {path}: user anna may not open it; tried again until it opens" for path in paths.values()]
