"""A gateway with a serial face beside Modbus TCP: mbpoll on the one, a second master on the other, one owner."""

import shutil
import subprocess
from collections.abc import Iterator

import pytest
from pymodbus.client import ModbusSerialClient

from tests.end_to_end.conftest import RunningGateway, start, stop

OWNER_IP = 116


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    gateway = start(tmp_path_factory.mktemp("serial face") / "state", "--sim", "--rtu")
    yield gateway
    assert stop(gateway) == 0


def rtu_path(gateway: RunningGateway) -> str:
    tcp, rtu = gateway.ready["faces"]
    assert (tcp["type"], tcp["port"]) == ("tcp", gateway.ready["modbus"][1])
    assert (rtu["type"], rtu["unit"], rtu["baud"], rtu["parity"]) == ("rtu", 1, 19200, "even")
    return str(rtu["port"])


def test_two_masters_on_two_faces_share_one_owner(both: RunningGateway) -> None:
    serial = ModbusSerialClient(rtu_path(both), baudrate=19200, timeout=5, retries=0)
    assert serial.connect()
    try:
        assert not serial.write_registers(0, [1, 1200], device_id=1).isError()
        both.wait_until(lambda status: abs(status["force_measured"] - 1200) < 100)
        assert both.words(OWNER_IP, 2) == [0, 1]
        assert both.write(1, 1500).exception_code == 6, "the other face's master may read"
        assert not both.write(0, 0x9, 1500).isError(), "and take over"
        assert both.words(OWNER_IP, 2) == [0x7F00, 1]
        assert serial.write_registers(1, [900], device_id=1).exception_code == 6
        assert not serial.write_register(0, 0, device_id=1).isError(), "anybody may stop"
        both.wait_until(lambda status: status["state"] == 0)
        assert both.words(OWNER_IP, 2) == [0, 0]
    finally:
        serial.close()


def test_mbpoll_commands_a_force_over_rtu(both: RunningGateway) -> None:
    if not shutil.which("mbpoll"):
        pytest.skip("mbpoll is not installed: the foreign RTU master was not tried")
    line = ["mbpoll", "-m", "rtu", "-b", "19200", "-P", "none", "-a", "1", "-1", "-q", "-o", "5"]
    path = rtu_path(both)
    subprocess.run([*line, "-r", "1", path, "1", "1100"], check=True, capture_output=True, timeout=30)
    both.wait_until(lambda status: abs(status["force_measured"] - 1100) < 100)
    read = subprocess.run([*line, "-r", "2", path], check=True, capture_output=True, text=True, timeout=30).stdout
    assert "[2]: \t1100" in read
    subprocess.run([*line, "-r", "1", path, "0", "0"], check=True, capture_output=True, timeout=30)
    both.wait_until(lambda status: status["state"] == 0)
