"""Whatever the device schema allows works, or `check` says why not: profiles drawn from it, on a rig, in virtual time.

An accepted rig must take a force and measure it, over wires that take the time of their baud rates, with a master's lease.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import pytest

from gateway.profiles import Report, check_report, shipped_profiles_folder
from gateway.profiles.schema import schema
from gateway.profiles.strict_yaml.text import parse
from gateway.registers.words import State
from tests.service.every_device.drawn_devices import (
    Profile,
    choices,
    drawn_cell,
    drawn_counts,
    drawn_modbus_cell,
    drawn_modbus_output,
    drawn_output,
)
from tests.service.wired import Wired

SEEDS = range(48)
LEAST_ACCEPTED = 18

RIG: dict[str, Any] = {
    "name": "own",
    "registers": "force-v1",
    "calibration": "demo",
    "plant": "paper-slide",
    "output": {"device": "dac.yaml", "port": "/dev/serial/by-id/a"},
    "load_cell": {"device": "cell.yaml", "port": "/dev/serial/by-id/b", "range_n": 98.07},
    "limits": {"force_max_n": 40, "over_force_n": 55, "smallest_force_n": 2, "voltage_max_v": 8},
    "defaults": {"force_ramp_n_per_s": 100, "precontact_force_n": 3, "in_band_tolerance_n": 1, "in_band_time_s": 0.2},
    "trim": {"gain_v_per_n_s": 0.3, "limit_v": 0.4},
    "accept_no_device_watchdog": True,
}


def shipped_device(name: str) -> Profile:
    value: Profile = parse((shipped_profiles_folder() / "devices" / f"{name}.yaml").read_bytes(), name).value
    return value


@dataclass
class Drawn:
    output: Profile
    cell: Profile
    report: Report


def written(folder: Path, rig: dict[str, Any], output: Profile, cell: Profile) -> Report:
    """A real rig's folder, its devices beside it; JSON is YAML."""
    for name, value in (("dac", output), ("cell", cell), ("rig", rig)):
        (folder / f"{name}.yaml").write_text(json.dumps(value, indent=1))
    return check_report(folder / "rig.yaml")


def rig_for(rng: Random, output: Profile, cell: Profile) -> dict[str, Any]:
    """Time bounds and unit as somebody might write them, the speeds as the devices have them."""
    rig: dict[str, Any] = json.loads(json.dumps(RIG))
    reading = cell.get("stream") or cell["read_force"]
    rig["output"]["baud"], rig["load_cell"]["baud"] = output["serial"]["baud"], cell["serial"]["baud"]
    rig["load_cell"]["sign"] = rng.choice([1, 1, -1])
    if (
        "{unit" not in reading.get("frame", "{unit")
        and "newton_per_count" not in reading
        and rng.random() < (0.3 if "unit" in reading else 0.9)
    ):
        rig["load_cell"]["unit"] = rng.choice(["N", "N", "kg"])
    if output["set_voltage"]["range"]["voltage_v"][1] < 8:
        rig["limits"] |= {"voltage_max_v": 5, "force_max_n": 30}
    rig["supervision"] = {
        "lease_s": rng.choice([None, 0.2]),
        "sample_timeout_s": rng.choice([0.05, 0.3, 1.0]),
        "output_timeout_s": max(rng.choice([0.1, 0.6]), min(0.6, output.get("reply_timeout_s", 0.1))),
        "sample_quantum_n": rng.choice([0.1, 1.0]),
        "saturation_n": 96,
    }
    return rig


@pytest.fixture(scope="module")
def all_drawn(tmp_path_factory: pytest.TempPathFactory) -> list[Drawn]:
    """Each third rig has a drawn output, a drawn cell, or both."""
    found = []
    for seed in SEEDS:
        rng = Random(seed)
        output, cell = drawn_output(rng), drawn_cell(rng)
        output = shipped_device("smc-itv-rc") if seed % 3 == 1 else output
        cell = shipped_device("stream-st-gs") if seed % 3 == 0 else cell
        output = drawn_modbus_output(rng) if seed % 8 == 5 else output
        if draw := {6: drawn_modbus_cell, 7: drawn_counts}.get(seed % 8):
            cell = draw(rng)
        folder = tmp_path_factory.mktemp("rig")
        found.append(Drawn(output, cell, written(folder, rig_for(rng, output, cell), output, cell)))
    return found


def presses(wired: Wired, force_n: float, first_beat: int, within_s: float = 6.0) -> None:
    """Under a lease, until it is held and measured; at 1200 baud, 7 readings a second, the trim takes its time."""
    for beat in range(first_beat, first_beat + round(within_s / 0.1)):
        wired.write(0, 1, round(100 * force_n), 0, 0, beat)
        wired.run(0.1)
        if wired.state is State.HOLDING and abs(wired.force_n - force_n) <= 1.2:
            return
    raise AssertionError(f"{force_n} N: {wired.show()}, {wired.log[-3:]}")


@pytest.mark.sampled
@pytest.mark.parametrize("seed", SEEDS)
def test_a_drawn_rig_presses_or_check_says_why_not(seed: int, all_drawn: list[Drawn]) -> None:
    drawn = all_drawn[seed]
    if drawn.report.rig is None:
        assert drawn.report.faults
        assert all(fault.line >= 1 and len(fault.message) > 15 for fault in drawn.report.faults)
        return
    wired = Wired(drawn.report.rig.as_simulated())
    wired.until(lambda: bool(wired.word("status_word") & 2), 5.0)
    presses(wired, 12.0, 1)
    presses(wired, 25.0, 100)
    assert not wired.said("A499")
    heard = [one.voltage_v for one in wired.observer.settings]
    assert not heard or max(heard) > 2.0, "it was commanded by the output, not by accident"


def test_the_draws_cover_the_schema_and_enough_of_them_are_accepted(all_drawn: list[Drawn]) -> None:
    accepted = [drawn for drawn in all_drawn if drawn.report.rig]
    assert LEAST_ACCEPTED <= len(accepted) < len(all_drawn) - 10, (
        "a test that refuses or accepts everything shows nothing"
    )
    keys = {key for drawn in all_drawn for profile in (drawn.output, drawn.cell) for key in profile}
    valves = {"set_valve", "read_valve"}  # of the third role, which presses nothing
    assert keys | valves == set(schema("device")["properties"]), "a new key of the schema must be drawn, too"
    readings = [drawn.cell.get("stream") or drawn.cell["read_force"] for drawn in all_drawn]
    assert {key for reading in readings for key in reading} == set(
        schema("device")["$defs"]["ForceReading"]["properties"]
    )

    def seen(of: Callable[[Drawn], object]) -> set[object]:
        return {of(drawn) for drawn in accepted}

    assert seen(lambda drawn: "read_force" in drawn.cell) == {True, False}
    assert seen(lambda drawn: "read_voltage" in drawn.output) == {True, False}
    assert seen(lambda drawn: "read_pressure" in drawn.output) == {True, False}
    assert seen(lambda drawn: bool(drawn.output["set_voltage"].get("answer"))) == {True, False}
    for owner in ("output", "cell"):
        assert seen(lambda drawn, owner=owner: getattr(drawn, owner).get("terminator")) >= {"\r\n", "\r", "\n", "\x03"}
        assert seen(lambda drawn, owner=owner: getattr(drawn, owner).get("checksum")) >= {"none", "dcon-sum", "xor"}
    sums = seen(lambda drawn: drawn.output.get("checksum")) | seen(lambda drawn: drawn.cell.get("checksum"))
    assert sums >= set(choices("DeviceProfile", "checksum"))
