"""The monitor tells what the registers say, at any size, and lives through a gateway that goes away and comes back."""

from io import StringIO
from math import nan
from pathlib import Path

import pytest
from rich.console import Console
from rich.text import Text

from gateway.cli.live_monitor.drawing import big, chart, chart_top_n
from gateway.cli.live_monitor.history import Track, TrackPoint, buckets
from gateway.cli.live_monitor.page import page
from gateway.cli.live_monitor.poll import Poller, WriterSource
from gateway.cli.live_monitor.register_table import View, Writer
from gateway.cli.master.client import GatewayClient, RegisterReading
from gateway.cli.master.wires import TcpWire
from gateway.cli.verbs.operation import monitor
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.modbus import Peer
from gateway.registers import RegisterMap
from gateway.registers.words import State, StatusBit
from gateway.registers.writes.ownership import serial_host

IN_BAND = StatusBit.ENABLED | StatusBit.CONTACT | StatusBit.IN_BAND


def poll_of(register_map: RegisterMap, **values: float) -> list[RegisterReading]:
    """What a poll brings: every register of both blocks, 0 where no value is given."""
    readings = []
    for block in ("command", "status"):
        for register in register_map.registers_of(block):
            data = register.encode(values.get(register.name, 0))
            words = tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))
            readings.append(RegisterReading(register, register.decode(data), words))
    return readings


@pytest.fixture
def holding(register_map: RegisterMap) -> Track:
    track = Track()
    for tick in range(50):
        track.add(tick * 0.1, poll_of(register_map, force_measured=0, force_requested=0, status_word=StatusBit.ENABLED))
    for tick in range(50, 300):
        force_n = 12 - 10 * 0.8 ** (tick - 50)
        status = IN_BAND if force_n > 11 else StatusBit.ENABLED
        readings = poll_of(
            register_map,
            force_measured=force_n,
            force_requested=12,
            force_setpoint=12,
            output_voltage=1555,
            state=State.HOLDING if status == IN_BAND else State.RAMPING,
            status_word=status,
        )
        track.add(tick * 0.1, readings)
    return track


def text_of(view: View) -> list[str]:
    console = Console(width=view.width, height=view.height, file=StringIO(), color_system=None)
    console.print(Text("\n").join(page(view)))
    return console.file.getvalue().rstrip("\n").split("\n")


def test_settling_counts_from_the_setpoint_to_the_band(holding: Track) -> None:
    assert holding.settling.is_settled
    assert holding.settling.after_s == pytest.approx(1.1, abs=0.11)  # 0.8 ** 11 = 0.086
    assert holding.largest_error_n(5.0) < 0.01
    assert holding.largest_error_n(60.0) == pytest.approx(0.86, abs=0.05)


def test_leaving_the_band_forgets_the_settling_and_coming_back_counts_from_the_setpoint(
    holding: Track, register_map: RegisterMap
) -> None:
    holding.add(30.0, poll_of(register_map, force_requested=12, force_measured=9, status_word=StatusBit.ENABLED))
    assert not holding.settling.is_settled
    holding.add(31.0, poll_of(register_map, force_requested=12, force_measured=11.9, status_word=IN_BAND))
    assert holding.settling.after_s == pytest.approx(26.0)


def test_a_pull_that_is_held_has_no_error_though_its_force_is_negative(register_map: RegisterMap) -> None:
    track = Track()
    pulls = {"force_requested": 15, "force_measured": -14.98, "status_word": IN_BAND | StatusBit.PULLING}
    for tick in range(20):
        track.add(tick * 0.1, poll_of(register_map, **pulls))
    assert track.value("force_measured") == pytest.approx(-14.98)
    assert track.largest_error_n(5.0) == pytest.approx(0.02, abs=1e-6)
    assert track.points[-1].measured_n == pytest.approx(14.98), "the chart begins at 0 N"


def test_what_settled_before_the_monitor_has_no_settling_time(register_map: RegisterMap) -> None:
    track = Track()
    track.add(5.0, poll_of(register_map, force_measured=12, force_requested=12, status_word=IN_BAND))
    assert track.settling.is_settled
    assert track.settling.after_s is None


def test_the_age_of_a_change_is_known_only_once_it_was_seen(holding: Track) -> None:
    assert holding.change_age_s("mode") is None
    assert holding.change_age_s("force_setpoint") == pytest.approx(29.9 - 5.0)


def test_a_minute_is_kept_and_no_more(register_map: RegisterMap) -> None:
    track = Track()
    for tick in range(2000):
        track.add(tick * 0.1, poll_of(register_map))
    assert len(track.points) <= 602


def test_buckets_are_means_with_the_newest_at_the_right() -> None:
    points = [
        TrackPoint(0.0, 1.0, 0.0),
        TrackPoint(59.0, 4.0, 5.0),
        TrackPoint(59.5, 6.0, 5.0),
        TrackPoint(59.9, nan, 5.0),
    ]
    assert buckets(points, 60.0, 6) == [None] * 5 + [TrackPoint(59.5, 5.0, 5.0)]
    assert buckets(points, 59.9, 6)[0] == TrackPoint(0.0, 1.0, 0.0)


