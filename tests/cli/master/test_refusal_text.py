"""A write that is refused ends with 1 and says why: by the registers, and on its machine in the gateway's own words."""

from pathlib import Path

import pytest

from gateway.cli.errors import CliError
from gateway.cli.master import local_gateways
from gateway.cli.master.wires import RtuWire, TcpWire, Wire
from gateway.codes.refusals import RefusalReason
from gateway.devices.line_settings import SerialSettings
from gateway.modbus import ModbusError, Peer, Role
from gateway.registers import BankRules, RegisterBank, RegisterMap
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.proposed_write import EdgeRefusal
from tests.cli.conftest import PlainBank

OWN = "tare refused: 1.56 V are out: disable the output or set the force to 0 first"


@pytest.fixture
def gateway(register_map: RegisterMap, serve) -> str:
    bank = RegisterBank(register_map, BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0)
    bank.on_asked = lambda requests: EdgeRefusal(RefusalReason.TARE_REFUSED, ControlBit.TARE, OWN)
    address: str = serve(bank).address
    return address


def answering(answers: dict[str, dict[str, object]]):
    """Stands for the control sockets of this machine, by the name of their directory."""

    def ask(state: Path, request: dict[str, str]) -> dict[str, object]:
        if state.name not in answers:
            raise CliError("E140 nobody there")
        return answers[state.name]

    return ask


