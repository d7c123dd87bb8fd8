"""What of a rig's line is told though every other device was asked behind its own: without a port."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from gateway.cli.setup import port_probing as probing
from gateway.profiles import load_rig
from gateway.service.probing.port_probe import PortReport, Stranger

LINE = load_rig("irc5-cell").output
PORT = LINE.port or ""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[PortReport]:
    """What each probe of the port gives, one after the other."""
    reports: list[PortReport] = []
    given: Iterator[PortReport] = iter(reports)
    monkeypatch.setattr(probing, "probe_path", lambda *_, **__: next(given))
    return reports


def test_what_the_rig_s_own_device_calls_itself_is_told(asked: list[PortReport]) -> None:
    """It answers in the words of its profile, and only by its own: "no known device answered" sends people to the wires."""
    stranger = Stranger(LINE.device, LINE.settings, "ITV9999")
    asked += [PortReport(PORT, strangers=[stranger], heard={"9600 8N1": b"ITV9999\r\n"}), PortReport(PORT)]
    report = probing.probe_line(LINE, [])
    assert report.strangers == [stranger] and report.heard["9600 8N1"] == b"ITV9999\r\n"
    (told,) = [one for one in probing.tell_report(report, LINE) if not one.startswith("W332")]
    assert told.startswith(
        f"E113 {PORT}: a device answers smc-itv-rc's question at 9600 8N1 and says that it is ITV9999"
    )


def test_that_the_rig_s_own_device_says_no_or_cannot_be_asked_is_told(asked: list[PortReport]) -> None:
    refusal = Stranger(LINE.device, LINE.settings, "UNKNOWN COMMAND!")
    asked += [PortReport(PORT, refusals=[refusal], heard={"9600 8N1": b"UNKNOWN COMMAND!\r\n"}), PortReport(PORT)]
    assert "one says no in the words of smc-itv-rc" in next(probing.tell_report(probing.probe_line(LINE, []), LINE))
    asked += [PortReport(PORT, unasked=("smc-itv-rc",)), PortReport(PORT)]
    assert "smc-itv-rc has no question that changes nothing" in next(
        probing.tell_report(probing.probe_line(LINE, []), LINE)
    )


@pytest.mark.parametrize("has_port", [True, False])
def test_a_valve_with_a_port_of_its_own_is_asked_too(has_port: bool) -> None:
    """Of a rig that pulls it was the third line, and its wires are crossed as easily as the others'."""
    rig = load_rig("paper-pull")
    assert rig.valve
    own = replace(rig.valve, port="/dev/ttyUSB2" if has_port else None)
    output, cell = replace(rig.output, port="/dev/ttyUSB0"), replace(rig.load_cell, port="/dev/ttyUSB1")
    real = replace(rig, simulated=False, output=output, load_cell=cell, valve=own)
    expected = [("output", output), ("load_cell", cell), *([("valve", own)] if has_port else [])]
    assert list(probing.lines_to_probe(real)) == expected
