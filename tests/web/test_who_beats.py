"""Which browser the page beats for: the one that commanded last, for as long as it is there, and again whenever it is."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.control import LeaseAction
from gateway.modbus import pdu as P  # noqa: N812
from gateway.registers.words import State
from gateway.web.commands import Commands
from gateway.web.context import WebContext
from tests.service.requests.test_hostile_requests import Stage
from tests.service.rigs import demo
from tests.web.commanded_gateway import leased, let_turns_pass, play


async def until_done(commands: Commands) -> None:
    """Until nobody beats."""
    while commands._beat and not commands._beat.done():
        await asyncio.sleep(0)


def test_taking_over_leaves_the_page_the_owner_and_the_one_that_beats(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        wired.write(0, 1, 1000, 0, 0, 77)
        assert wired.bank.owner == "10.0.0.5"
        commands.join("me")
        await commands.take_ownership("me")
        assert wired.bank.owner == "web" and commands.commander == "me"
        began_s = wired.now_s
        await let_turns_pass(200)
        assert wired.now_s > began_s + 1.0
        assert wired.state in (State.RAMPING, State.HOLDING), "the lease goes on by the page's beat"

    play(tmp_path, scene, leased())


@pytest.mark.parametrize("error", [ConnectionResetError(), TimeoutError(), ValueError("internal error")], ids=repr)
def test_a_beat_that_came_to_nothing_is_not_the_last_one(tmp_path: Path, error: Exception) -> None:
    """One question of a busy machine was lost, and with it the force, though the browser was there."""

    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.enable("me", 12.0)
        link: Any = commands._context.control
        ask, errors = link.ask, [error]

        async def fail_once(request: dict[str, Any]) -> dict[str, Any]:
            if errors:
                raise errors.pop()
            return await ask(request)

        link.ask = fail_once
        began_s = stage.wired.now_s
        await let_turns_pass(200)
        assert not errors and stage.wired.now_s > began_s + 1.0, "it beats on"
        assert stage.wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, leased())


def test_the_page_may_take_over_again_and_again_whatever_heartbeat_stood(tmp_path: Path) -> None:
    """Its first was the robot's own once more, and so no beat: each later takeover was refused, as of a program that hangs."""

    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        for beat in (1, 20):
            stage.wired.write(0, 8, 500, 0, 0, beat)
            await commands.take_ownership("me")
            await let_turns_pass(20)
            assert stage.wired.bank.owner == "web"
            stage.wired.run(5.0)

    play(tmp_path, scene, leased())


def test_where_the_byte_order_must_be_proven_the_page_proves_it(tmp_path: Path) -> None:
    rig = replace(demo(), network=replace(demo().network, require_byte_order_echo=True))

    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.enable("me", 12.0)
        stage.wired.until(lambda: stage.wired.state is State.HOLDING, 3.0)
        assert commands.commander == "me"

    play(tmp_path, scene, rig)


def test_a_robot_that_enables_right_behind_a_stop_meets_no_beat_of_the_page(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        await let_turns_pass(20)
        await commands.stop()
        wired.write(0, 1, 1000, 0, 0, 77)
        await let_turns_pass(20)
        assert wired.bank.owner == "10.0.0.5" and wired.bank.refusals == 0

    play(tmp_path, scene, leased())


def test_behind_a_fault_nobody_beats_and_the_robot_that_enables_meets_no_page(tmp_path: Path) -> None:
    """Not even behind a reset of the page's own: the robot had eight refusals of a beat in its registers, and in the log."""

    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        wired.is_cell_plugged = False
        wired.until(lambda: wired.state is State.FAULT, 1.0)
        wired.is_cell_plugged = True
        for _ in range(50):  # its browser stays
            commands.note_alive("me")
            await asyncio.sleep(0)
        assert commands._beat and commands._beat.done()
        wired.run(1.0)
        await commands.reset()
        wired.run(0.1)
        assert wired.state is State.OFF
        wired.write(0, 1, 1000, 0, 0, 78)
        for beat in range(40):
            commands.note_alive("me")
            wired.write(4, 100 + beat)
            wired.run(0.05)
            await asyncio.sleep(0)
        assert wired.bank.owner == "10.0.0.5" and wired.bank.refusals == 0
        assert wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, leased())


