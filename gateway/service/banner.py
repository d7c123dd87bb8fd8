"""What a person reads when the gateway is ready, and what a program reads with --json."""

from dataclasses import dataclass
from typing import Any

from gateway import VERSION
from gateway.profiles import Rig


@dataclass(frozen=True, slots=True)
class Ready:
    """What is known at READY: where Modbus listens, where the devices are and what they last said."""

    rig: Rig
    modbus: tuple[str, int]
    output_port: str
    cell_port: str
    voltage_v: float | None
    force_n: float | None
    notes: tuple[str, ...] = ()


def info(ready: Ready) -> dict[str, Any]:
    """The JSON line's fields, without the pids, which the guardian knows."""
    return {
        "ready": True,
        "rig": ready.rig.name,
        "modbus": list(ready.modbus),
        "web": None,
        "ptys": {"output": ready.output_port, "load_cell": ready.cell_port} if ready.rig.simulated else {},
        "notes": list(ready.notes),
    }


def banner(ready: Ready) -> str:
    rig, (host, port) = ready.rig, ready.modbus
    calibration = rig.calibration
    what = f"simulated, seed {rig.seed}" if rig.simulated else "real devices"
    units = ", ".join(map(str, rig.network.units))
    output, cell = rig.output, rig.load_cell
    elsewhere = "" if (host, port) == ("127.0.0.1", 5020) else f" --gateway {host}:{port}"
    lines = [
        f"force-gateway {VERSION} · rig {rig.name} ({what}) · calibration {calibration.name}: {calibration.kind}",
        f"  modbus tcp   {host}:{port}   units {units}      register table: force-gateway registers",
        f"  output       {ready.output_port:<16} {output.device.name} {output.baud}  {_said(ready.voltage_v, 'V', 3)}",
        f"  load cell    {ready.cell_port:<16} {cell.device.name} {cell.baud}  {_said(ready.force_n, 'N', 2)}",
        f"  lease        {_lease(rig)}",
        f"  try          mbpoll -1 -p {port} -r 1 {host} 1 1200        (enable, 12.00 N)",
        f"               force-gateway write force_setpoint=12 control_word=1{elsewhere}",
        *(f"  note         {note}" for note in ready.notes),
        f"READY  loop {rig.loop_hz:g} Hz · Ctrl-C ramps the force to 0 and stops · not a safety device",
    ]
    return "\n".join(lines)


def _said(value: float | None, unit: str, digits: int) -> str:
    return "silent" if value is None else f"ok   {value:.{digits}f} {unit}"


def _lease(rig: Rig) -> str:
    lease_s = rig.control.supervision.lease_s
    if lease_s is None:
        return (
            "none (demo): a command lasts until the next one"
            if rig.simulated
            else "none: a command lasts until the next one"
        )
    return f"{lease_s * 1e3:.0f} ms, then {rig.control.supervision.lease_action.value}"