def test_elsewhere_the_registers_say_why_and_what_to_do(gateway: str, call, monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    answer = call("write", "control_word=tare", "--gateway", gateway)
    assert answer.exit_code == 1
    assert answer.stdout == ""
    first, cure = answer.stderr.strip().split("\n")
    assert first.startswith(
        "W303 tare refused: exception 04 (device or state forbids it) to write 1 at 0; control_word = 4"
    )
    assert "force-gateway explain W303" in cure


def test_what_the_registers_tell_of_another_request_explains_nothing(
    register_map: RegisterMap, serve, call, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    bank = PlainBank(register_map)
    bank.set("refusal_address", 1)
    bank.set("refusal_reason", RefusalReason.OUT_OF_RANGE)
    monkeypatch.setattr(bank, "write_registers", refuse_without_a_word)
    answer = call("write", "payload=200", "--gateway", serve(bank).address)
    assert answer.exit_code == 1 and "exception 04" in answer.stderr and "force_setpoint" not in answer.stderr


def refuse_without_a_word(address: int, data: bytes, peer: Peer) -> None:
    raise ModbusError(4, "no")


def test_who_may_not_calibrate_is_told_which_role_it_takes(
    register_map: RegisterMap, serve, call, monkeypatch, tmp_path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    bank = RegisterBank(register_map, BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0)
    answer = call("calibrate", "--yes", "--gateway", serve(bank, role=Role.MONITOR).address)
    assert answer.exit_code == 1
    assert answer.stderr.startswith(
        "W211 role too low: exception 01 (function not served) to write 5 at 0; control_word"
    )
    assert "Connect with a certificate of the role" in answer.stderr


@pytest.mark.parametrize("given", [True, False], ids=["--state", "where run puts it"])
def test_on_its_machine_the_gateway_says_it_itself(
    gateway: str, call, monkeypatch, tmp_path: Path, given: bool
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    for name in ("another", "demo"):
        (tmp_path / "force-gateway" / name).mkdir(parents=True)
        (tmp_path / "force-gateway" / name / "control.sock").touch()
    another = {"address": 1, "reason": 5, "sentence": "W204 of another gateway"}
    own = {"address": 0, "reason": int(RefusalReason.TARE_REFUSED), "sentence": f"W303 {OWN}"}
    monkeypatch.setattr("gateway.cli.control_socket.ask", answering({"another": another, "demo": own}))
    options = ("--state", str(tmp_path / "force-gateway" / "demo")) if given else ()
    answer = call("write", "control_word=tare", "--gateway", gateway, *options)
    assert answer.exit_code == 1
    assert answer.stderr.split("\n")[0] == f"W303 {OWN}"
    assert "another gateway" not in answer.stderr


def test_only_a_gateway_of_this_machine_is_asked_for_its_words(tmp_path: Path) -> None:
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "control.sock").touch()

    def is_asked(wire: Wire) -> bool:
        return bool(local_gateways.sockets_near(wire, tmp_path))

    assert all(is_asked(TcpWire(host, 5020)) for host in ("127.0.0.1", "::1", "localhost"))
    assert not any(is_asked(TcpWire(host, 5020)) for host in ("10.0.0.7", "cell-3"))
    assert is_asked(RtuWire("/dev/ttyS9", SerialSettings(baud=19200))), "the other end of a line is not known"


def test_directories_of_another_user_are_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A `write` that was refused ended with E105, of the folder, and without the reason."""

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied", str(tmp_path))

    monkeypatch.setattr(Path, "glob", refuse)
    assert local_gateways.sockets_near(TcpWire("127.0.0.1", 5020), tmp_path) == []


def test_a_user_without_a_home_has_no_gateways_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a container by a number alone `hold`, `read` and `self-test` ended with E106, although they had the address."""

    def refuse() -> Path:
        raise RuntimeError

    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", refuse)
    wire, root = TcpWire("127.0.0.1", 5020), local_gateways.usual_root()
    assert (root, local_gateways.running_behind(wire, root), local_gateways.tell_running(wire)) == (None, None, "")


@pytest.mark.parametrize(
    ("low_n", "high_n", "said"),
    [
        (0.0, 50.0, "W204 force_setpoint = 65.00 N: allowed 0 .. 50 N by the calibration in use"),
        (1.0, 65.2, "W204 force_setpoint = 65.00 N: beyond the rig's own limit"),
        (0.0, 0.0, "W204 value out of range: exception 03"),
        (70.0, 80.0, "W204 force_setpoint = 65.00 N: the calibration in use is for 70 N and more; 0 is taken"),
    ],
)
def test_a_limit_that_only_registers_can_tell_is_told(
    low_n: float, high_n: float, said: str, fake, call, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    fake.bank.refuse[1] = (3, RefusalReason.OUT_OF_RANGE)
    fake.bank.set("force_low@active", low_n)
    fake.bank.set("force_high@active", high_n)
    answer = call("write", "force_setpoint=65", "--gateway", fake.address)
    assert answer.exit_code == 1
    assert answer.stderr.startswith(said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("hold", "400"), "400 N: allowed 0 .. 327.67 N"),
        (("hold", "-3"), "-3 N: allowed 0 .. 327.67 N"),
        (("hold", "--", "nan"), "nan N: allowed 0 .. 327.67 N"),
        (("write", "force_setpoint=400"), "force_setpoint: 400 N: allowed 0 .. 327.67 N"),
        (("write", f"force_setpoint={'9' * 400}"), "force_setpoint: inf N: allowed 0 .. 327.67 N"),
        (("write", f"control_word={'9' * 400}"), "control_word = inf is not a whole number"),
        (("write", "voltage_setpoint=99999"), "voltage_setpoint: 99999 mV: allowed 0 .. 10000 mV"),
        (("write", "force_setpoint=nan"), "force_setpoint: nan is not a number in N"),
        (("write", "force_setpoint@float_abcd=1e39"), "force_setpoint@float_abcd: 1e+39 N: allowed 0 .. 327.67 N"),
        (("write", "control_word@float_abcd=1e39"), "control_word@float_abcd: 1e+39: allowed 0 .. 65535"),
        (("write", "rising_b_0@staging=-1e39"), "rising_b_0@staging: -1e+39 does not fit in float32"),
        (("hold", "8,5"), "8,5 is not a number; decimals take a point: 8.5"),
        (("hold", "8N"), "8N is not a number"),
        (("hold", "8", "--for", "0"), "0 is no time such as 10s, 500ms or 2min"),
        (("calibrate", "--step", "0,5"), "0,5 is not a number; decimals take a point: 0.5"),
        (("diagnose", "1", "--noise-floor-n", "0,1"), "0,1 is not a number; decimals take a point: 0.1"),
        (("recordings", "prune", "--days", "nan"), "nan: allowed above 0"),
        (("monitor", "--once", "--seconds", "nan"), "nan: allowed at least 0"),
        (("ports", "--listen", "--seconds", "nan"), "nan: allowed 0.1 .. 60"),
        (("calibrate", "--groups", "500"), "500: allowed 1 .. 100"),
        (("calibrate", "--step", "0.001"), "0.001 V: allowed at least 0.01 V"),
        (("calibrate", "--v-max", "nan"), "nan V: allowed at least 0.1 V"),
        (("calibrate", "--v-max", "inf"), "inf is not a finite number"),
        (("calibrate", "--step", "1e400"), "1e400 is not a finite number"),
    ],
)
def test_what_no_gateway_can_take_is_refused_with_what_is_allowed(words: tuple[str, ...], said: str, call) -> None:
    answer = call(*words)
    assert answer.exit_code == 2
    assert said in answer.stderr


@pytest.mark.parametrize(
    ("state", "said"),
    [
        (State.HOLDING, "W306 self-test refused: state holding\n"),
        (State.FAULT, "W306 self-test refused: state fault\n"),
        (State.OFF, "W306 self-test refused: exception 04"),
    ],
)
def test_a_state_that_lets_no_run_begin_is_told_by_the_registers(
    state: State, said: str, fake, call, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    fake.bank.refuse[0] = (4, RefusalReason.SELF_TEST_REFUSED)
    fake.bank.set("state", state)
    answer = call("write", "control_word=start_self_test", "--gateway", fake.address)
    assert answer.exit_code == 1
    assert answer.stderr.startswith(said)
