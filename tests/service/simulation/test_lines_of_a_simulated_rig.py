"""The simulated rig's ptys and its socket: what streams, which plug is out, what is kept, and what is told to whom."""

import asyncio
import errno
import os
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from gateway.processes import message_link
from gateway.profiles import Rig, load_rig
from gateway.service.simulated_rig import SimulatedLines, SimulationSocket, serve
from gateway.service.simulation.kept_settings import KeptSettings
from tests.service.rigs import demo

Scene = Callable[[SimulatedLines], Awaitable[None]]


def on_lines(rig: Rig, scene: Scene) -> None:
    async def run() -> None:
        lines = SimulatedLines(rig)
        lines.open()
        try:
            async with asyncio.timeout(10.0):
                await scene(lines)
        finally:
            lines.close()
        assert not any(pty.is_open for pty in lines._ptys.values())

    asyncio.run(run())


async def heard(path: str, question: bytes = b"") -> bytes:
    """The first bytes that a client at this port gets."""
    port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        if question:
            os.write(port, question)
        while True:
            try:
                return os.read(port, 4096)
            except BlockingIOError:
                await asyncio.sleep(0.002)
    finally:
        os.close(port)


def test_the_cell_streams_and_the_output_answers_each_at_its_own_port() -> None:
    async def scene(lines: SimulatedLines) -> None:
        paths = lines.paths()
        assert set(paths) == {"output", "load_cell"}
        assert b"ST," in await heard(paths["load_cell"]) or b"US," in await heard(paths["load_cell"])
        assert (await heard(paths["output"], b"REQ\r\n")).strip().isdigit()

    on_lines(demo(), scene)


