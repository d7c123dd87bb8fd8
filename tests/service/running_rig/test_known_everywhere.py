"""What changes in a running rig is known to all of its parts at once."""

import socket
from dataclasses import replace

import pytest

from gateway import VERSION
from gateway.audit.audit_reader import read_audit
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.devices import cell_host
from gateway.plants.in_use import in_use_facts
from gateway.ports import PortError
from gateway.processes.exit_cause import EndCause, Ending
from gateway.profiles import Rig, load_rig
from gateway.registers.refusal import Refusal
from gateway.service.running_rig import running_rig
from gateway.service.running_rig.running_rig import RunningRig
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig import begun_rig
from tests.service.running_rig.test_running_rig import MASTER, devices, with_running_rig

__all__ = ["devices"]


def test_another_calibration_or_plant_is_known_everywhere_at_once(devices: OwnDevices) -> None:
    """Control, registers, recordings and audit must not speak of two."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        activation, recordings = rig._calibrations._activation, rig._recordings
        own = rig._rig.calibration
        number = activation.store.add(replace(own, name="another", force_limits_n=(0.0, 21.0)))
        address = rig._rig.register_map.find("calibration_id").address
        assert int.from_bytes(rig.bank.read_registers(address, 1), "big") != number
        rig._on_calibration(activation.use(number, None))
        shown = rig.bank.read_registers(address, 1)
        assert int.from_bytes(shown, "big") == rig.controller.calibration_id == recordings.calibration.number == number
        assert rig._guardian.kept["calibration"] == number, "a process behind this one's death would call it another"
        with pytest.raises(Refusal, match=f"calibration {number}"):
            rig.bank.write_registers(1, (2200).to_bytes(2), MASTER)
        recordings.plant_in_use = {"number": 99}
        rig._guardian.keep(plant=99)
        other = replace(rig._rig, description="with another plant")
        rig._on_plant(other)
        assert recordings.plant_in_use == in_use_facts(other)
        assert rig._guardian.kept["plant"] == rig._plants.status()["active"]
        assert rig._calibration_runs._rig is other, "what a run is recorded with"
        assert rig.controller.calibration_id == number, "it brings back no calibration of before"
        assert rig._rig is other, "what comes next is judged by it"

    with_running_rig(devices, scene)
    records = list(read_audit(devices.directory / "state"))
    assert (records[0]["rig"], records[0]["version"], records[0]["after"]) == ("own", VERSION, "")
    told = [record["what"] for record in records]
    assert told == ["start", "calibration in use", "write", "plant in use", "end"]


@pytest.mark.parametrize("restarted", [None, Ending(EndCause.MACHINE_BUSY, "anything")])
def test_a_death_of_the_process_before_is_known_to_control_and_to_who_reads(
    devices: OwnDevices, restarted: Ending | None
) -> None:
    """Masters read why the output went off, and control takes no zero of what may be left."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        at = {name: rig._rig.register_map.find(name).address for name in ("fault_code", "warning_word")}
        fault, bits = (int.from_bytes(rig.bank.read_registers(address, 1), "big") for address in at.values())
        assert (fault == FaultCode.MACHINE_BUSY) is bool(bits & WarningBit.RESTARTED) is bool(restarted)

    with_running_rig(devices, scene, restarted)
    [started, *_] = read_audit(devices.directory / "state")
    assert started["after"] == (restarted.sentence if restarted else "")


def test_a_port_that_is_gone_is_known_to_be_gone(devices: OwnDevices) -> None:
    """The cell's before its readings are too old, the output's to whoever asks which watchdogs watch."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert rig._ports.is_guarded and not rig.loop.cell_lost
        gone = PortError("E102", "gone")
        rig._ports.cell._on_lost(gone)
        rig._ports.output._on_lost(gone)
        assert rig.loop.cell_lost and not rig._ports.is_guarded

    with_running_rig(devices, scene)


@pytest.mark.parametrize(("sign", "unit"), [(1, None), (-1, "kg")])
def test_the_cell_is_read_in_the_unit_and_direction_of_the_rigs_file(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch, sign: int, unit: str | None
) -> None:
    """An amplifier that sends bare numbers, read in another unit, is off by ten and nobody sees it before a force."""
    asked: list[tuple[object, ...]] = []

    def read_rig(name: str) -> Rig:
        rig = load_rig(name)
        return replace(rig, load_cell=replace(rig.load_cell, sign=sign, unit=unit))

    monkeypatch.setattr(begun_rig, "load_rig", read_rig)
    monkeypatch.setattr(running_rig, "cell_host", lambda *given: (asked.append(given[1:]), cell_host(*given[:2]))[1])

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert asked == [(sign, unit)]

    with_running_rig(devices, scene)
