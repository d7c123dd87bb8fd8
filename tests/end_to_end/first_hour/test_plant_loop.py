"""The closed loop over the wired gateway, as a user goes it: a machine that is not its rig's plant is recorded, a plant is
taken into use, the same work is recorded again and compared; a wrong plant is named by the watch, and rolled back."""

import json
import os
import random
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.codes.warning_bits import WarningBit
from gateway.profiles.kinds.plant_writer import plant_text
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.test_residual_watch import WARNING_WORD, ask, watched_rig
from tests.plants.test_plant_store import bowed

PLANT_ID = 131
BOW = 0.06
LEVELS_N = (10.0, 25.0, 15.0, 35.0, 20.0, 8.0, 30.0)
HOLD_S = 1.5


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[RunningGateway]:
    """A machine with a bowed command map, of which its rig's file knows nothing, and a watch that looks often."""
    gateway = start(tmp_path / "state", "--sim", rig=str(watched_rig(tmp_path, "{window_s: 5, every_s: 1}")))
    ask(gateway.state / "rig.sock", {"do": "fault", "name": "plant", "values": {"regulator.command_bow": BOW}})
    yield gateway
    stop(gateway)


def verb(running: RunningGateway, *words: object) -> dict[str, Any]:
    told = CliRunner().invoke(command, [*map(str, words), "--state", str(running.state)])
    assert told.exit_code == 0, told.output
    return dict(json.loads(told.stdout))


def add(running: RunningGateway, bow: float) -> int:
    file = running.state.parent / "plant.yaml"
    file.write_text(plant_text(bowed(regulator__command_bow=bow)), encoding="utf-8")
    return int(verb(running, "plant", "add", file, "--json")["number"])


def work(running: RunningGateway, seconds: float) -> None:
    order, end_s = random.Random(3), time.monotonic() + seconds
    while time.monotonic() < end_s:
        running.write(0, 1, round(100 * order.choice(LEVELS_N)))
        time.sleep(HOLD_S)


def recorded(running: RunningGateway, seconds: float) -> None:
    ask(running.state / "control.sock", {"do": "record", "on": True})
    work(running, seconds)
    ask(running.state / "control.sock", {"do": "record", "on": False})


def is_warned(running: RunningGateway) -> bool:
    return bool(running.words(WARNING_WORD, 1)[0] & WarningBit.COMPENSATION_WORSE)


@pytest.mark.long
def test_a_plant_in_use_gains_force_and_a_wrong_one_is_named_and_rolled_back(watched):
    recorded(watched, 24.0)
    os.sched_setscheduler(
        watched.ready["pids"]["watch"], os.SCHED_OTHER, os.sched_param(0)
    )  # idle, it waits for other tests
    watched.write(0, 0, 0)
    watched.rest()
    used = verb(watched, "plant", "use", add(watched, BOW), "--json")
    assert (used["active"], used["compensated"], watched.words(PLANT_ID, 1)) == (1, ["command-nonlinearity"], [1])
    recorded(watched, 24.0)
    gain = verb(watched, "diagnose", "--before", 1, "--after", 2, "--json", "-")
    print(gain["force_error"], gain["held"])
    assert (gain["before"]["plant"], gain["after"]["plant"], gain["held"]["verdict"]) == (0, 1, "better")

    waiting = verb(watched, "plant", "use", add(watched, -BOW), "--before", 2, "--json")
    assert (waiting["active"], waiting["waiting"], watched.words(PLANT_ID, 1)) == (1, 2, [1]), "the tool presses"
    watched.write(0, 0, 0)
    deadline_s = time.monotonic() + 10.0
    while watched.words(PLANT_ID, 1) != [2]:
        assert time.monotonic() < deadline_s
        time.sleep(0.05)
    deadline_s = time.monotonic() + 240.0
    while not is_warned(watched):
        assert time.monotonic() < deadline_s, "the watch has not named it"
        work(watched, 24.0)
    watched.said("A347 since plant 2 is in use the force is")
    watched.write(0, 0, 0)
    watched.rest()
    assert verb(watched, "plant", "rollback", "--json")["active"] == 1
    assert (watched.words(PLANT_ID, 1), is_warned(watched)) == ([1], False)
