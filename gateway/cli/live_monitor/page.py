"""One frame of the monitor, for any size from 80 x 24: header, four big numbers, a minute of force, alarms, registers."""

from math import isnan
from typing import Final

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from gateway.cli.live_monitor.drawing import big, chart, chart_top_n
from gateway.cli.live_monitor.history import Track, buckets
from gateway.cli.live_monitor.register_table import View, register_table
from gateway.cli.master.value_text import format_value
from gateway.codes.all_codes import CATALOGUE
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import State, StatusBit

_STATE_STYLE: Final = {
    State.OFF: "white on grey30",
    State.READY: "black on yellow",
    State.RAMPING: "black on cyan",
    State.HOLDING: "black on green",
    State.FAULT: "bold white on red",
    State.CALIBRATING: "bold white on blue",
}
_SHOWN_BITS: Final = {
    StatusBit.CONTACT: "green",
    StatusBit.IN_BAND: "green",
    StatusBit.LIMITED: "yellow",
    StatusBit.TARGET_UNREACHABLE: "red",
    StatusBit.PULLING: "cyan",
    StatusBit.SWITCHING: "yellow",
}


def page(view: View) -> RenderableType:
    """Return the whole frame, `height` lines at most."""
    alarms = _alarms(view.track)
    chart_rows = 3 if view.height < 36 else 6
    above = 1 + 5 + chart_rows + 2 + len(alarms)
    table_rows = max(1, view.height - above - 2)  # its heading, and a line for the prompt after one frame
    return Group(_header(view), _numbers(view), _minute(view, chart_rows), *alarms, register_table(view, table_rows))


def _header(view: View) -> Text:
    track = view.track
    state = track.value("state")
    text = Text(no_wrap=True, overflow="crop")
    if view.trouble:
        text.append(f" NO ANSWER {view.trouble[: view.width - 12]}", style="bold white on red")
        return text
    known = State(int(state)) if not isnan(state) and int(state) in set(State) else None
    text.append(
        f" {known.name if known is not None else '?'} ", style=_STATE_STYLE.get(known, "") if known is not None else ""
    )
    if known is State.CALIBRATING:
        text.append(f"  {_describe_run(track)}", style="bold")
    else:
        for bit, style in _SHOWN_BITS.items():
            if track.has_status(bit):
                text.append(f"  {(bit.name or '').lower().replace('_', ' ')}", style=style)
        text.append(f"   {_describe_settling(track)}")
    text.append(f"   {view.where}", style="dim")
    return text


def _describe_run(track: Track) -> str:
    """Return `ladder 43 %, 1:20 left`: how far a calibration or an experiment is. Empty for a gateway without these
    registers."""
    if "calibration_phase" not in track.readings:
        return ""
    phase = track.readings["calibration_phase"].register.values.get(int(track.value("calibration_phase")), "?")
    words = f"{phase.replace('_', ' ')} {track.value('calibration_progress') / 10:.0f} %"
    left_s = track.value("calibration_time_left")
    return words if isnan(left_s) else f"{words}, {int(left_s) // 60}:{int(left_s) % 60:02d} left"


def _describe_settling(track: Track) -> str:
    """Settling time and what the error has kept to lately; 5 s show a limit cycle, and forget the approach."""
    settling = track.settling
    if not settling.is_settled:
        return "" if track.has_status(StatusBit.ENABLED) else "not enabled"
    after = "" if settling.after_s is None else f"settled in {settling.after_s:.1f} s, "
    tolerance_n = track.value("in_band_tolerance")
    band = f" (band ±{tolerance_n:.2f})" if tolerance_n > 0 else ""
    return f"{after}last 5 s ±{track.largest_error_n(5.0):.2f} N{band}"


def _numbers(view: View) -> Table:
    track = view.track
    measured_n, setpoint_n = track.value("force_measured"), track.wanted_n
    numbers = (
        ("measured N", measured_n, 2, "-", "bold cyan"),
        ("target N" if track.is_calibrating else "setpoint N", setpoint_n, 2, "-", "yellow"),
        ("error N", measured_n - setpoint_n, 2, "+", "green" if track.has_status(StatusBit.IN_BAND) else "white"),
        ("output V", track.value("output_voltage") / 1e3, 3, "-", "magenta"),
    )
    table = Table.grid(expand=True)
    panels = []
    for title, value, decimals, sign, style in numbers:
        table.add_column(ratio=1)
        width = view.width // 4 - 2
        panels.append(
            Panel(big(value, decimals, sign=sign, width=width, style=style), title=title, padding=0, height=5)
        )
    table.add_row(*panels)
    return table


def _minute(view: View, rows: int) -> Panel:
    columns = view.width - 2
    points = buckets(view.track.points, view.track.time_s, columns)
    top_n = chart_top_n(points)
    title = f"force, last 60 s, 0 .. {top_n:g} N (line: setpoint)"
    return Panel(chart(points, rows, top_n), title=title, title_align="left", padding=0, height=rows + 2)


def _alarms(track: Track) -> list[Text]:
    """Return the fault first, then warnings, each with what to do; at most three lines."""
    codes = []
    fault = track.value("fault_code")
    if not isnan(fault) and int(fault):
        codes.append((_code_of_fault(int(fault)), "bold white on red"))
    warnings = track.value("warning_word")
    if not isnan(warnings):
        codes += [(bit.code, "black on yellow") for bit in WarningBit if int(warnings) & bit]
    lines = [_alarm(code, style, _detail(code, track)) for code, style in codes[:3]]
    if len(codes) > 3:
        lines[-1] = Text(f" and {len(codes) - 2} more: see warning_word ", style="black on yellow")
    return lines


def _detail(code: str, track: Track) -> str:
    """Return what else the registers say of an alarm: the name that the residual watch has for its cause."""
    if code != WarningBit.MODEL_DIFFERS.code or "residual_cause" not in track.readings:
        return ""
    return f": {format_value(track.readings['residual_cause']).replace('_', '-')}"


def _code_of_fault(number: int) -> str:
    return FaultCode(number).code if number in set(FaultCode) else ""


def _alarm(code: str, style: str, detail: str) -> Text:
    entry = CATALOGUE.get(code)
    text = Text(no_wrap=True, overflow="ellipsis")
    if entry is None:
        return text.append(" a fault that this version does not know ", style=style)
    return text.append(f" {entry.code} {entry.title}{detail} ", style=style).append(f" {entry.do}")
