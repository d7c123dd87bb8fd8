"""A start that cannot be: what was seen, what it probably is, and an exit code that a service manager understands."""

import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.end_to_end.conftest import RunningGateway, start, stop

DEVICE, PERMISSION, CONFIGURATION = 69, 77, 78


def ended(rig: str | Path, state: Path, *options: str, bind: str = "127.0.0.1:0") -> tuple[int, str]:
    """Exit code and stderr of a gateway that does not come up."""
    words = ["run", str(rig), "--bind", bind, "--state", str(state), *options]
    done = subprocess.run([sys.executable, "-m", "gateway", *words], capture_output=True, text=True, timeout=30)
    assert done.stdout == ""
    return done.returncode, done.stderr


def own_rig(directory: Path, **changes: str) -> Path:
    """The demo rig with other lines."""
    text = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text()
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new, 1)
    (directory / "mine.yaml").write_text(text)
    return directory / "mine.yaml"


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int, str]:
    """A rig of two faults, which are told in one go: its file, the exit code, and what was said."""
    directory = tmp_path_factory.mktemp("faulty")
    changes = {"value": ("baud: 9600", "baud: 9700"), "key": ("  baud: 115200", "  buad: 115200")}
    rig = own_rig(directory, name=("name: demo", "name: mine"), **changes)
    return rig, *ended(rig, directory / "state")


def test_a_typo_in_the_rig_has_its_place_and_a_proposal(faulty: tuple[Path, int, str]):
    rig, code, said = faulty
    assert code == CONFIGURATION
    line = rig.read_text().splitlines().index("  buad: 115200") + 1
    assert re.search(rf"mine\.yaml:{line}:\d+.*did you mean", said)
    assert "Traceback" not in said


def test_a_value_that_is_not_allowed_names_the_allowed_ones(faulty: tuple[Path, int, str]):
    rig, code, said = faulty
    assert code == CONFIGURATION
    line = rig.read_text().splitlines().index("  baud: 9700") + 1
    assert f"mine.yaml:{line}:" in said
    assert "9600" in said
    assert "9700" in said


def test_a_rig_that_is_not_there_is_a_configuration_error(tmp_path: Path):
    code, said = ended("demmo", tmp_path / "state")
    assert code == CONFIGURATION
    assert "demo" in said


def test_a_missing_port_is_named_with_what_is_present(tmp_path: Path):
    code, said = ended("irc5-cell", tmp_path / "state")
    assert code == DEVICE
    assert said.startswith("E102 /dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A10K1ITV-if00-port0 is not there")
    assert "Traceback" not in said
    assert len(said.splitlines()) == 1


def test_a_port_of_this_machine_that_is_taken_says_what_to_do(tmp_path: Path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        bind = f"127.0.0.1:{taken.getsockname()[1]}"
        code, said = ended("demo", tmp_path / "state", bind=bind)
    assert code == DEVICE
    assert said.startswith(f"E121 cannot listen on {bind}")


def test_every_address_is_refused_without_an_allow_list(tmp_path: Path):
    code, said = ended("demo", tmp_path / "state", bind="0.0.0.0:0")
    assert code == CONFIGURATION
    assert "allow" in said


def test_a_port_below_1024_needs_a_capability(tmp_path: Path):
    if os.geteuid() == 0:
        pytest.skip("root may bind any port; as another user this test binds 127.0.0.1:502")
    code, said = ended("demo", tmp_path / "state", bind="127.0.0.1:502")
    assert code == PERMISSION
    assert said.startswith("E120")


def test_a_wrong_baud_is_found_and_named_before_ready(tmp_path: Path):
    rig = own_rig(
        tmp_path,
        name=("name: demo", "name: mine"),
        value=("  device: smc-itv-rc\n  baud: 9600", "  device: smc-itv-rc\n  baud: 38400"),
    )
    gateway = start(tmp_path / "state", rig=str(rig))
    try:
        (note,) = [note for note in gateway.ready["notes"] if "E11" in note]
        assert note.startswith("E110 ")
        assert "0 valid lines at 38400; at 9600 the same device gives valid lines" in note
        assert gateway.write(0, 1, 1000).exception_code in (4, 6)
        assert gateway.status()["state"] == 0
    finally:
        stop(gateway)


def test_one_command_without_a_heartbeat_is_a_lost_master_where_there_is_a_lease(tmp_path: Path):
    text = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text()
    text = text.replace("name: demo", "name: leased").replace("lease_s: null", "lease_s: 0.3")
    (tmp_path / "leased.yaml").write_text(text)
    gateway = start(tmp_path / "state", "--sim", rig=str(tmp_path / "leased.yaml"))
    try:
        assert not gateway.write(0, 1, 1000).isError()
        said = gateway.said("A310", within_s=5.0)
        assert "master lost" in said
        assert "heartbeat unchanged for 3" in said
        assert gateway.status()["output_voltage"] == 0
    finally:
        stop(gateway)


@pytest.fixture(scope="module")
def deep(tmp_path_factory: pytest.TempPathFactory):
    """A gateway whose state directory is too deep for any Unix socket."""
    state = tmp_path_factory.mktemp("deep") / ("d" * 60) / ("e" * 60) / "state"
    state.parent.mkdir(parents=True)
    (state / "recordings").parent.mkdir()
    (state / "recordings").write_text("a file where the directory should be")
    gateway = start(state, "--sim", "--record")
    yield gateway
    stop(gateway)


def test_a_second_gateway_on_the_same_state_is_refused(deep: RunningGateway):
    code, said = ended("demo", deep.state)
    assert code == DEVICE
    assert said.startswith("E104 another gateway already runs on")
    assert deep.status()["state"] == 0, "the first one goes on"


def test_a_state_directory_too_deep_for_a_socket_is_a_note_and_no_end(deep: RunningGateway):
    (note,) = [note for note in deep.ready["notes"] if "control.sock" in note]
    assert "107" in note
    assert "rig.sock" in deep.said("107")
    assert not deep.write(0, 1, 1000).isError()
    deep.wait_until(lambda status: abs(status["force_measured"] - 1000) <= 100)


def test_a_recording_that_cannot_be_made_is_a_note_and_no_end(deep: RunningGateway):
    assert [note for note in deep.ready["notes"] if note.startswith("not recording")]