def test_a_beat_that_finds_the_output_off_ends_none_that_an_enable_has_begun_meanwhile() -> None:
    """Its answer was on its way."""
    beats: list[bytes] = []

    class Slow:
        async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
            pdu = bytes.fromhex(request["pdu"])
            if pdu[0] != P.READ_WRITE:
                is_read = pdu[0] == P.READ_HOLDING_REGISTERS
                return {"pdu": (bytes((3, 2 * pdu[4], *bytes(2 * pdu[4]))) if is_read else pdu[:5]).hex()}
            beats.append(pdu)
            if len(beats) == 1:
                await commands.enable("me", 12.0)
            return {"pdu": bytes((P.READ_WRITE, 2, 0, len(beats) > 1)).hex()}

    async def run() -> None:
        await commands.take_ownership("me")
        while len(beats) < 10:
            await asyncio.sleep(0)
        assert commands.commander == "me"
        await commands.close()

    context = WebContext(Path(), "demo", True, Slow())  # type: ignore[arg-type]
    context.__dict__["profile"] = leased()
    commands = Commands(context, lambda: 0.0, lambda seconds: asyncio.sleep(0))
    asyncio.run(asyncio.wait_for(run(), 5.0))


def test_who_changes_the_force_is_who_must_be_there_from_then_on(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        for viewer in ("me", "you"):
            commands.join(viewer)
        await commands.enable("me", 12.0)
        await commands.set_force("you", 10.0)
        assert commands.commander == "you"
        stage.wired.run(2.0)
        commands.note_alive("me")
        stage.wired.run(1.0)
        assert not commands.is_attended

    play(tmp_path, scene)


def test_a_browser_that_leaves_is_not_there_for_longer_than_one_that_stays_silent(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.enable("me", 12.0)
        stage.wired.run(2.3)
        assert commands.is_attended
        commands.leave("me")
        stage.wired.run(0.3)
        assert not commands.is_attended

    play(tmp_path, scene)


def test_another_browser_that_leaves_takes_nothing_from_the_one_that_commands(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        for name in ("me", "you"):
            commands.join(name)
        await commands.enable("me", 12.0)
        commands.leave("you")
        stage.wired.run(2.0)
        assert commands.is_attended

    play(tmp_path, scene)


def test_a_master_that_takes_the_page_s_force_for_moments_ends_no_beat(tmp_path: Path) -> None:
    """Refused beats count in a row: the page's own force would end with its lease."""

    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        for beat in range(10):
            wired.write(0, 1 | 8, 1200, 0, 0, beat + 1)
            told = wired.bank.refusals
            while wired.bank.refusals < told + 2:
                await asyncio.sleep(0)
            await commands.take_ownership("me")
            for _ in range(4):
                await asyncio.sleep(0)
                commands.note_alive("me")
            assert commands._beat and not commands._beat.done()
        assert commands.commander == "me" and wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, leased())


def test_behind_an_absence_that_ended_the_beat_the_next_command_begins_it_again(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        while commands.is_attended:
            await asyncio.sleep(0)
        await until_done(commands)
        wired.run(1.0)
        assert wired.state is State.FAULT
        await commands.reset()
        await commands.enable("me", 12.0)
        for _ in range(20):
            await asyncio.sleep(0)
            wired.run(0.02)
        assert wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, leased())


@pytest.mark.parametrize("ends", ["another one's stop", "its own stop", "a loss", "a heartbeat that stands already"])
def test_an_enable_of_the_page_counts_behind_whatever_has_ended_its_force(ends: str, tmp_path: Path) -> None:
    """It brought no heartbeat: behind a loss that ramps to 0 each click on Enable was refused (W302)."""
    rig = leased()
    supervision = replace(rig.control.supervision, lease_action=LeaseAction.RAMP)

    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        await let_turns_pass(40)
        assert wired.state in (State.RAMPING, State.HOLDING)
        if ends == "its own stop":
            await commands.stop()
        elif ends == "another one's stop":
            wired.write(0, 0)
        else:
            await commands.close()
        wired.run(2.0)
        if ends.startswith("a heartbeat"):
            wired.write(4, (wired.word("heartbeat") + 1) & 0xFFFF)
        assert wired.state is State.OFF
        await commands.enable("me", 12.0)
        await let_turns_pass(40)
        assert wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, replace(rig, control=replace(rig.control, supervision=supervision)))
