"""What a wire cannot carry and a number cannot show is told in numbers before anything moves."""

import json
from pathlib import Path
from typing import Any

import pytest

from gateway.profiles import check_report, shipped_profiles_folder
from gateway.profiles.rigs.checks.wire_times import _cycle_s
from gateway.profiles.strict_yaml.text import parse

POLLED = {"ask": "W?", "frame": "W {force:+08.2f}", "unit": "N"}


def told(folder: Path, **changes: Any) -> tuple[dict[str, str], dict[str, str]]:
    """(faults, warnings) by path, of the demo as a real rig with devices of its own. changes: `rig__output__baud=9600`, and so
    with `dac` and `cell`; None leaves a key out."""
    shipped = {"rig": "rigs/demo", "dac": "devices/smc-itv-rc", "cell": "devices/stream-st-gs"}
    files = {
        name: parse((shipped_profiles_folder() / f"{file}.yaml").read_bytes(), name).value
        for name, file in shipped.items()
    }
    files["rig"] |= {"simulated": False, "name": "own"}
    files["rig"]["output"] |= {"device": "dac.yaml", "port": "/dev/serial/by-id/a"}
    files["rig"]["load_cell"] |= {"device": "cell.yaml", "port": "/dev/serial/by-id/b"}
    for key, value in changes.items():
        name, *groups, last = key.split("__")
        group = files[name]
        for step in groups:
            group = group[step]
        group.pop(last, None)
        if value is not None:
            group[last] = value
    for name, value in files.items():
        (folder / f"{name}.yaml").write_text(json.dumps(value, indent=1))
    report = check_report(folder / "rig.yaml")
    return {one.path: one.message for one in report.faults}, {one.path: one.message for one in report.warnings}


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ({"rig__output__baud": 1200}, "output.baud",
         "1200: question and answer of set_voltage take 0.133 s on the wire, smc-itv-rc gives up after"),
        ({"rig__output__baud": 1200, "dac__reply_timeout_s": 0.5, "rig__supervision__output_timeout_s": 0.1},
         "supervision.output_timeout_s", "0.1 s is over before an answer can be there: 0.133 s on the wire"),
        ({"dac__reply_timeout_s": 1, "rig__supervision__output_timeout_s": 0.1}, "output.device",
         "smc-itv-rc is waited for 1 s (reply_timeout_s), and the safe voltage waits behind a lost answer: at most 0.1 s"),
        ({"rig__output__baud": 300, "dac__reply_timeout_s": 2, "rig__supervision__output_timeout_s": 2}, "output.baud",
         "a setting and a reading take 0.90 s on the wire, longer than supervision.response_lag_s = 0.2 s"),
        ({"dac__identity": {"ask": "*IDN?", "answer": f"{50 * 'M'},{{model:s}},1.0", "models": ["ITV1050"]}},
         "output.baud", "9600: question and answer of identity take 0.074 s on the wire, smc-itv-rc gives up after"),
        ({"rig__load_cell__baud": 9600, "cell__stream": None, "cell__read_force": POLLED,
          "rig__supervision__sample_timeout_s": 0.03},
         "supervision.sample_timeout_s", "0.03 s is too short: two readings of stream-st-gs take 0.0333 s (60 readings/s"),
        ({"rig__load_cell__baud": 600, "cell__stream": None, "cell__read_force": POLLED}, "load_cell.baud",
         "600: question and answer of read_force take 0.267 s on the wire, stream-st-gs gives up after"),
        ({"cell__stream__frame": "{status:ST|US|OL},{force:+05.2f}{unit:kg|lb|g|N}", "rig__load_cell__range_n": 110,
          "rig__limits__force_max_n": 60, "cell__stream__unit": "N"},
         "limits.force_max_n", "60 N is beyond what stream-st-gs can show: 9.99 N"),
        ({"cell__stream__frame": "{status:ST|US|OL},{force:+08.1f}{unit:kg|lb|g|N}"}, "supervision.sample_quantum_n",
         "0.1 N is less than one count of stream-st-gs, 0.981 N: a held force would look like a frozen"),
        ({"cell__stream__frame": "W {force:d}", "cell__stream__blank_is_overload": None, "cell__stream__quality": None,
          "rig__supervision__sample_quantum_n": 9.8},
         "defaults.in_band_tolerance_n", "1 N is less than one count of stream-st-gs, 9.81 N"),
        ({"dac__set_voltage__ask": "V{volts:d}", "dac__set_voltage__answer": ">",
          "dac__set_voltage__range": {"device": [0, 10], "voltage_v": [0, 10]}},
         "output.device", "smc-itv-rc sets in steps of 1 V, about 8 N: defaults.in_band_tolerance_n = 1 N cannot be held"),
    ],
)  # fmt: skip
def test_what_could_not_work_is_a_fault_in_numbers(
    changes: dict[str, Any], path: str, words: str, tmp_path: Path
) -> None:
    faults, _ = told(tmp_path, **changes)
    assert faults.get(path, f"nothing, but {faults}").startswith(words)


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ({"cell__stream": None, "cell__read_force": POLLED, "rig__supervision__sample_timeout_s": 0.09},
         "supervision.sample_timeout_s", "0.09 s: one lost answer leaves a gap of 0.101 s"),
        ({"cell__stream__rate_hz": 10}, "load_cell.baud",
         "115200: stream-st-gs gives 10 readings/s by its `rate_hz`, at any baud; the pneumatics need 20"),
        ({"cell__stream__rate_hz": 10}, "load_cell.device",
         "stream-st-gs gives 10 readings/s: at a force that stands still a frozen cell is found within 2 s by noise of 0.88"),
        ({"rig__output__baud": 4800, "rig__supervision__output_timeout_s": 0.11}, "supervision.output_timeout_s",
         "0.11 s is less than three settings with readings on the wire: 0.17 s"),
    ],
)  # fmt: skip
def test_what_would_be_a_near_thing_is_a_warning(
    changes: dict[str, Any], path: str, words: str, tmp_path: Path
) -> None:
    faults, warnings = told(tmp_path, **changes)
    assert not faults
    assert warnings.get(path, f"nothing, but {warnings}").startswith(words)


