"""The ports of a running rig: what came over a wire before a question is no answer to it."""

import asyncio
import errno
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gateway.ports import PortError, Pty, serial_port
from gateway.profiles import load_rig
from gateway.service.running_rig.lines.rig_ports import RigPorts
from tests.ports.raw_bytes import gather

LINES = ("output", "load_cell", "valve")


class Ear:
    """Stands for the control loop: keeps what each line has heard."""

    cell_lost = False

    def __init__(self) -> None:
        self.heard = dict.fromkeys(LINES, b"")
        self.on_output_bytes, self.on_cell_bytes, self.on_valve_bytes = map(self._keeper, LINES)
        self._changed = asyncio.Event()
        self.told: list[str] = []

    def _keeper(self, line: str) -> Callable[[bytes, float], None]:
        def keep(chunk: bytes, now_s: float) -> None:
            self.heard[line] += chunk
            self._changed.set()

        return keep

    async def next_bytes(self) -> None:
        async with asyncio.timeout(5.0):
            await self._changed.wait()

    def __setattr__(self, name: str, value: object) -> None:
        super().__setattr__(name, value)
        if name == "cell_lost" and value:
            self.told.append("cell lost")

    async def hears(self, *told: str) -> None:
        """Wait until it has been told as much, and that this is what it was."""
        async with asyncio.timeout(5.0):
            while len(self.told) < len(told):
                await asyncio.sleep(0.001)
        assert self.told == [*told]
        self.told.clear()

    def on_output_opened(self) -> None:
        self.told.append("output opened")

    def on_output_closed(self) -> None:
        self.told.append("output closed")

    def on_cell_opened(self) -> None:
        self.told.append("cell opened")

    def on_valve_opened(self) -> None:
        self.told.append("valve opened")

    def on_valve_closed(self) -> None:
        self.told.append("valve closed")


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


class Scene:
    """A rig's three ports, open; log: what is said to people; guarded: what the guardian was handed, and what the loop had been
    told by then."""

    def __init__(self, far_ends: dict[str, Pty], folder: Path) -> None:
        self.far_ends, self.ear, self.folder = far_ends, Ear(), folder
        self.said: list[str] = []
        self.guarded: list[tuple[str, list[str]]] = []
        self.refusals: list[OSError] = []
        self.paths = {name: self.plug(name, name) for name in far_ends}
        self.taken_back = 0  # how often the guardian was told to close the output
        self.ports = RigPorts(
            load_rig("paper-pull"),
            self.paths,
            self._hand_over,
            lambda _, text: self.said.append(text),
            self._take_back,
        )
        self.ports.loop = self.ear  # type: ignore[assignment]

    def plug(self, line: str, name: str) -> str:
        """Give the far end a name of its own: the number of a pseudo-terminal that is closed is given to the next one."""
        (self.folder / name).symlink_to(self.far_ends[line].path)
        return str(self.folder / name)

    def unplug(self, line: str) -> None:
        (self.folder / line).unlink()
        self.far_ends[line].close()

    def _take_back(self) -> None:
        self.taken_back += 1

    def _hand_over(self, descriptor: int) -> None:
        if self.refusals:
            raise self.refusals.pop()
        self.guarded.append((os.ttyname(descriptor), [*self.ear.told]))


def test_the_guardian_has_an_output_before_the_loop_may_write_to_it(far_ends: dict[str, Pty], tmp_path: Path) -> None:
    """Else the loop could die between the two, and its voltage stood."""

    async def scene() -> None:
        one = Scene(far_ends, tmp_path)
        await one.ports.open(is_restart=False)
        assert one.guarded == [(far_ends["output"].path, [])]
        assert one.ports.is_guarded
        await one.ear.hears("output opened", "cell opened", "valve opened")
        one.ports.close()

    asyncio.run(scene())


@pytest.mark.parametrize("line", LINES)
def test_a_lost_port_is_told_to_the_loop_and_to_people_and_is_opened_where_it_has_moved_to(
    far_ends: dict[str, Pty], line: str, tmp_path: Path
) -> None:
    """As those of a simulated rig that was started again."""
    name = line.removeprefix("load_")

    async def scene() -> None:
        one = Scene(far_ends, tmp_path)
        await one.ports.open(is_restart=False)
        one.ear.told.clear()
        one.unplug(line)
        await one.ear.hears(f"{name} lost" if name == "cell" else f"{name} closed")
        assert one.paths[line] in one.said[0] and len(one.said) == 1
        assert one.ports.is_guarded is (line != "output"), "of a port that is gone nobody writes the last voltage"
        assert one.taken_back == (line == "output"), "kept open, its name is not given to the adapter that comes back"
        far_ends[line] = Pty()
        one.ports.move(one.paths | {line: one.plug(line, "moved")})
        await one.ear.hears(f"{name} opened")
        assert one.ports.is_guarded
        assert [path for path, _ in one.guarded][1:] == ([far_ends[line].path] if line == "output" else [])
        one.ports.close()

    asyncio.run(scene())


