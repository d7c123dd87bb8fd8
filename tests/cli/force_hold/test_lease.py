"""The lease that `hold` keeps is the one of the gateway that it talks to."""

from pathlib import Path
from typing import Any

import pytest

from gateway.cli.errors import CliError
from gateway.cli.force_hold.heartbeat import KnownLease
from gateway.cli.master.wires import TcpWire
from gateway.cli.verbs.operation import hold

HERE = {"rig": "own", "port": 5020, "lease_s": 0.08, "lease_action": "ramp"}


def find_lease(monkeypatch, tmp_path: Path, host: str, answers: dict[str, dict[str, Any] | None]) -> KnownLease | None:
    """What hold makes of these control sockets; None: killed, its socket is left."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    for name in answers:
        (tmp_path / "force-gateway" / name).mkdir(parents=True)
        (tmp_path / "force-gateway" / name / "control.sock").touch()

    def ask(state: Path, request: dict[str, Any]) -> dict[str, Any]:
        assert request == {"do": "running"}
        if (answer := answers[state.name]) is None:
            raise CliError("E140 nobody there")
        return answer

    monkeypatch.setattr("gateway.cli.control_socket.ask", ask)
    return hold._find_gateway_lease(TcpWire(host, 5020))


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_a_gateway_of_this_machine_tells_its_lease(host: str, monkeypatch, tmp_path: Path) -> None:
    other = HERE | {"port": 5021, "lease_s": 5.0}
    result = find_lease(monkeypatch, tmp_path, host, {"another": other, "own": HERE, "killed": None})
    assert result == KnownLease(0.08, "ramp") and result.period_s == pytest.approx(0.02)


def test_a_rig_without_a_lease_says_so(monkeypatch, tmp_path: Path) -> None:
    assert find_lease(monkeypatch, tmp_path, "127.0.0.1", {"own": HERE | {"lease_s": None}}) == KnownLease(None, "ramp")


@pytest.mark.parametrize(
    ("host", "answers"),
    [
        ("10.0.0.7", {"own": HERE}),
        ("127.0.0.1", {}),
        ("127.0.0.1", {"own": {}}),
        ("127.0.0.1", {"own": HERE, "twin": HERE}),
    ],
    ids=["another machine", "nobody", "an older gateway", "two of one port"],
)
def test_what_nobody_says_is_not_guessed(host: str, answers: dict[str, Any], monkeypatch, tmp_path: Path) -> None:
    assert find_lease(monkeypatch, tmp_path, host, answers) is None
