"""Edges and beats of the page: taking over, tare, reset, the byte order first, and a beat that is refused now and then."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.modbus import Peer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.registers.words import State
from gateway.web.commands import Commands, RefusedCommand
from gateway.web.context import WebContext
from gateway.web.register_table import register_table
from tests.service.requests.test_hostile_requests import Stage
from tests.service.rigs import demo
from tests.web.test_commands import leased, play


def test_the_page_takes_over_and_tares_by_the_bits_that_say_so(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        wired.write(0, 1, 500)
        assert wired.bank.owner == "10.0.0.5"
        await commands.take_ownership("me")
        assert (wired.bank.owner, commands.commander) == ("web", "me")
        await commands.stop()
        wired.run(2.0)
        await commands.tare()
        wired.run(0.2)
        assert any(sentence.startswith("tare") for _, sentence in wired.log)

    play(tmp_path, scene)


def test_the_page_asks_for_a_unit_that_the_rig_answers(tmp_path: Path) -> None:
    """On one that answers 7 alone each of its commands was none of ours, a Stop among them."""
    rig = replace(demo(), network=replace(demo().network, units=(7, 9)))

    async def scene(commands: Commands, stage: Stage) -> None:
        await commands.enable("me", 12.0)
        stage.wired.until(lambda: stage.wired.state is State.HOLDING, 3.0)
        await commands.stop()
        assert stage.wired.word("control_word") == 0

    play(tmp_path, scene, rig)
    assert register_table(rig, 5020)["unit"] == 7
    assert register_table(demo(), 5020)["unit"] == 1, "for which mbpoll needs no option, though 0 stands first"


def test_a_reset_takes_a_setpoint_back_that_somebody_has_left(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        await commands.enable("me", 12.0)
        wired.until(lambda: wired.state is State.HOLDING, 3.0)
        wired.is_cell_plugged = False
        wired.until(lambda: wired.state is State.FAULT, 1.0)
        wired.is_cell_plugged = True
        wired.bank.write_registers(1, (500).to_bytes(2, "big"), Peer("web"))
        wired.run(1.0)
        await commands.reset()
        wired.run(0.1)
        assert wired.state is State.OFF and wired.word("force_setpoint") == 0

    play(tmp_path, scene)


def test_a_force_is_not_set_where_the_output_has_gone_off_meanwhile(tmp_path: Path) -> None:
    """A page knows the state of half a second ago. It owned what it set, and the robot could not enable any more."""

    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        await commands.enable("me", 12.0)
        wired.run(0.5)
        wired.bank.write_registers(0, bytes(2), Peer("10.0.0.9"))
        wired.run(0.1)
        with pytest.raises(RefusedCommand, match="not enabled: nothing was set"):
            await commands.set_force("me", 5.0)
        assert (wired.word("force_setpoint"), wired.bank.owner) == (0, None)

    play(tmp_path, scene)


def test_a_rig_that_wants_the_byte_order_first_is_enabled_from_the_page_too(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        await commands.enable("me", 12.0)
        assert stage.wired.until(lambda: stage.wired.state is State.HOLDING, 3.0) > 0.0

    play(tmp_path, scene, replace(demo(), network=replace(demo().network, require_byte_order_echo=True)))


def test_a_beat_that_is_refused_now_and_then_ends_nothing() -> None:
    """Eight in a row say that another master has the setpoint: a robot that takes and gives it back in turns does not."""
    beats = [0]

    class Moody:
        async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
            pdu = bytes.fromhex(request["pdu"])
            is_beat = pdu[0] == P.READ_WRITE and pdu[5:7] == bytes((0, 4))
            beats[0] += is_beat
            if is_beat:
                refused = bytes((pdu[0] | 0x80, 6))
                return {"pdu": (refused if beats[0] % 3 else bytes((pdu[0], 2, 0, 1))).hex()}
            is_read = pdu[0] == P.READ_HOLDING_REGISTERS
            return {"pdu": (bytes((3, 2 * pdu[4], *bytes(2 * pdu[4]))) if is_read else pdu[:5]).hex()}

    async def run() -> None:
        context = WebContext(Path(), "demo", True, Moody())  # type: ignore[arg-type]
        context.__dict__["profile"] = leased()
        commands = Commands(context, lambda: 0.0, lambda seconds: asyncio.sleep(0))
        await commands.enable("me", 12.0)
        while beats[0] < 30:
            await asyncio.sleep(0)
        assert commands.commander == "me"
        await commands.close()

    asyncio.run(asyncio.wait_for(run(), 5.0))