@pytest.mark.parametrize(
    ("changes", "path"),
    [
        ({"rig__load_cell__baud": 9600, "cell__serial__baud": 9600}, "supervision.sample_timeout_s"),
        ({"cell__stream__rate_hz": 2, "rig__supervision__sample_timeout_s": 2.0}, "load_cell.baud"),
    ],
)
def test_of_a_devices_rate_and_its_wires_the_slower_one_counts(
    changes: dict[str, Any], path: str, tmp_path: Path
) -> None:
    faults, _ = told(tmp_path, **{"rig__supervision__sample_timeout_s": 0.03, **changes})
    assert path in faults, faults


def test_half_a_step_of_an_output_must_fit_into_the_band_and_no_whole_one(tmp_path: Path) -> None:
    coarse = {"ask": "V{volts:d}", "answer": ">", "range": {"device": [0, 10], "voltage_v": [0, 10]}}
    steps = {f"dac__set_voltage__{key}": value for key, value in coarse.items()}
    faults, _ = told(tmp_path, **steps, rig__defaults__in_band_tolerance_n=5.0)
    assert "output.device" not in faults


@pytest.mark.parametrize(("band_n", "is_fault"), [(0.97, True), (0.99, False)])
def test_a_band_holds_one_count_of_the_cell_each_way(band_n: float, is_fault: bool, tmp_path: Path) -> None:
    """A tenth of a kilogram, 0.981 N."""
    counts = {
        "cell__stream__frame": "{status:ST|US|OL},{force:+08.1f}{unit:kg|lb|g|N}",
        "rig__supervision__sample_quantum_n": 1.0,
    }
    faults, _ = told(tmp_path, **counts, rig__defaults__in_band_tolerance_n=band_n)
    assert ("defaults.in_band_tolerance_n" in faults) is is_fault


@pytest.mark.parametrize(("sign", "zero_count"), [(1, 80_000), (-1, -80_000)])
def test_a_display_of_raw_counts_ends_as_far_from_its_zero_as_a_push_can_go(
    sign: int, zero_count: int, tmp_path: Path
) -> None:
    """99999 counts of a millinewton were 100 N, also where 80000 of them are no force: beyond 20 N it stood still."""
    cell: dict[str, Any] = {"frame": "W {force:+06d}", "unit": None, "blank_is_overload": None, "quality": None}
    counts = {"newton_per_count": 0.001, "sign": sign}
    changes = {f"cell__stream__{key}": value for key, value in cell.items()}
    changes |= {f"rig__load_cell__{key}": value for key, value in counts.items()}
    faults, _ = told(tmp_path, **changes, rig__load_cell__zero_count=zero_count)
    assert faults == {"limits.over_force_n": "75 N is beyond what stream-st-gs can show: 20 N"}
    for other in (0, -zero_count):
        faults, _ = told(tmp_path, **changes, rig__load_cell__zero_count=other)
        assert not faults


@pytest.mark.parametrize(
    ("took_s", "cycle_s"),
    [
        ({"set_voltage": 0.01, "read_pressure": 0.02, "read_voltage": 0.04, "identity": 0.08}, 0.03),
        ({"set_voltage": 0.01, "read_voltage": 0.04}, 0.05),
        ({"set_voltage": 0.01}, 0.01),
        ({}, 0.0),
    ],
)
def test_a_cycle_of_an_output_is_its_setting_and_the_question_that_the_loop_asks_behind_it(
    took_s: dict[str, float], cycle_s: float
) -> None:
    """The pressure where the device measures one, else its setting; never both."""
    assert _cycle_s(took_s) == pytest.approx(cycle_s)
