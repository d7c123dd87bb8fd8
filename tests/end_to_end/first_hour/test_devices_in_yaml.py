"""Two devices described in YAML alone, beside their rig: the gateway with its real ports against their far ends on ptys,
and a newcomer's `hold` on top."""

import asyncio
import json
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gateway.codes.faults import FaultCode
from gateway.processes import message_link
from gateway.processes.event_log import EventLog
from gateway.profiles import load_rig
from gateway.service.simulated_rig import serve
from gateway.service.simulation.kept_settings import KeptSettings
from tests.end_to_end.conftest import RunningGateway, start, stop

DAC = r"""
name: my-dac
description: a DAC that answers a setting with one sign, and can be asked nothing
role: output
source: a test
certainty: composed
hardware: never run on hardware
serial: {baud: 57600, data_bits: 8, parity: even, stop_bits: 1}
terminator: "\r"
checksum: dcon-sum
constants: {address: 2}
reply_timeout_s: 0.05
set_voltage: {ask: "#{address:02X}{volts:+07.3f}", answer: ">", range: {device: [0, 10], voltage_v: [0, 10]}}
"""
CELL = r"""
name: my-cell
description: an amplifier that answers when it is asked
role: load cell
source: a test
certainty: composed
hardware: never run on hardware
serial: {baud: 57600}
terminator: "\r\n"
reply_timeout_s: 0.05
read_force: {ask: "W?", frame: "W {force:+08.2f} {remark:4s}"}
"""
RIG = """
name: own
registers: force-v1
calibration: demo
plant: paper-slide
output: {device: my-dac, port: OUTPUT, baud: 57600}
load_cell: {device: my-cell, port: CELL, baud: 57600, unit: N, range_n: 98}
limits: {force_max_n: 40, over_force_n: 55, smallest_force_n: 2, voltage_max_v: 8}
supervision: {lease_s: 1.0, sample_timeout_s: 0.4, output_timeout_s: 0.4, stall_s: 0.5, saturation_n: 96}
accept_no_device_watchdog: true
"""


@contextmanager
def far_ends(folder: Path) -> Iterator[None]:
    """The devices of rig.yaml on two ptys, behind the names that the rig gives; in a thread of the test."""
    ours, theirs = message_link.create_link()
    rig = load_rig(folder / "rig.yaml", simulated=True)
    kept = KeptSettings(folder, "")
    thread = threading.Thread(target=lambda: asyncio.run(serve(rig, theirs, kept, EventLog(), asyncio.Event())))
    thread.start()
    try:
        assert select.select([ours], [], [], 20.0)[0], "the simulated rig tells its ptys"
        message = message_link.receive(ours)
        assert message
        for name, path in message.body["ptys"].items():
            (folder / name).symlink_to(path)
        yield
    finally:
        ours.close()
        thread.join()
        theirs.close()


def hold(gateway: RunningGateway, *options: str) -> subprocess.Popen[str]:
    command = [
        sys.executable,
        "-m",
        "gateway",
        "hold",
        "12",
        "--gateway",
        f"127.0.0.1:{gateway.port}",
        "--json",
        *options,
    ]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_a_device_of_ones_own_holds_a_force_under_a_lease(tmp_path: Path) -> None:
    (tmp_path / "devices").mkdir()
    (tmp_path / "devices" / "my-dac.yaml").write_text(DAC)
    (tmp_path / "my-cell.yaml").write_text(CELL)
    rig = RIG.replace("OUTPUT", str(tmp_path / "output")).replace("CELL", str(tmp_path / "load_cell"))
    (tmp_path / "rig.yaml").write_text(rig)
    with far_ends(tmp_path):
        gateway = start(tmp_path / "state", rig=str(tmp_path / "rig.yaml"))
        try:
            holding = hold(gateway, "--rig", str(tmp_path / "rig.yaml"))
            assert holding.stdout
            seen = [json.loads(line) for line, _ in zip(holding.stdout, range(30), strict=False)]
            assert any(one["in_band"] and abs(one["force_n"] - 12.0) <= 1.0 for one in seen), seen[-1]
            holding.send_signal(signal.SIGINT)
            out, err = holding.communicate(timeout=10)
            assert holding.returncode == 0, err
            assert json.loads(out.splitlines()[-1]) == {"end": "stopped"}
            assert gateway.status()["state"] == 0 and gateway.words(0, 2) == [0, 0]
            said = gateway.log.read_text()
            assert not [fault for fault in FaultCode if fault.code and f" {fault.code} " in said], said
        finally:
            stop(gateway)
