"""Which browser the page beats for: the one that commanded last, for as long as it is there, and again whenever it is."""

import asyncio
from dataclasses import replace
from pathlib import Path

from gateway.registers.words import State
from gateway.web.commands import Commands
from tests.service.requests.test_hostile_requests import Stage
from tests.service.rigs import demo
from tests.web.test_commands import leased, play


def test_taking_over_leaves_the_page_the_owner_and_the_one_that_beats(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        wired.write(0, 1, 1000, 0, 0, 77)
        assert wired.bank.owner == "10.0.0.5"
        commands.join("me")
        await commands.take_ownership("me")
        assert wired.bank.owner == "web" and commands.commander == "me"
        began_s = wired.now_s
        while wired.now_s < began_s + 1.0:
            await asyncio.sleep(0)
        assert wired.state in (State.RAMPING, State.HOLDING), "the lease goes on by the page's beat"

    play(tmp_path, scene, leased())


def test_where_the_byte_order_must_be_proven_the_page_proves_it(tmp_path: Path) -> None:
    rig = replace(demo(), network=replace(demo().network, require_byte_order_echo=True))

    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.enable("me", 12.0)
        stage.wired.until(lambda: stage.wired.state is State.HOLDING, 3.0)
        assert commands.commander == "me"

    play(tmp_path, scene, rig)


def test_who_resets_a_fault_is_the_one_that_beats_for_what_comes_next(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        commands.join("me")
        await commands.reset("me")
        assert commands.commander == "me" and commands.is_attended

    play(tmp_path, scene, leased())


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


def test_behind_an_absence_that_ended_the_beat_the_next_command_begins_it_again(tmp_path: Path) -> None:
    async def scene(commands: Commands, stage: Stage) -> None:
        wired = stage.wired
        commands.join("me")
        await commands.enable("me", 12.0)
        while commands.is_attended:
            await asyncio.sleep(0)
        while commands._beat and not commands._beat.done():
            await asyncio.sleep(0)
        wired.run(1.0)
        assert wired.state is State.FAULT
        await commands.reset("me")
        await commands.enable("me", 12.0)
        for _ in range(20):
            await asyncio.sleep(0)
            wired.run(0.02)
        assert wired.state in (State.RAMPING, State.HOLDING)

    play(tmp_path, scene, leased())
