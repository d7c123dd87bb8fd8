"""The first minute: a real Modbus client commands newtons and the measured force follows."""

import shutil
import subprocess
import time

import pytest
from pyModbusTCP.client import ModbusClient

OFF, READY, RAMPING, HOLDING, FAULT = range(5)


def reaching_twelve_s(running, address):
    subprocess.run(["mbpoll", "-1", "-r", "1", *address, "1", "1200"], check=True, capture_output=True)
    time_of_write_s = time.monotonic()
    running.wait_until(lambda status: abs(status["force_measured"] - 1200) <= 100, within_s=5.0)
    return time.monotonic() - time_of_write_s


def test_mbpoll_commands_twelve_newton_and_reads_it_back_within_a_second(running):
    if not shutil.which("mbpoll"):
        pytest.skip("mbpoll is not installed (Debian package mbpoll)")
    address = ["-p", str(running.port), "127.0.0.1"]
    took_s = reaching_twelve_s(running, address)
    if took_s > 1.0:  # the plant takes 0.66 s of it; a machine that is busy gets a second try
        running.rest()
        took_s = reaching_twelve_s(running, address)
    print(f"within 1 N of 12 N after {took_s:.3f} s")
    assert took_s <= 1.0
    running.wait_until(lambda status: status["state"] == HOLDING)  # at the band's edge the noise decides
    shown = subprocess.run(
        ["mbpoll", "-1", "-r", "103", "-c", "1", *address], check=True, capture_output=True, text=True
    ).stdout
    measured = int(shown.split("[103]:")[1].split()[0])
    assert abs(measured - 1200) <= 100


@pytest.mark.parametrize(
    "steps", [(500, 1000, 1500, 2000, 2500, 3000, 3500, 4000), (2000, 1200, 2600, 1600, 3000, 400)]
)
def test_steps_and_partial_reversals_settle_within_one_newton(rested, steps):
    for setpoint in (*steps, *reversed(steps)):
        assert not rested.write(0, 1, setpoint).isError()
        rested.wait_until(lambda status, wanted=setpoint: abs(status["force_measured"] - wanted) <= 100, within_s=2.0)
        rested.wait_until(lambda status: status["state"] == HOLDING, within_s=3.0)
        assert abs(rested.force_n() - setpoint / 100) <= 1.0


def test_a_client_written_elsewhere_reads_and_writes(rested):
    client = ModbusClient(host="127.0.0.1", port=rested.port, unit_id=1, auto_open=True)
    assert client.write_multiple_registers(0, [1, 800])
    assert client.read_holding_registers(0, 2) == [1, 800]
    client.close()
    rested.wait_until(lambda status: abs(status["force_measured"] - 800) <= 100)


def test_disable_drops_the_output_to_the_safe_voltage_and_off(rested):
    rested.write(0, 1, 1500)
    rested.wait_until(lambda status: status["force_measured"] > 1000)
    rested.write(0, 0)
    status = rested.wait_until(lambda status: status["state"] == OFF)
    assert status["output_voltage"] == 0
    assert rested.words(0, 2) == [0, 0]
    rested.wait_until(lambda status: abs(status["force_measured"]) < 200)


def test_a_refused_setpoint_changes_nothing_and_says_why(rested):
    rested.write(0, 1, 1200)
    refused = rested.write(1, 6500)
    assert refused.isError()
    assert refused.exception_code == 3
    assert rested.words(0, 2) == [1, 1200]
    address, reason, _, _ = rested.words(118, 4)
    assert (address, reason) == (1, 5)