@pytest.mark.parametrize(("missed", "frames"), [(0, 1), (11, 12), (500, 100)])
def test_an_amplifier_sends_though_its_process_comes_late(missed: int, frames: int) -> None:
    """What it had not sent was missing: on a busy machine a self-test blamed the cable of a healthy cell. Of a long stop it
    sends what a driver keeps, for nobody reads meanwhile."""

    async def scene(lines: SimulatedLines) -> None:
        assert lines._tick
        lines._tick.close()
        port = os.open(lines.paths()["load_cell"], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        lines._on_tick(1 + missed, 0.0)
        data = b""
        try:
            while data.count(b"\n") < frames:
                with suppress(BlockingIOError):
                    data += os.read(port, 4096)
                await asyncio.sleep(0.001)
        finally:
            os.close(port)
        assert data.count(b"\n") == frames and lines._ptys["load_cell"].backlog_s == 0.0

    on_lines(demo(), scene)


def test_a_rig_with_a_valve_has_a_port_for_it_that_answers() -> None:
    async def scene(lines: SimulatedLines) -> None:
        assert await heard(lines.paths()["valve"], bytes.fromhex("0101000000083DCC"))

    on_lines(load_rig("paper-pull", simulated=True), scene)


def test_a_plug_that_is_pulled_is_out_and_put_back_is_another_port() -> None:
    async def scene(lines: SimulatedLines) -> None:
        before = lines.paths()
        for name, setting in (("output", "output.unplug"), ("load_cell", "cell.unplug"), ("valve", "valve.unplug")):
            lines.world.simulate({"do": "sim", "set": {setting: True}})
            assert lines.plug(lines.world.settings) is False, "there is no other port yet"
            assert {key for key, pty in lines._ptys.items() if not pty.is_open} == {name}
            assert lines.paths() == before, "of an unplugged one, where it was last"
            lines._on_tick(1, 0.0)
            assert lines.plug(lines.world.settings) is False
            lines.world.simulate({"do": "sim", "clear_all": True})
            assert lines.plug(lines.world.settings) is True
            assert lines.plug(lines.world.settings) is False
            assert all(pty.is_open for pty in lines._ptys.values())
            before = lines.paths()

    on_lines(load_rig("paper-pull", simulated=True), scene)


def test_what_a_slow_wire_has_no_time_for_is_left_out() -> None:
    async def scene(lines: SimulatedLines) -> None:
        sent = list[float]()
        lines.world.stream = sent.append  # type: ignore[method-assign]
        assert lines._tick is not None
        lines._tick.close()
        lines._on_tick(1, 0.0)
        assert len(sent) == 1
        lines._ptys["load_cell"].send(b"x" * 1000)
        lines._on_tick(1, 0.0)
        assert len(sent) == 1

    on_lines(demo(), scene)


class Answers:
    """A socket over lines without ports."""

    def __init__(self, state: Path, run: str = "first", moves: bool = False) -> None:
        self.told, self.said = 0, list[str]()
        self.lines = SimulatedLines(demo())
        self.lines.plug = lambda settings: moves  # type: ignore[method-assign]
        self.socket = SimulationSocket(self.lines, KeptSettings(state, run), self.tell, self.say)  # type: ignore[arg-type]

    def tell(self) -> None:
        self.told += 1

    def say(self, cause: str, sentence: str) -> None:
        self.said.append(sentence)


async def in_a_loop(scene: Callable[[], Any]) -> Any:
    return scene()


def test_what_is_set_is_said_once_kept_and_set_again_in_another_process(tmp_path: Path) -> None:
    def scene() -> None:
        first = Answers(tmp_path)
        answer = first.socket.simulate({"do": "sim", "set": {"cell.silent": True, "noise": 0.5}})
        assert answer["set"] == {"cell.silent": True, "cell.noise": 0.5}
        first.socket.simulate({"do": "sim"})
        assert first.said == ["the simulated rig is set: cell.silent=on, cell.noise=0.5"]
        again = Answers(tmp_path)
        again.socket.restore()
        assert again.lines.world.settings == first.lines.world.settings
        assert again.said == ["the simulated rig is set as it was before: cell.silent=on, cell.noise=0.5"]
        again.socket.simulate({"do": "sim", "clear_all": True})
        assert again.said[-1] == "the simulated rig is set: nothing, it is as its files say"
        for other in (Answers(tmp_path), Answers(tmp_path, run="second")):
            other.socket.restore()
            assert other.said == []

    asyncio.run(in_a_loop(scene))


def test_a_port_that_has_moved_is_told_and_a_fault_is_kept_as_a_setting(tmp_path: Path) -> None:
    def scene() -> None:
        moved, stays = Answers(tmp_path, moves=True), Answers(tmp_path)
        for one in (moved, stays):
            assert one.socket.fault({"do": "fault", "name": "cell-cut"}) == {"fault": "cell-cut", "on": True}
            with pytest.raises(ValueError, match="is not one of"):
                one.socket.fault({"do": "fault", "name": "cell-cu"})
        assert (moved.told, stays.told) == (1, 0)
        assert KeptSettings(tmp_path, "first").read().values == {"cell.silent": True}

    asyncio.run(in_a_loop(scene))


def test_a_directory_that_takes_nothing_is_said_and_the_rig_is_set_all_the_same(tmp_path: Path) -> None:
    def scene() -> None:
        one = Answers(tmp_path / "gone")
        one.socket.simulate({"do": "sim", "set": {"air.off": True}})
        assert one.lines.world.settings.is_on("air.off")
        place = f"{tmp_path}/gone/simulation.json.part: {os.strerror(errno.ENOENT)}"
        assert one.said[-1] == f"what is set does not outlive the simulated rig's process: {place}"

    asyncio.run(in_a_loop(scene))


def test_a_process_that_was_started_again_has_its_plugs_as_they_were_and_ends_with_its_guardian(tmp_path: Path) -> None:
    async def scene() -> None:
        Answers(tmp_path).socket.simulate({"do": "sim", "set": {"cell.unplug": True}})
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        said, ended = list[str](), asyncio.Event()
        kept = KeptSettings(tmp_path, "first")
        log: Any = lambda cause, sentence: said.append(sentence)  # noqa: E731
        served = asyncio.create_task(serve(demo(), theirs, kept, log, ended))
        ours.setblocking(False)
        while True:
            try:
                message = message_link.receive(ours)
                break
            except BlockingIOError:
                await asyncio.sleep(0.005)
        assert message and message.tag == message_link.PTYS
        assert message.body["pid"] == os.getpid() and set(message.body["ptys"]) == {"output", "load_cell"}
        await asyncio.sleep(0)
        assert not Path(message.body["ptys"]["load_cell"]).exists(), "its plug is out"
        assert Path(message.body["ptys"]["output"]).exists()
        assert (tmp_path / "rig.sock").exists()
        ours.close()
        async with asyncio.timeout(5.0):
            await served
        theirs.close()
        assert not (tmp_path / "rig.sock").exists()
        assert said == ["the simulated rig is set as it was before: cell.unplug=on"]

    asyncio.run(scene())
