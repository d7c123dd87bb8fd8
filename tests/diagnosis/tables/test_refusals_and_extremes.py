"""Whatever table is given: an answer or a sentence, through the reader and the verb; never a traceback, never NaN in JSON."""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from tests.diagnosis.machine import MACHINE, Floats, command_v, readings_n, times_s

Columns = dict[str, Floats]

MEMORY_MB = 1024
RATE_HZ = 100.0
TIME_S = times_s(12.0, RATE_HZ)
VOLTS = command_v(TIME_S)
SEED = 5


def columns(**changed: Floats | None) -> Columns:
    """12 s of the machine; None takes a column away."""
    rng = np.random.default_rng(SEED)
    force_n = readings_n(MACHINE, TIME_S, VOLTS, {}) + rng.normal(0.0, 0.1, TIME_S.size)
    found = {"time_s": TIME_S, "command_v": VOLTS, "force_n": force_n} | changed
    return {name: values for name, values in found.items() if values is not None}


def spoiled(name: str, rows: Any, value: float = np.nan) -> Columns:
    values = columns()[name].copy()
    values[rows] = value
    return {name: values}


def noise(size: float, seed: int = SEED) -> Floats:
    return np.random.default_rng(seed).normal(0.0, size, TIME_S.size)


def written(path: Path, table: Mapping[str, Floats]) -> Path:
    np.savetxt(path, np.column_stack(list(table.values())), "%.7g", ",", header=",".join(table), comments="")
    return path


def answered(tmp_path: Path, table: Mapping[str, Floats]) -> tuple[int, str, dict[str, Any]]:
    """(exit code, words, document); the document is empty where it was refused. Strict JSON: no NaN."""
    done = CliRunner().invoke(command, ["diagnose", str(written(tmp_path / "table.csv", table)), "--json", "-"])
    assert "Traceback" not in done.output and "E500" not in done.output, done.output
    assert done.exit_code in (0, 65), done.output
    document = json.loads(done.stdout, parse_constant=_no_constant) if done.exit_code == 0 else {}
    return done.exit_code, done.output, document


def _no_constant(name: str) -> None:
    raise AssertionError(f"{name} is not JSON")