@pytest.mark.sampled
@pytest.mark.parametrize(("width", "height"), [(80, 24), (81, 25), (100, 30), (112, 34), (160, 50), (240, 70)])
def test_a_frame_fits_any_terminal_from_80_by_24(width: int, height: int, holding: Track) -> None:
    for writers in (None, {"command": Writer("192.168.125.101", "50001", 3.0)}):
        lines = text_of(View(holding, "127.0.0.1:5020", width, height, "", writers))
        assert len(lines) <= height
        assert max(map(len, lines)) <= width
        for word in ("HOLDING", "in band", "settled in 1.1 s", "measured N", "12.00 N", "04B0", "holding"):
            assert any(word in line for line in lines), word
        assert any("192.168.125.101" in line for line in lines) == (writers is not None)


def test_a_fault_and_a_warning_say_what_to_do(register_map: RegisterMap) -> None:
    track = Track()
    readings = poll_of(
        register_map, state=State.FAULT, fault_code=FaultCode.CELL_LOST, warning_word=WarningBit.TARGET_UNREACHABLE
    )
    track.add(0.0, readings)
    text = "\n".join(text_of(View(track, "here", 120, 40)))
    assert "FAULT" in text
    assert "A318 load cell's port lost  Plug it in again" in text
    assert "A301 target unreachable  Open the air supply" in text


def test_many_warnings_do_not_push_the_table_out(register_map: RegisterMap) -> None:
    track = Track()
    track.add(0.0, poll_of(register_map, warning_word=sum(WarningBit), fault_code=1, state=4))
    lines = text_of(View(track, "here", 80, 24))
    assert len(lines) == 23
    assert sum("force_setpoint" in line for line in lines) == 1
    assert any("more: force-gateway read warning_word" in line for line in lines)


def test_what_is_not_available_is_not_drawn_as_zero(register_map: RegisterMap) -> None:
    track = Track()
    track.add(0.0, poll_of(register_map, force_measured=nan, output_voltage=nan))
    assert "–" in "\n".join(text_of(View(track, "here", 80, 24)))


@pytest.mark.parametrize("value", [0.0, 9.99, -0.02, 12.34, -12.34, 123.45, -327.67])
def test_big_digits_lose_decimals_before_they_lose_their_meaning(value: float) -> None:
    rows = [row.plain for row in big(value, 2, width=18, style="")]
    assert len(rows) == 3
    assert all(len(row) <= 18 for row in rows)


def test_the_chart_grows_with_the_force() -> None:
    points = [TrackPoint(0.0, force_n, 10.0) for force_n in (0.0, 2.5, 5.0, 7.5, 10.0)]
    columns = ["".join(column) for column in zip(*(row.plain for row in chart(points, 3, 10.0)), strict=True)]
    heights = [sum(" ▁▂▃▄▅▆▇█".find(cell) for cell in column if cell in "▁▂▃▄▅▆▇█") for column in columns]
    assert heights == [0, 6, 12, 18, 24]
    assert columns[0][0] == "─"  # the setpoint's line, where no column hides it
    assert chart_top_n(points) == 20.0


def test_once_prints_one_frame(fake, call) -> None:
    fake.bank.set("state", State.HOLDING)
    answer = call("monitor", "--once", "--gateway", fake.address)
    assert answer.exit_code == 0, answer.output
    assert answer.output.count("HOLDING") == 1
    assert len(answer.output.splitlines()) <= 24


def test_a_smaller_map_is_shown_as_far_as_it_goes(fake, call, tmp_path: Path) -> None:
    """As profiles/README.md promises; it was an internal error."""
    (tmp_path / "small.yaml").write_text(
        "name: small\nversion: 1\ntext: of a display\nblocks:\n  status:\n    first: 100\n    last: 110\n    registers:\n"
        "      - {name: state, address: 101, type: uint16, values: state, text: State}\n"
        "      - {name: force_measured, address: 102, type: int16, scale: 0.01, unit: N, text: Force}\n"
    )
    fake.bank.set("state", State.HOLDING)
    fake.bank.set("force_measured", 12.34)
    answer = call("monitor", "--once", "--gateway", fake.address, "--map", tmp_path / "small.yaml")
    assert answer.exit_code == 0, answer.output
    assert "HOLDING" in answer.output and "12.34 N" in answer.output
    for words in (("hold", "12"), ("upload", "demo"), ("calibrate", "--yes")):
        refused = call(*words, "--gateway", fake.address, "--map", tmp_path / "small.yaml")
        assert refused.exit_code == 1 and refused.stderr.startswith("E185 "), refused.stderr


def test_the_picture_needs_nothing_from_the_web(fake, call, tmp_path: Path) -> None:
    fake.bank.set("force_measured", 12.0)
    answer = call("monitor", "--svg", tmp_path / "monitor.svg", "--gateway", fake.address)
    assert answer.exit_code == 0, answer.output
    svg = (tmp_path / "monitor.svg").read_text(encoding="utf-8")
    assert svg.startswith("<svg")
    assert "force_measured" in svg
    assert "url(http" not in svg.replace('"', "")
    assert "@font-face" not in svg


