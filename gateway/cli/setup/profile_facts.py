"""What `check` says of a profile without faults, in a few lines: enough to see that it is the one that was meant."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from gateway.bsfm import Calibration
    from gateway.devices import DeviceProfile
    from gateway.profiles import Checked, PlantProfile, Rig
    from gateway.registers import RegisterMap


def facts(checked: "Checked", *, whole: bool = False) -> dict[str, str]:
    """Return facts of a profile for the terminal, name -> words. whole: the fingerprint in full."""
    if checked.kind == "rig":
        return _rig(checked.value) | ({"fingerprint": checked.value.fingerprint} if whole else {})
    told = {checked.kind: _FACTS_OF[checked.kind](checked.value)}
    return told | (_sentences(checked.value) if checked.kind == "device" else {})


def _rig(rig: "Rig") -> dict[str, str]:
    limits = rig.control.limits
    return {
        "rig": f"{rig.name}: {rig.description}" + (" (simulated)" if rig.simulated else ""),
        "output": f"{rig.output.device.name}, {rig.output.baud} baud, {rig.output.port or 'simulated'}",
        "load_cell": f"{rig.load_cell.device.name}, {rig.load_cell.baud} baud, {rig.load_cell.port or 'simulated'}",
        **(
            {"valve": f"{rig.valve.device.name}, {rig.valve.baud} baud, {rig.valve.port or 'simulated'}"}
            if rig.valve
            else {}
        ),
        "calibration": f"{rig.calibration.name}, {rig.calibration.kind}",
        "limits": f"0 .. {limits.force_max_n:g} N, {limits.voltage_min_v:g} .. {limits.voltage_max_v:g} V",
        "modbus tcp": f"{rig.network.bind}:{rig.network.port}" if rig.network.plain else "off (network.plain: false)",
        **{
            f"serial:{place}": f"modbus rtu, {face.port or 'pseudo-terminal'}, {face.settings}, unit {face.unit}"
            for place, face in enumerate(rig.fieldbus, start=1)
            if face.type == "rtu"
        },
        **{
            f"fieldbus[{place}]": f"modbus tls, {face.bind}:{face.port}, {face.certificate}"
            for place, face in enumerate(rig.fieldbus)
            if face.type == "tls"
        },
        "fingerprint": rig.fingerprint[:16],
    }


def _device(device: "DeviceProfile") -> str:
    words = "asked" if device.read_force or device.read_valve else f"{device.rate_hz:g} readings/s"
    if device.set_voltage:
        low_v, high_v = device.voltage_range_v
        words = f"{low_v:g} .. {high_v:g} V"
    return f"{device.name}: {device.role}, {device.serial}, {words}; {device.hardware} ({device.certainty})"


def _sentences(device: "DeviceProfile") -> dict[str, str]:
    """What goes over the wire, to lay beside the manual, and what of a reading is not listened to."""
    from gateway.cli.setup.wire_example import example, manual_numbers, read_over

    told = {"on the wire": example(device), "read over": ", ".join(read_over(device))}
    told["register"] = "; ".join(manual_numbers(device))
    return {name: words for name, words in told.items() if words}


def _plant(plant: "PlantProfile") -> str:
    return f"{plant.name}: {plant.description}"


def _calibration(calibration: "Calibration") -> str:
    low_n, high_n = calibration.model().force_range_n
    return (
        f"{calibration.name}: {calibration.kind}, {low_n:.1f} .. {high_n:.1f} N, made on {calibration.rig or 'no rig'}"
    )


def _registers(register_map: "RegisterMap") -> str:
    return f"{register_map.name}: version {register_map.version}, {len(register_map.registers)} registers"


def _plan(plan: Any) -> str:
    from gateway.control.runs.experiment_plan import ExperimentPlan

    if isinstance(plan, ExperimentPlan):
        return f"{plan.name}: an experiment of {len(plan.parts)} parts"
    return f"a ladder of {plan.groups} groups in steps of {plan.step_v:g} V"


_FACTS_OF: Final[dict[str, Callable[[Any], str]]] = {
    "device": _device,
    "plant": _plant,
    "calibration": _calibration,
    "registers": _registers,
    "plan": _plan,
}
