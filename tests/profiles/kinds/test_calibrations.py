"""Coefficients in a file are judged as an upload is, each fault at its number."""

from pathlib import Path

import pytest

from gateway.profiles import ProfileError, load_calibration

SHIPPED = (Path(__file__).parents[3] / "profiles" / "calibrations" / "demo.yaml").read_text(encoding="utf-8")


def told(folder: Path, *edits: tuple[str, str]) -> list[str]:
    lines = {line.partition(":")[0]: line for line in SHIPPED.splitlines()}
    text = SHIPPED
    for key, value in edits:
        text = text.replace(lines[key], f"{key}: {value}")
    path = folder / "calibration.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ProfileError) as caught:
        load_calibration(path)
    return [str(fault).split("calibration.yaml:")[1].partition(":")[2] for fault in caught.value.faults]


def test_the_shipped_calibration_makes_a_model() -> None:
    calibration = load_calibration("demo")
    assert calibration.name == "demo" and calibration.model().force_range_n[1] > 60


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("rising_weights", "[1.0, -0.9, 2.3]", "23 rising_weights[1]: rising weight 1 = -0.9: 0.001 .. 1000 is allowed"),
        ("rising_weights", "[1.0, 1.3e-26, 2.3]", "23 rising_weights[1]: rising weight 1 = 1.3e-26"),
        ("falling_handles_n", "[1.0, 9e9, 65]", "26 falling_handles_n[1]: falling handle 1 = 9e+09: -5000 .. 5000 is allowed"),
        ("rising_handles_n", "[1.0, 65]", "19 rising_handles_n: has 2 entries: order 2 has 3"),
        ("rising_handles_n", "[60, 50, 40]", "20 rising_handles_n[0]: the rising branch is not increasing"),
        ("x1_v", "0", "1 range 0 .. 0 V: 0 <= x0 < x1 <= 10 V is allowed"),
        ("slip_shares", "[1.0]", "15 slip_radii_v: slip stops: 7 radii and 1 shares: as many of each"),
        ("slip_radii_v", "[.001, .2, .3, .4, .5, .6, .7]", "15 slip_radii_v: slip stops give way over"),
        ("slip_radii_v", "[.2, .3, .3, .4, .5, .6, .7]", "24 slip_radii_v[2]: slip radius 2 = 0.3 V, the one before it 0.3 V"),
        ("slip_shares", "[.1, .1, .1, .1, .1, .1, .5]", "15 slip_shares[0]: slip shares add up to 1.1: 1 is needed"),
        ("response", "{dead_time_s: 2, lag_s: 0.1}", "25 response.dead_time_s: dead time = 2: 0 .. 1 s"),
        ("blend_span_n", "14\nforce_limits_n: [9, 3]", "17 force_limits_n: force limits 9 .. 3 N"),
        ("order", "two", '8 order: "two" is not a whole number'),
    ],
)  # fmt: skip
def test_a_wrong_coefficient_is_told_at_its_number(tmp_path: Path, key: str, value: str, sentence: str) -> None:
    found = [text.replace("1: range", "1 range") for text in told(tmp_path, (key, value))]
    assert any(text.startswith(sentence) for text in found), found


def test_crossing_branches_are_no_calibration(tmp_path: Path) -> None:
    lines = {line.partition(":")[0]: line.partition(": ")[2] for line in SHIPPED.splitlines()}
    pairs = [("rising_handles_n", "falling_handles_n"), ("rising_weights", "falling_weights")]
    swapped = [(a, lines[b]) for a, b in pairs] + [(b, lines[a]) for a, b in pairs]
    assert any("below the rising one" in text for text in told(tmp_path, *swapped))
