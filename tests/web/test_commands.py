"""What the page may do to the force, on a whole gateway in virtual time: as any master, for as long as its browser is there."""

import asyncio
from math import isfinite
from pathlib import Path
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.modbus import pdu as P  # noqa: N812
from gateway.registers.words import ControlBit, State
from gateway.web.commands import RELOAD_S, Commands, RefusedCommand
from gateway.web.context import WebContext
from tests.service.requests.test_hostile_requests import Stage
from tests.service.rigs import demo
from tests.web.commanded_gateway import leased, let_turns_pass, play


def test_a_force_is_held_changed_and_stopped(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        wired.until(lambda: wired.state is State.HOLDING, 3.0)
        assert wired.bank.owner == "web"
        await commands.set_force("me", 8.0)
        wired.until(lambda: abs(wired.force_n - 8.0) < 1.0, 3.0)
        await commands.stop()
        wired.run(0.05)
        assert wired.state is State.OFF and wired.exchange.sent_v == 0.0

    play(tmp_path, scene)


def test_a_force_is_a_force_whatever_mode_another_master_has_left(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        wired.write(0, 1, 0, 55, 1, 0, 2000)
        wired.run(1.0)
        wired.write(0, 0)
        await commands.enable("me", 12.0)
        wired.until(lambda: wired.state is State.HOLDING, 3.0)
        assert abs(wired.force_n - 12.0) < 1.0 and wired.word("force_ramp") == 55
        await commands.stop()
        wired.write(0, 1, 0, 0, 1, 0, 2000)
        wired.run(1.0)
        await commands.take_ownership("me")
        await commands.set_force("me", 8.0)
        wired.until(lambda: abs(wired.force_n - 8.0) < 1.0, 3.0)

    play(tmp_path, scene)


def test_stop_ends_the_force_of_another_master_and_nothing_else_does(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        wired.write(0, 1, 1000)
        wired.run(0.5)
        with pytest.raises(RefusedCommand, match=r"10\.0\.0\.5"):
            await commands.set_force("me", 20.0)
        with pytest.raises(RefusedCommand, match=r"10\.0\.0\.5"):
            await commands.reset()  # of a fault that another browser has reset, and the robot has enabled again
        with pytest.raises(RefusedCommand, match=r"10\.0\.0\.5"):
            await commands.tare()
        wired.run(0.3)
        assert wired.state in (State.RAMPING, State.HOLDING)
        await commands.stop()
        wired.run(0.05)
        assert wired.state is State.OFF

    play(tmp_path, scene)


@pytest.mark.parametrize("is_held", [False, True])
def test_a_stop_ends_what_is_still_on_its_way(tmp_path: Path, is_held: bool) -> None:
    """An enable, and another force, ask control before they write; a stop in between must not come before that write: the page
    pressed, or owned a setpoint behind its own stop, and kept the robot out."""

    async def scene(commands: Commands, stage: Stage) -> None:
        turn, answer_at_once = asyncio.Lock(), commands._context.control.ask

        async def ask(request: dict[str, Any]) -> dict[str, Any]:
            async with turn:  # one question at a time, in order, as on control's socket
                await asyncio.sleep(0)
                return await answer_at_once(request)

        commands._context.control.ask = ask  # type: ignore[method-assign]
        for turns in range(1, 8):
            if is_held:
                await commands.enable("me", 8.0)
            asked = asyncio.create_task((commands.set_force if is_held else commands.enable)("me", 12.0))
            await let_turns_pass(turns)
            await commands.stop()
            await asyncio.gather(asked, return_exceptions=True)
            stage.wired.run(0.1)
            left = stage.wired.state, stage.wired.word("force_setpoint"), stage.wired.bank.owner, commands.commander
            assert left == (State.OFF, 0, None, ""), f"stopped {turns} turns after it was asked"

    play(tmp_path, scene)


def test_stop_ends_a_calibration_too(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        wired.write(0, 1 << 5)
        wired.until(lambda: wired.state is State.CALIBRATING, 1.0)
        await commands.stop()
        assert wired.until(lambda: wired.state is State.OFF, 2.0) < 2.0

    play(tmp_path, scene)


def test_an_enable_leaves_the_valve_where_it_stands() -> None:
    """Another direction than the one that stands is what nobody at the page has asked for."""
    written: list[bytes] = []

    class PullingBank:
        async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
            pdu = bytes.fromhex(request["pdu"])
            if pdu[0] == P.READ_HOLDING_REGISTERS:
                return {"pdu": bytes((pdu[0], 2 * pdu[4], 0, ControlBit.VALVE_PULL, *bytes(2 * pdu[4] - 2))).hex()}
            written.append(pdu)
            return {"pdu": pdu[:5].hex()}

    context = WebContext(Path(), "demo", True, PullingBank())  # type: ignore[arg-type]
    context.__dict__["profile"] = demo()
    asyncio.run(Commands(context).enable("me", 12.0))
    assert written == [P.write_registers_request(0, bytes((0, ControlBit.VALVE_PULL | ControlBit.ENABLE, 4, 0xB0)))]


@pytest.mark.parametrize("force_n", [70.0, -1.0, 1e9, float("nan"), float("inf")])
def test_a_force_that_is_not_allowed_is_refused_in_the_gateway_s_words(tmp_path: Path, force_n: float) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        before = stage.wired.bank.refusals
        with pytest.raises(RefusedCommand, match=r"force_setpoint|newtons"):
            await commands.enable("me", force_n)
        assert stage.wired.state is State.OFF
        assert isfinite(force_n) or stage.wired.bank.refusals == before, "what is no number goes to no register"

    play(tmp_path, scene)


def test_a_lease_is_kept_while_the_browser_is_there_and_not_a_second_longer_than_said(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        commands.join("another")  # who only looks on keeps no force
        await commands.enable("me", 12.0)
        for _ in range(20):  # 4 s: longer than the grace
            await let_turns_pass(4)
            commands.note_alive("me")
        assert wired.now_s > 2.0 and wired.state is State.HOLDING
        commands.leave("me")
        left_s = wired.now_s
        while wired.state is not State.FAULT:
            commands.note_alive("me")  # a browser that has no stream of events open is not there
            commands.note_alive("another")
            assert wired.now_s - left_s < RELOAD_S + 0.5
            before_s = wired.now_s
            await asyncio.sleep(0)
            if wired.now_s == before_s:  # nobody beats any more: time goes on without
                wired.run(0.05)
        assert wired.fault_code is FaultCode.MASTER_LOST
        await commands.reset()
        wired.run(0.1)
        assert wired.state is State.OFF

    play(tmp_path, scene, leased())


def test_an_enable_brings_another_heartbeat_than_the_one_that_stands_whoever_has_written_that(tmp_path: Path) -> None:
    """By the same one it would be a program's that stands still (W302), and the page would be refused for nothing."""

    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        stage.wired.write(4, 1)  # as the page's first would be
        await commands.enable("me", 12.0)
        assert stage.wired.word("heartbeat") != 1 and stage.wired.bank.owner == "web"

    play(tmp_path, scene, leased())


def test_behind_the_largest_heartbeat_a_reset_brings_the_smallest(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        stage.wired.write(4, 0xFFFF)
        await commands.reset()
        assert stage.wired.word("heartbeat") == 1

    play(tmp_path, scene)


def test_behind_a_stop_nobody_beats_any_more(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.enable("me", 12.0)
        await let_turns_pass(20)
        await commands.stop()
        beats = []
        for _ in range(20):
            commands.note_alive("me")
            await asyncio.sleep(0)
            beats.append(stage.wired.word("heartbeat"))
        assert beats == beats[:1] * 20 and commands.commander == ""

    play(tmp_path, scene, leased())


def test_a_command_that_was_refused_makes_no_commander_and_no_beat(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        stage.wired.write(0, 1, 1000, 0, 0, 1)
        assert stage.wired.bank.owner == "10.0.0.5"
        for refused in (commands.enable("me", 20.0), commands.set_force("me", 20.0)):
            with pytest.raises(RefusedCommand):
                await refused
        told = stage.wired.bank.refusals
        await let_turns_pass(10)
        assert commands.commander == "" and stage.wired.bank.refusals == told

    play(tmp_path, scene, leased())


def test_a_browser_that_was_overtaken_soon_leaves_the_refusal_registers_to_the_new_owner(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        await let_turns_pass(8)
        wired.write(0, 1 | 8, 1200, 0, 0, 77)
        assert wired.bank.owner == "10.0.0.5"
        for beat in range(40):
            commands.note_alive("me")
            wired.write(4, 100 + beat)
            await asyncio.sleep(0)
        told = wired.bank.refusals
        assert 0 < told < 20 and commands.commander == ""
        await let_turns_pass(10)
        assert wired.bank.refusals == told and wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, leased())


def test_a_reload_within_the_grace_loses_nothing(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        commands.leave("me")
        began_s = wired.now_s
        while wired.now_s < began_s + RELOAD_S - 0.3:
            await asyncio.sleep(0)
        commands.join("me")
        while wired.now_s < began_s + 3.0:
            await asyncio.sleep(0)
        assert wired.state is State.HOLDING

    play(tmp_path, scene, leased())