@pytest.mark.parametrize("is_restart", [True, False])
def test_a_port_that_is_away_ends_a_first_start_and_no_restart(
    far_ends: dict[str, Pty], is_restart: bool, tmp_path: Path
) -> None:
    async def scene() -> None:
        one = Scene(far_ends, tmp_path)
        one.unplug("valve")
        if is_restart:
            await one.ports.open(is_restart=True)
            assert [*one.ports.not_opened] == [one.paths["valve"]]
            await one.ear.hears("output opened", "cell opened", "valve closed")
        else:
            with pytest.raises(PortError):
                await one.ports.open(is_restart=False)
        one.ports.close()

    asyncio.run(scene())


def test_nothing_is_written_behind_the_last_voltage(far_ends: dict[str, Pty], tmp_path: Path) -> None:
    """A device whose sentence is followed at once by another one may obey neither."""

    async def scene() -> None:
        one = Scene(far_ends, tmp_path)
        await one.ports.open(is_restart=False)
        await one.ports.write_last(b"SET 0\r\n")
        for write in (one.ports.write_output, one.ports.write_cell, one.ports.write_valve):
            write(b"?")
        assert os.read(far_ends["output"].fd, 64) == b"SET 0\r\n"
        for pty in far_ends.values():
            os.set_blocking(pty.fd, False)
            with pytest.raises(BlockingIOError):
                os.read(pty.fd, 64)
        one.unplug("output")
        await one.ports.write_last(b"SET 0\r\n")  # where nobody takes it that is no exception
        one.ports.close()

    asyncio.run(scene())


def test_an_adapter_that_waits_before_it_tells_is_told_to_people(
    far_ends: dict[str, Pty], tmp_path: Path, monkeypatch
) -> None:
    def slow(descriptor: int, path: str) -> str:
        return f"W241 {path} waits"

    monkeypatch.setattr(serial_port, "set_low_latency", slow)

    async def scene() -> None:
        one = Scene(far_ends, tmp_path)
        await one.ports.open(is_restart=False)
        assert one.said == [f"W241 {path} waits" for path in one.paths.values()]
        one.ports.close()

    asyncio.run(scene())


def test_an_output_that_nobody_would_guard_is_no_open_output(far_ends: dict[str, Pty], tmp_path: Path) -> None:
    """With it open, control would set voltages that no guardian could take back."""
    full = OSError(errno.EMFILE, "Too many open files")

    async def scene() -> None:
        one = Scene(far_ends, tmp_path)
        one.refusals = [full, full]
        with pytest.raises(
            PortError, match=r"^E102 .*output is closed again, .* cannot be given this port \(.*Too many open"
        ):
            await one.ports.open(is_restart=False)
        assert not one.ports.output.is_open and not one.ports.is_guarded and one.ear.told == []
        one.ports.output.begin_lost(PortError("E102", "as after a restart"))
        await one.ear.hears("output closed", "output opened")
        assert one.ports.is_guarded and not one.refusals
        assert [text.partition(" is closed")[0] for text in one.said if "closed again" in text] == [
            f"E102 {one.paths['output']}"
        ]
        one.ports.close()

    asyncio.run(scene())


def test_a_port_that_is_there_and_does_not_open_is_told_in_the_log(far_ends: dict[str, Pty]) -> None:
    said: list[str] = []
    paths = {name: pty.path for name, pty in far_ends.items()}
    ports = RigPorts(load_rig("paper-pull"), paths, lambda descriptor: None, lambda cause, text: said.append(text))
    for port in (ports.output, ports.cell, ports.valve):
        assert port
        port._on_refused(PortError("E101", f"{port.path}: user anna may not open it"))
    assert said == [f"E101 {path}: user anna may not open it; tried again until it opens" for path in paths.values()]


def test_what_the_output_has_not_sent_is_dropped_and_its_last_voltage_is_not(
    far_ends: dict[str, Pty], tmp_path: Path
) -> None:
    async def scene() -> None:
        scene = Scene(far_ends, tmp_path)
        await scene.ports.open(is_restart=False)
        while not scene.ports.output.unsent_bytes:
            scene.ports.write_output(b"SET 512\r\n" * 10)
        scene.ports.drop_output()
        assert scene.ports.output.unsent_bytes == 0
        await scene.ports.write_last(b"SET 0\r\n")
        scene.ports.drop_output()
        heard = b""
        while not heard.endswith(b"SET 0\r\n"):
            heard += await gather(far_ends["output"].fd, 1)
        assert len(heard) <= 4096 + len(b"SET 0\r\n")
        scene.ports.close()

    asyncio.run(scene())