REFUSED = {
    "times that run backwards": (columns(**spoiled("time_s", 600, 2.0)), "table.csv:602, column time_s: 2 after 5.99"),
    "three samples": ({name: values[:3] for name, values in columns().items()}, "3 rows: at least 50 usable rows"),
    "nothing that drives": (columns(command_v=None), "no column command_v (or pressure_kpa)"),
    "no force": (columns(force_n=None), "no column force_n"),
    "a force that is never there": (columns(**spoiled("force_n", slice(None))), "0 usable rows"),
    "one time for all rows": (columns(time_s=np.full(TIME_S.size, 3.0)), "1 usable rows"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_only_the_user_can_know_is_refused_by_the_row(tmp_path: Path, what: str) -> None:
    table, words = REFUSED[what]
    code, output, _ = answered(tmp_path, table)
    assert code == 65
    assert words in output
    assert output.startswith("E403 ")


def test_prose_is_no_recording(tmp_path: Path) -> None:
    letter = tmp_path / "letter.csv"
    letter.write_text("Dear colleague\nhere is the log that you asked for\n", encoding="utf-8")
    done = CliRunner().invoke(command, ["diagnose", str(letter)])
    assert done.exit_code == 65
    assert "letter.csv: no column of numbers" in done.output


def test_a_refusal_writes_nothing(tmp_path: Path) -> None:
    path = written(tmp_path / "three.csv", {name: values[:3] for name, values in columns().items()})
    files = [str(tmp_path / name) for name in ("out.json", "out.html", "plant.yaml")]
    words = ["diagnose", str(path), "--json", files[0], "--report", files[1], "--extend", files[2]]
    assert CliRunner().invoke(command, words).exit_code == 65
    assert list(tmp_path.iterdir()) == [path]


QUIET: dict[str, Columns] = {
    "a constant command": columns(command_v=np.full(TIME_S.size, 2.0), force_n=15.0 + noise(0.1)),
    "no command at all": columns(command_v=np.zeros(TIME_S.size), force_n=noise(0.1)),
    "a force that is unrelated to the command": columns(force_n=noise(3.0)),
    "a gateway at rest with a dead cell": columns(command_v=np.zeros(TIME_S.size), force_n=np.full(TIME_S.size, 0.1)),
}


@pytest.mark.sampled
@pytest.mark.parametrize("what", QUIET)
def test_nothing_is_found_where_nothing_can_be_seen(tmp_path: Path, what: str) -> None:
    code, _, document = answered(tmp_path, QUIET[what])
    assert code == 0
    assert document["causes"] == []
    assert document["verdict"] in ("nothing-found", "unknown")


def test_a_command_that_never_moves_under_a_force_that_does_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "dead.csv", columns(command_v=np.full(TIME_S.size, 2.0)))
    done = CliRunner().invoke(command, ["diagnose", str(path)])
    assert done.exit_code == 0
    assert "command_v stands at 2 V throughout" in " ".join(done.output.split())


def said(*words: str) -> str:
    done = CliRunner().invoke(command, ["diagnose", *words])
    assert done.exit_code == 0, done.output
    return " ".join(done.output.split())


@pytest.mark.parametrize("force_n", [noise(0.05) + 3.0, np.full(TIME_S.size, 3.0)], ids=["noisy", "frozen"])
def test_a_force_that_does_not_answer_is_told_and_gives_no_plant(tmp_path: Path, force_n: Floats) -> None:
    path, plant = written(tmp_path / "dead.csv", columns(force_n=force_n)), tmp_path / "plant.yaml"
    words = [str(path), "--extend", str(plant), "--json", str(tmp_path / "dead.json"), "--fail-on", "unknown"]
    done = CliRunner().invoke(command, ["diagnose", *words])
    text, document = " ".join(done.output.split()), json.loads((tmp_path / "dead.json").read_text("utf-8"))
    assert (done.exit_code, document["verdict"]) == (1, "unknown")
    assert document["notes"][0].startswith("dead.csv: the force stands at 3 N while command_v moves by")
    assert "Nothing can be told: dead.csv: the force stands at 3 N while command_v moves by" in text
    assert f"{plant} is not written" in text
    assert not plant.exists()


def test_an_effect_that_is_not_there_cannot_be_switched_off(tmp_path: Path) -> None:
    path = str(written(tmp_path / "plain.csv", columns()))
    assert "the base model has no creep that could be switched off" in said(path, "--without", "creep")
    assert "that could be switched off" not in said(path, "--without", "coulomb-friction")


def test_a_force_of_a_thousand_times_the_piston_s_asks_for_its_unit(tmp_path: Path) -> None:
    path = str(written(tmp_path / "mn.csv", {**columns(), "force_n": columns()["force_n"] * 1.0e3}))
    text = said(path)
    assert text.index("E520 mn.csv: the force is ") < text.index("Nothing can be told yet")
    assert "force_n is probably in mn; --columns force_n=force_n:mn corrects it" in text
    assert "E52" not in said(path, "--columns", "time_s=1,command_v=2,force_n=3:mn")


def test_what_corrects_a_turned_sign_keeps_the_unit_of_the_header(tmp_path: Path) -> None:
    """It said -n, which made a tenth of the force; what corrected that said kgf, and the sign was turned again."""
    turned = columns(force_n=-columns()["force_n"] / 9.80665)
    path = written(tmp_path / "turned.csv", {"Kraft [kgf]" if n == "force_n" else n: v for n, v in turned.items()})
    mapping = tmp_path / "columns.yaml"
    for given in ([], ["--columns", "force_n=3:kgf"], ["--columns", str(mapping)]):
        mapping.write_text("force_n: 3\n", encoding="utf-8")
        option = said(str(path), *given).partition("; --columns ")[2].partition(" corrects it")[0]
        assert option.endswith(":-kgf"), (given, option)
    assert "E52" not in said(str(path), "--columns", option)


def test_a_floor_above_the_residual_confirms_nothing(tmp_path: Path) -> None:
    bent = {**columns(), "force_n": columns()["force_n"] * (1.0 + 0.002 * columns()["force_n"])}
    path = written(tmp_path / "bent.csv", bent)
    answer = tmp_path / "answer.json"
    done = CliRunner().invoke(command, ["diagnose", str(path), "--noise-floor-n", "50", "--json", str(answer)])
    document = json.loads(answer.read_text(encoding="utf-8"))
    assert document["causes"]
    assert document["verdict"] != "confirmed"
    assert document["baseline"]["noise_floor_n"] < 1.0
    assert "is more than the base model leaves" in " ".join(done.output.split())


ANSWERED: dict[str, Columns] = {
    "a constant force": columns(force_n=np.full(TIME_S.size, 5.0)),
    "a force that is always zero": columns(force_n=np.zeros(TIME_S.size)),
    "a negative area": columns(force_n=-columns()["force_n"]),
    "a command below zero": columns(command_v=-VOLTS),
    "a command in millivolts": columns(command_v=1.0e3 * VOLTS),
    "rows without a number": columns(
        **spoiled("force_n", slice(200, 400)), **spoiled("command_v", slice(300, 350))
    ),
    "every other reading missing": columns(**spoiled("force_n", slice(0, None, 2))),
    "readings that are infinite": columns(**spoiled("force_n", [10, 20], np.inf)),
    "fifty-one rows": {name: values[:153:3] for name, values in columns().items()},
    "a gap of an hour": columns(time_s=TIME_S + np.where(TIME_S > 5.0, 3600.0, 0.0)),
    "one row a second": columns(time_s=100.0 * TIME_S),
    "a random walk": columns(force_n=np.cumsum(noise(0.3))),
    "two levels": columns(force_n=np.where(VOLTS > 2.0, 10.0, 0.0)),
    "forces of a giant": columns(force_n=1.0e30 * columns()["force_n"]),
    "readings without noise": columns(force_n=readings_n(MACHINE, TIME_S, VOLTS, {})),
    "a pressure that never changes": columns(pressure_kpa=np.full(TIME_S.size, 100.0), command_v=None),
    "a position of mere noise": columns(position_mm=noise(1.0)),
    "a copy of the force": columns(copy=columns()["force_n"]),
    "a temperature of the sun": columns(temperature_c=1.0e12 * noise(1.0, 7)),
}  # fmt: skip
IN_THE_GATE = (
    "a constant force",
    "a force that is always zero",
    "a command in millivolts",
    "fifty-one rows",
    "a pressure that never changes",
    "a temperature of the sun",
)


def assert_answered(tmp_path: Path, table: Columns) -> None:
    code, output, document = answered(tmp_path, table)
    assert code == 0, output
    assert document["verdict"] in ("nothing-found", "confirmed", "partial", "unknown")
    assert document["baseline"]["rms_n"] is not None
    assert all(np.isfinite(cause["confidence"]) for cause in document["causes"])


@pytest.mark.sampled
@pytest.mark.parametrize("what", IN_THE_GATE)
def test_a_strange_table_gets_an_answer(tmp_path: Path, what: str) -> None:
    assert_answered(tmp_path, ANSWERED[what])


@pytest.mark.long
@pytest.mark.parametrize("what", [what for what in ANSWERED if what not in IN_THE_GATE])
def test_any_other_strange_table_gets_an_answer(tmp_path: Path, what: str) -> None:
    assert_answered(tmp_path, ANSWERED[what])


def test_a_plain_machine_without_a_rig_has_no_cause(tmp_path: Path) -> None:
    """The start that the verb takes must not bring an effect of its own."""
    _, _, document = answered(tmp_path, columns())
    assert document["causes"] == []
    assert document["verdict"] == "nothing-found"


def apart(path: Path) -> tuple[int, float, float, str]:
    """(exit code, wall seconds, largest memory in MB, words) of the verb in a process of its own."""
    words = [sys.executable, "-m", "gateway", "diagnose", str(path), "--json", str(path.with_suffix(".json"))]
    began_s = time.perf_counter()
    told = path.with_suffix(".txt")
    with told.open("w", encoding="utf-8") as output:
        child = subprocess.Popen(words, stdout=output, stderr=output, preexec_fn=_bounded)
        _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    wall_s, mb = time.perf_counter() - began_s, used.ru_maxrss / 1024.0
    print(f"{path.name}: exit {child.returncode}, {wall_s:.1f} s, {mb:.0f} MB")
    return child.returncode, wall_s, mb, told.read_text(encoding="utf-8")


def _bounded() -> None:
    """A defect must not take the whole machine with it."""
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "most_s"), [("a thousand columns", 120.0), ("a million samples", 600.0)], ids=lambda value: str(value)
)
def test_a_very_large_table_is_answered_or_refused_within_a_gigabyte(tmp_path: Path, name: str, most_s: float) -> None:
    rng = np.random.default_rng(SEED)
    wide = name == "a thousand columns"
    time_s = times_s(60.0, 200.0) if wide else times_s(5000.0, 200.0)
    volts = command_v(time_s)
    table = {"time_s": time_s, "command_v": volts}
    table["force_n"] = readings_n(MACHINE, time_s, volts, {}) + rng.normal(0.0, 0.1, time_s.size)
    if wide:
        table |= {f"column_{k}": np.cumsum(rng.normal(0.0, 1.0, time_s.size)) for k in range(1000)}
    code, wall_s, mb, output = apart(written(tmp_path / "large.csv", table))
    assert code in (0, 65), output
    assert "Traceback" not in output and "E500" not in output
    assert mb < MEMORY_MB
    assert wall_s < most_s
    document = json.loads((tmp_path / "large.json").read_text(encoding="utf-8"))
    assert document["causes"] == [], "a plain machine, however much of it was recorded"