def test_no_gateway_at_the_start_ends_with_69(call) -> None:
    answer = call("monitor", "--once", "--gateway", "127.0.0.1:1")
    assert answer.exit_code == 69
    assert answer.stderr.startswith("E130 ")


def test_a_gateway_that_ends_while_it_is_watched_ends_with_69_too(fake, call, monkeypatch) -> None:
    """The frame said so, and the exit code 0."""
    monkeypatch.setattr(monitor, "_watch", lambda poller, seconds: (fake.stop(), poller.poll_or_note()))
    answer = call("monitor", "--once", "--gateway", fake.address)
    assert (answer.exit_code, answer.stderr[:5]) == (69, "E131 ") and "NO ANSWER" in answer.stdout


def test_a_gateway_that_comes_back_is_found_again(serve, fake, register_map: RegisterMap) -> None:
    with GatewayClient(TcpWire("127.0.0.1", fake.port), 1, register_map) as client:
        poller = Poller(client, WriterSource(lambda: (None, "not here")), lambda: 0.0)
        poller.poll_or_note()
        assert poller.trouble == ""
        fake.stop()
        poller.poll_or_note()
        assert poller.trouble.startswith(("E130", "E131"))
        assert "NO ANSWER" in text_of(poller.view(80, 24))[0]
        again = serve(fake.bank, fake.port)
        poller.poll_or_note()
        assert poller.trouble == ""
        again.stop()
        poller.poll_or_note()
        fake.bank.set("map_hash", register_map.map_hash ^ 1)
        serve(fake.bank, fake.port)
        poller.poll_or_note()
        assert poller.trouble.startswith("E186 "), "what comes back may be another rig's gateway, in other counts"


def test_writers_come_from_the_control_socket_and_their_absence_is_no_trouble(
    fake, register_map: RegisterMap, monkeypatch, tmp_path: Path
) -> None:
    answer = {"owner": "10.0.0.7", "writers": {"force_setpoint": {"peer": "10.0.0.7:50001", "time_s": 97.0}}}
    monkeypatch.setattr("gateway.cli.live_monitor.poll.ask", lambda state, request: answer)
    with GatewayClient(TcpWire("127.0.0.1", fake.port), 1, register_map) as client:
        now_s = [100.0]
        poller = Poller(client, WriterSource(lambda: (tmp_path, "")), lambda: now_s[0])
        poller.poll()
        assert poller.view(80, 24).writers == {"force_setpoint": Writer("10.0.0.7", "50001", 3.0)}
        assert any("10.0.0.7 3 s" in line for line in text_of(poller.view(80, 24)))
        monkeypatch.undo()
        now_s[0] += 10.0
        assert poller.view(80, 24).writers == {}


@pytest.mark.parametrize(
    ("peer", "narrow", "wide"),
    [
        (Peer("10.0.0.7", 50001), "10.0.0.7 3 s", "10.0.0.7:50001 3 s"),
        (Peer("fd00::7", 50001), "[fd00::7] 3 s", "[fd00::7]:50001 3 s"),
        (Peer("10.0.0.7", 50001, "robot"), "robot 3 s", "robot 3 s"),
        (Peer(serial_host(2)), "serial:2 3 s", "serial:2 3 s"),
        (Peer("web"), "web 3 s", "web 3 s"),
    ],
)
def test_whoever_wrote_is_shown_as_a_whole_however_narrow_the_terminal_is(
    fake, register_map: RegisterMap, monkeypatch, tmp_path: Path, peer: Peer, narrow: str, wide: str
) -> None:
    """A serial face lost its number, a certificate's owner half its bracket."""
    answer = {"owner": None, "writers": {"force_setpoint": {"peer": str(peer), "time_s": 97.0}}}
    monkeypatch.setattr("gateway.cli.live_monitor.poll.ask", lambda state, request: answer)
    with GatewayClient(TcpWire("127.0.0.1", fake.port), 1, register_map) as client:
        poller = Poller(client, WriterSource(lambda: (tmp_path, "")), lambda: 100.0)
        poller.poll()
        for width, expected in ((80, narrow), (200, wide)):
            assert any(f" {expected}" in line for line in text_of(poller.view(width, 40)))


def test_a_run_shows_its_phase_its_force_its_target_and_the_time_left(register_map: RegisterMap) -> None:
    track = Track()
    values = {
        "state": State.CALIBRATING, "status_word": StatusBit.ENABLED, "calibration_phase": 3, "calibration_progress": 430,
        "calibration_time_left": 80, "force_measured": 41.5, "force_accepted": 43.0, "force_applied": 42.1,
    }  # fmt: skip
    track.add(0.0, poll_of(register_map, **values))
    text = "\n".join(text_of(View(track, "here", 100, 34)))
    assert " CALIBRATING " in text
    assert "ladder 43 %, 1:20 left" in text
    assert "target N" in text
    assert "not enabled" not in text
    assert track.points[-1] == TrackPoint(0.0, 41.5, 43.0)
