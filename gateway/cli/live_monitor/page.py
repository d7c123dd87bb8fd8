"""One frame of the monitor, for any size from 60 x 24: header, four big numbers, a minute of force, alarms, registers."""

from math import isnan, nan
from typing import Final

from rich.text import Text

from gateway.cli.live_monitor.drawing import beside, big, boxed, chart, chart_top_n
from gateway.cli.live_monitor.flow import StyledWords, flow_lines
from gateway.cli.live_monitor.history import Track, buckets
from gateway.cli.live_monitor.register_table import View, register_lines
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
_TALL: Final = 30  # lines from which what to do is said of every alarm
_SHOWN_BITS: Final = {
    StatusBit.CONTACT: "green",
    StatusBit.IN_BAND: "green",
    StatusBit.LIMITED: "yellow",
    StatusBit.TARGET_UNREACHABLE: "red",
    StatusBit.PULLING: "cyan",
    StatusBit.SWITCHING: "yellow",
}


def page(view: View) -> list[Text]:
    """Return the whole frame, `height` lines at most."""
    header, alarms = _header(view), _alarms(view)
    hint = flow_lines([StyledWords(view.hint, "dim", is_sentence=True)], view.width) if view.hint else []
    chart_rows = 3 if view.height < 36 else 6
    above = len(header) + 5 + chart_rows + 2 + len(alarms)
    below = len(hint) or 1  # a line for the prompt after one frame
    table_rows = max(1, view.height - above - below - 1)
    table = register_lines(view, table_rows)[: table_rows + 1]
    return [*header, *_numbers(view), *_minute(view, chart_rows), *alarms, *table, *hint]


def _header(view: View) -> list[Text]:
    """Return the state, what holds of it, and where it is: one line, more where that does not fit."""
    track = view.track
    if view.trouble:
        words = f"NO ANSWER {view.trouble}".split()
        return flow_lines([StyledWords(" ".join(words), "bold white on red", is_sentence=True)], view.width)
    state = track.value("state")
    known = State(int(state)) if not isnan(state) and int(state) in set(State) else None
    name, style = (known.name, _STATE_STYLE[known]) if known is not None else ("?", "")
    parts = [StyledWords(f" {name} ", style)]
    if known is State.CALIBRATING:
        parts.append(StyledWords(_describe_run(track), "bold"))
    else:
        parts += [StyledWords(_name_of(bit), style) for bit, style in _SHOWN_BITS.items() if track.has_status(bit)]
        parts.append(StyledWords(_describe_settling(track)))
    parts.append(StyledWords(view.where, "dim"))
    return flow_lines((part for part in parts if part.words), view.width)


def _name_of(bit: StatusBit) -> str:
    return (bit.name or "").lower().replace("_", " ")


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


def _numbers(view: View) -> list[Text]:
    track = view.track
    measured_n, setpoint_n = track.value("force_measured"), track.wanted_n
    is_wanted = setpoint_n != 0.0 and track.has_status(StatusBit.ENABLED)
    error_n = track.acting_n - setpoint_n if is_wanted else nan  # of a force that nobody asks for there is none
    numbers = (
        ("measured N", measured_n, 2, "-", "bold cyan"),
        ("target N" if track.is_calibrating else "setpoint N", setpoint_n, 2, "-", "yellow"),
        ("error N", error_n, 2, "+", "green" if track.has_status(StatusBit.IN_BAND) else "white"),
        ("output V", track.value("output_voltage") / 1e3, 3, "-", "magenta"),
    )
    boxes = []
    for place, (title, value, decimals, sign, style) in enumerate(numbers):
        width = (view.width * (place + 1)) // 4 - (view.width * place) // 4
        rows = big(value, decimals, sign=sign, width=width - 2, style=style)
        boxes.append(boxed(title, rows, width, is_centred=True))
    return beside(boxes)


def _minute(view: View, rows: int) -> list[Text]:
    points = buckets(view.track.points, view.track.time_s, view.width - 2)
    top_n = chart_top_n(points)
    unit = "N of pull" if view.track.has_status(StatusBit.PULLING) else "N"
    return boxed(f"force, last 60 s, 0 .. {top_n:g} {unit} (line: setpoint)", chart(points, rows, top_n), view.width)


def _alarms(view: View) -> list[Text]:
    """Return the fault first, then warnings, each with what to do; three at most, on a low terminal what to do about the first
    alone."""
    track = view.track
    codes = []
    fault = track.value("fault_code")
    if not isnan(fault) and int(fault):
        codes.append((_code_of_fault(int(fault)), "bold white on red"))
    warnings = track.value("warning_word")
    if not isnan(warnings):
        codes += [(bit.code, "black on yellow") for bit in WarningBit if int(warnings) & bit]
    shown = codes[:3] if len(codes) <= 3 else codes[:2]
    lines: list[Text] = []
    for place, (code, style) in enumerate(shown):
        parts = _alarm(code, style, _detail(code, track), is_whole=place == 0 or view.height >= _TALL)
        lines += flow_lines(parts, view.width)
    if len(codes) > len(shown):
        more = f" and {len(codes) - len(shown)} more: force-gateway read warning_word "
        lines += flow_lines([StyledWords(more, "black on yellow")], view.width)
    return lines


def _detail(code: str, track: Track) -> str:
    """Return what else the registers say of an alarm: the name that the residual watch has for its cause."""
    if code != WarningBit.MODEL_DIFFERS.code or "residual_cause" not in track.readings:
        return ""
    return f": {format_value(track.readings['residual_cause']).replace('_', '-')}"


def _code_of_fault(number: int) -> str:
    return FaultCode(number).code if number in set(FaultCode) else ""


def _alarm(code: str, style: str, detail: str, *, is_whole: bool) -> list[StyledWords]:
    entry = CATALOGUE.get(code)
    if entry is None:
        return [StyledWords(" a fault that this version does not know ", style)]
    title = StyledWords(f" {entry.code} {entry.title}{detail} ", style)
    return [title, StyledWords(entry.do, is_sentence=True)] if is_whole else [title]
