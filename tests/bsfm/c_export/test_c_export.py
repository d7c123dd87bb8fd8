"""The text of the generated C: what it needs, where it says it comes from, what it refuses, and its own self-test."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.bsfm import Calibration, Response
from gateway.bsfm.c_export.code import c_source
from gateway.bsfm.c_export.tables import tables_of
from gateway.profiles import load_calibration

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="NO gcc: the generated C was NOT compiled")
needs_gxx = pytest.mark.skipif(shutil.which("g++") is None, reason="NO g++: the generated C was NOT compiled as C++")

STRICT = "-std=c99 -Wall -Wextra -Werror -pedantic -Wconversion".split()


def calibration(order: int, seed: int, **changes: object) -> Calibration:
    """A made-up loop with tied ends, 0.5 .. 40 N, of moderate slopes and weights."""
    rng = np.random.default_rng(seed)
    facts: dict[str, Any] = {}
    for branch in ("rising", "falling"):
        shares = np.cumsum(rng.uniform(0.6, 1.0, order))
        facts[f"{branch}_handles_n"] = (0.5, *(0.5 + 39.5 * shares / shares[-1]).tolist())
        facts[f"{branch}_weights"] = tuple(rng.uniform(0.5, 2.0, order + 1).tolist())
    texts = {
        "name": f"order_{order}",
        "date_utc": "2026-01-01",
        "source": "made up",
        "rig": "none",
        "data_sha256": "00",
    }
    facts |= {"x0_v": 0.0, "x1_v": 5.0, "blend_span_n": 3.0, "rms_n": 0.1, "max_n": 0.4}
    return Calibration(**{"number": seed, "order": order, **facts, **texts, **changes})


CASES = {"demo": load_calibration("demo"), **{f"order_{n}": calibration(n, seed=n) for n in (1, 2, 3, 5, 15)}}


def written(directory: Path, *calibrations: Calibration) -> list[str]:
    """The prefixes of the files written."""
    prefixes = []
    for one in calibrations:
        for name, text in c_source(one).items():
            (directory / name).write_text(text, encoding="ascii")
        prefixes.append(name.removesuffix(".c"))
    return prefixes


def code_only(directory: Path, prefix: str) -> str:
    """What a compiler sees of both files: no comments, and the same names whatever the calibration is called."""
    text = "".join((directory / f"{prefix}{end}").read_text(encoding="ascii") for end in (".h", ".c"))
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).replace(prefix, "one").replace(prefix.upper(), "ONE")


def compiled(directory: Path, compiler: str, *arguments: str) -> None:
    done = subprocess.run([compiler, *arguments], cwd=directory, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


SELF_TESTS = """\
#include "{one}.h"
#include "{other}.h"
int main(void)
{{
    return {one}_self_test() != 0 ? 1 : {other}_self_test() != 0 ? 2 : 0;
}}
"""
BUILDS = {
    "plain": ["gcc", *STRICT, "-O0"],
    "fused and fast": ["gcc", *STRICT, "-O3", "-ffast-math", "-march=native"],
    "as C11": ["gcc", *STRICT, "-std=c11", "-O1"],
    "trapping": [
        "gcc",
        *STRICT,
        "-O1",
        "-fsanitize=undefined,float-divide-by-zero",
        "-fsanitize-undefined-trap-on-error",
    ],
}


def self_tested(directory: Path, command: list[str], *calibrations: Calibration) -> int:
    one, other = written(directory, *calibrations)
    (directory / "main.c").write_text(SELF_TESTS.format(one=one, other=other), encoding="ascii")
    compiled(directory, *command, "-o", "program", "main.c", f"{one}.c", f"{other}.c", "-lm")
    return subprocess.run([directory / "program"], check=False, timeout=20).returncode


@needs_gcc
@pytest.mark.parametrize("build", BUILDS)
def test_two_calibrations_in_one_program_pass_their_self_tests_however_built(tmp_path, build):
    """The self-test includes NaN and infinity, which -ffast-math pretends do not exist."""
    for one, other in (("order_1", "demo"), ("order_3", "order_15")):
        assert self_tested(tmp_path, BUILDS[build], CASES[one], CASES[other]) == 0


@needs_gxx
def test_the_c_is_also_cxx(tmp_path):
    flags = "-x c++ -std=c++11 -Wall -Wextra -Werror -pedantic -Wconversion -O2".split()
    assert self_tested(tmp_path, ["g++", *flags], CASES["demo"], CASES["order_15"]) == 0


@needs_gcc
@pytest.mark.parametrize("name", ["order_1", "order_2", "order_5"])
def test_the_self_test_catches_a_damaged_constant(tmp_path, name):
    (prefix,) = written(tmp_path, CASES[name])
    source = (tmp_path / f"{prefix}.c").read_text("ascii")
    (tmp_path / "main.c").write_text(f'#include "{prefix}.h"\nint main(void) {{ return {prefix}_self_test() != 0; }}\n')
    table = tables_of(CASES[name]).falling
    for constant in {*table.products[:2], table.totals[-1]}:
        literal = f"{constant:.9g}"
        at = source.index(literal, source.index("FALLING = {"))
        damaged = source[:at] + f"{constant * 1.001:.9g}" + source[at + len(literal) :]
        (tmp_path / f"{prefix}.c").write_text(damaged, encoding="ascii")
        compiled(tmp_path, "gcc", "-o", "program", "main.c", f"{prefix}.c", "-lm")
        assert subprocess.run([tmp_path / "program"], check=False).returncode == 1, literal


@needs_gcc
@pytest.mark.parametrize("array", ["RADII_V", "SHARES"])
def test_the_self_test_catches_a_damaged_stop(tmp_path, array):
    """The first, which gives way at once, and the last, which hardly does."""
    (prefix,) = written(tmp_path, CASES["demo"])
    source = (tmp_path / f"{prefix}.c").read_text("ascii")
    (tmp_path / "main.c").write_text(f'#include "{prefix}.h"\nint main(void) {{ return {prefix}_self_test() != 0; }}\n')
    table = tables_of(CASES["demo"])
    constants = table.radii_v if array == "RADII_V" else table.shares
    for constant in (constants[0], constants[-1]):
        literal = f"{constant:.9g}"
        at = source.index(literal, source.index(f"{array}[STOPS] = "))
        damaged = source[:at] + f"{constant * 1.001:.9g}" + source[at + len(literal) :]
        (tmp_path / f"{prefix}.c").write_text(damaged, encoding="ascii")
        compiled(tmp_path, "gcc", "-o", "program", "main.c", f"{prefix}.c", "-lm")
        assert subprocess.run([tmp_path / "program"], check=False).returncode == 1, literal


@needs_gcc
@pytest.mark.parametrize("name", ["order_1", "demo", "order_15"])
def test_the_object_needs_nothing_but_sqrtf_and_owns_no_memory(tmp_path, name):
    (prefix,) = written(tmp_path, CASES[name])
    compiled(tmp_path, "gcc", *STRICT, "-O2", "-Wstack-usage=512", "-c", f"{prefix}.c")
    shown = subprocess.run(["nm", f"{prefix}.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    rows = [line.split()[-2:] for line in shown.splitlines()]
    assert {symbol for kind, symbol in rows if kind == "U"} == (set() if name == "order_1" else {"sqrtf"})
    assert not [symbol for kind, symbol in rows if kind in "bBdDCc"]
    assert all(symbol.startswith(f"{prefix}_") for kind, symbol in rows if kind == "T")


HOSTILE = (
    "ends */ int x; /* here",
    "??/ ???= tri",
    "a\nb\tc\x00d",
    "schräg – ✓",
    "back\\",
    '"quoted" %s ${p} $$',
    "x" * 900,
    "",
)


@pytest.mark.sampled
@needs_gcc
@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_of_a_calibration_can_leave_its_comment(tmp_path, text):
    one = replace(CASES["demo"], name=text[:40], rig=text, source=text, date_utc=text, data_sha256=text)
    (prefix,) = written(tmp_path, one)
    (harmless,) = written(tmp_path, CASES["demo"])
    compiled(tmp_path, "gcc", *STRICT, "-Wcomment", "-Wtrigraphs", "-fsyntax-only", f"{prefix}.c")
    assert code_only(tmp_path, prefix) == code_only(tmp_path, harmless)


def test_the_header_says_where_it_comes_from_and_what_it_is_not():
    sources = c_source(CASES["demo"])
    assert sorted(sources) == ["bsfm_demo.c", "bsfm_demo.h"]
    header = sources["bsfm_demo.h"].split("*/")[0]
    text = ('1 "demo" of 2026-11-22', "twin of plant paper-slide", "RMS 0.131 N", "0 .. 8 V")
    text = (*text, "slip stops: 7, which give way over 0.144, 0.445, 0.589, 1.04, 1.37, 1.82, 3.2 V")
    data = f"sha256 {CASES['demo'].data_sha256}"
    for words in (*text, "force-gateway 0.1.0", data, "not a safety device", "bsfm_demo_command(&state,"):
        assert words in header


def test_the_header_tells_the_response_that_the_code_does_not_use():
    measured = replace(CASES["demo"], response=Response(dead_time_s=0.08, lag_s=0.072, second_lag_s=0.07))
    header, source = (c_source(measured)[f"bsfm_demo.{end}"] for end in "hc")
    assert " *   response     dead time 0.08 s, lags 0.072 and 0.07 s: not in this code\n *   generator" in header
    unmeasured = c_source(replace(CASES["demo"], response=None))
    assert source == unmeasured["bsfm_demo.c"]
    assert "response     " not in unmeasured["bsfm_demo.h"]


def test_the_same_calibration_gives_the_same_ascii_text():
    for one in CASES.values():
        first, second = c_source(one), c_source(one)
        assert first == second
        assert all(text.isascii() and text.endswith("\n") and "$" not in text for text in first.values())


def test_no_letter_of_a_person_s_text_is_lost_in_a_comment():
    (header, *_) = (
        text for name, text in c_source(replace(CASES["demo"], rig="Käfer №7")).items() if name.endswith(".h")
    )
    assert r"K\xe4fer \u21167" in header


@pytest.mark.parametrize(
    ("name", "prefix"), [("demo-2 (new)", "bsfm_demo_2_new"), ("7", "bsfm_7"), ("✓", "bsfm_calibration_1")]
)
def test_a_name_becomes_a_c_name(name, prefix):
    assert sorted(c_source(replace(CASES["demo"], name=name))) == [f"{prefix}.c", f"{prefix}.h"]


@pytest.mark.sampled
@pytest.mark.parametrize("order", range(1, 16))
def test_every_order_with_a_usable_slope_becomes_c(order):
    for seed in range(3):
        one = calibration(order, 100 * order + seed)
        branches = one.model().branches
        assert branches.rising.slope_is_at_least(0.5) and branches.falling.slope_is_at_least(0.5)
        assert len(c_source(one)) == 2


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"order": 3}, "order 3 needs 4 handles"),
        ({"rising_handles_n": (0.5, 90.0, 40.0)}, "must increase"),
        ({"rising_weights": (1.0, 1e-12, 1.0)}, "spread over more than 1e.09"),
        ({"rising_handles_n": (1e12, 2e12, 3e12)}, "at most 1e.06 N"),
        ({"rising_handles_n": (5000.0, 5000.00001, 5000.1)}, "too narrow"),
        ({"rising_handles_n": (50.0, 60.0, 70.0)}, "share no force"),
        ({"x0_v": 4.9999999}, "too narrow"),
        ({"x1_v": 1e6}, "at most 1000 V"),
        ({"blend_span_n": 1e9}, "blend span"),
        ({"slip_radii_v": (0.001,), "slip_shares": (1.0,)}, "slip stops give way over"),
    ],
)
def test_what_float32_cannot_carry_is_refused_with_a_sentence(changes, words):
    with pytest.raises(ValueError, match=words):
        c_source(replace(calibration(2, seed=2), **changes))


def test_a_branch_too_flat_for_float32_is_refused_by_what_was_measured():
    flat = calibration(3, 3, rising_handles_n=(0.5, 0.5, 0.5, 40.0), rising_weights=(1.0, 1.0, 1.0, 1e-9))
    with pytest.raises(ValueError, match="float32 cannot follow"):
        c_source(flat)


def test_a_branch_that_increases_in_double_only_is_refused():
    on_the_edge = (0.5, 48.034053035589196, 10.74, 40.0)  # a level tangent; rounded to float32 it dips
    with pytest.raises(ValueError, match="falling branch stops increasing"):
        c_source(calibration(3, 3, falling_handles_n=on_the_edge, falling_weights=(1.0, 1.0, 1.0, 1.0)))
