"""What changes in a running rig is known to all of its parts at once."""

import socket
from dataclasses import replace

from gateway.audit.audit_reader import read_audit
from gateway.plants.in_use import in_use_facts
from gateway.ports import PortError
from gateway.service.running_rig.running_rig import RunningRig
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig.test_running_rig import devices, with_running_rig

__all__ = ["devices"]


def test_another_calibration_or_plant_is_known_everywhere_at_once(devices: OwnDevices) -> None:
    """Control, registers, recordings and audit must not speak of two."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        activation, recordings = rig._calibrations._activation, rig._recordings
        number = activation.store.add(replace(rig._rig.calibration, name="another"))
        address = rig._rig.register_map.find("calibration_id").address
        assert int.from_bytes(rig.bank.read_registers(address, 1), "big") != number
        rig._on_calibration(activation.use(number, None))
        shown = rig.bank.read_registers(address, 1)
        assert int.from_bytes(shown, "big") == rig.controller.calibration_id == recordings.calibration.number == number
        recordings.plant_in_use = {"number": 99}
        rig._on_plant(rig._rig)
        assert recordings.plant_in_use == in_use_facts(rig._rig)

    with_running_rig(devices, scene)
    told = [record["what"] for record in read_audit(devices.directory / "state")]
    assert told == ["start", "calibration in use", "plant in use", "end"]


def test_a_port_that_is_gone_is_known_to_be_gone(devices: OwnDevices) -> None:
    """The cell's before its readings are too old, the output's to whoever asks which watchdogs watch."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert rig._ports.is_guarded and not rig.loop.cell_lost
        gone = PortError("E102", "gone")
        rig._ports.cell._on_lost(gone)
        rig._ports.output._on_lost(gone)
        assert rig.loop.cell_lost and not rig._ports.is_guarded

    with_running_rig(devices, scene)
