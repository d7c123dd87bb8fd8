"""Frames of load cells whose status is a character of bits, or whose overload stands among words that change: Pavone DAT,
General Measure M02, Brecknell, Lutron, Ohaus, Dini Argeo, Sewha, and Digi, which is asked by ENQ, as makers print them."""

from dataclasses import replace
from math import inf

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.checksum import add_checksum
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.devices.rehearsal import rehearse
from tests.dialogues.cells.test_overload_dialogue import cell

OK, UNSTABLE, OVERLOAD = Quality.OK, Quality.UNSTABLE, Quality.OVERLOAD
KG_N, POUND_N = 9.80665, 4.4482216152605


def words(first: int, count: int) -> tuple[str, str]:
    """Characters of bits from this one on, and those whose bit 3 is set."""
    return "|".join(map(chr, range(first, first + count))), "".join(
        chr(one) for one in range(first, first + count) if one & 8
    )


DAT, _ = words(0x30, 16)
PAVONE = (
    replace(  # DAT 200, page 24: STX, status (bit 1: stable), 8 characters, ETX, exclusive or of what is between, EOT
        cell(
            terminator="\x04",
            stream=ForceReading(
                frame=f"\x02{{status:{DAT}}}{{force:8.2f}}\x03",
                unit="kg",
                quality={one: OK if ord(one) & 2 else UNSTABLE for one in DAT.split("|")},
                overload=(f"\x02{{status:{DAT}}}^^^^^^^^\x03", f"\x02{{status:{DAT}}}  O-L   \x03"),
                underload=(f"\x02{{status:{DAT}}}________\x03",),
                rate_hz=10.0,
            ),
        ),
        checksum="xor-stx-etx",
    )
)
GM, GM_MINUS = words(0x40, 32)
GENERAL_MEASURE = (
    replace(  # M02, page 37: bit 0 stable, 1 overflow, 3 minus; 6 digits, else OFL; sum of all, two decimal digits
        cell(
            constants={"scale": 1},
            stream=ForceReading(
                frame=f"\x02{{scale:02d}}1@{{status:{GM}}}{{force:6d}}",
                newton_per_count=0.01,
                quality={one: OVERLOAD if ord(one) & 2 else OK if ord(one) & 1 else UNSTABLE for one in GM.split("|")},
                negative=tuple(GM_MINUS),
                overload=(f"\x02{{scale:02d}}1@{{status:{GM}}}  OFL ",),
                rate_hz=50.0,
            ),
        ),
        checksum="sum-decimal",
    )
)
BRECKNELL = cell(  # 67XXU, page 68: the over-capacity line goes on saying unit and status
    terminator="\r\x03",
    read_force=ForceReading(
        ask="W",
        frame="\n{force:8.2f}{unit:kg   |lb   }\r\nS{status:00|01|02|10}",
        unit="kg",
        quality={"00": OK, "01": UNSTABLE, "02": OK, "10": UNSTABLE},
        overload=("\n^^^^^^^^{unit:kg   |lb   }\r\nS{status:00|01|02|10}",),
        underload=("\n________{unit:kg   |lb   }\r\nS{status:00|01|02|10}",),
    ),
)
LUTRON = cell(  # FG-6005SD, page 26: 41, unit (59: newton), polarity, decimals, 8 digits
    terminator="\r",
    stream=ForceReading(
        frame="\x024159{status:0|1}2{force:08d}",
        newton_per_count=0.01,
        quality={"0": OK, "1": OK},
        negative=("1",),
        rate_hz=10.0,
    ),
)
DEFENDER = cell(  # Ohaus Defender 3000, as captured: G or N, with ? while it moves
    stream=ForceReading(
        frame="{force:8.3f} kg{status:    G|    N|   ?G|   ?N}",
        unit="kg",
        quality={"    G": OK, "    N": OK, "   ?G": UNSTABLE, "   ?N": UNSTABLE},
        rate_hz=10.0,
    )
)
DINI = cell(  # 3590EXP, page 65: the AF string, with a tare behind
    stream=ForceReading(
        frame="{status:ST|US|OL|UL},1,{force:10.3f}kg,{preset:  |PT}{tare:10.3f}kg",
        unit="kg",
        quality={"ST": OK, "US": UNSTABLE, "OL": OVERLOAD, "UL": OVERLOAD},
        rate_hz=10.0,
    )
)
SEWHA = cell(  # SI 480E, page 35: station, state, net, decimals, sign, 7 digits
    terminator="\x03",
    constants={"id": "01"},
    read_force=ForceReading(
        ask="\x02{id:2s}RCWT",
        frame="\x02{id:2s}RCWT{status:S|U|O}{kind:N|G}P3{sign:+|-}{force:07d}kg",
        newton_per_count=0.001 * KG_N,
        quality={"S": OK, "U": UNSTABLE, "O": OVERLOAD},
    ),
)
DIGI = cell(  # DS-470, pages 17 and 18: gross, net and tare without headers, asked by ENQ
    read_force=ForceReading(ask="\x05", frame="{force:5d}\r{net:5d}\r{tare:5d}", newton_per_count=0.1)
)


def sample(raw: float, per_unit: float, quality: Quality = OK) -> ForceSample:
    return ForceSample(pytest.approx(raw), pytest.approx(raw * per_unit), quality, 0.0)


OVER, UNDER = ForceSample(inf, inf, OVERLOAD, 0.0), ForceSample(-inf, -inf, OVERLOAD, 0.0)


@pytest.mark.parametrize(
    ("profile", "line", "found"),
    [
        (PAVONE, b"\x022   12.34\x0338\x04", sample(12.34, KG_N)),
        (PAVONE, b"\x022   -2.04\x0327\x04", sample(-2.04, KG_N)),
        (PAVONE, b"\x020   12.34\x033A\x04", sample(12.34, KG_N, UNSTABLE)),
        (PAVONE, b"\x022   -2.04\x0324\x04", None),  # exclusive or of ETX, too
        (PAVONE, b"\x022^^^^^^^^\x0332\x04", OVER),
        (PAVONE, b"\x021  O-L   \x033F\x04", OVER),
        (PAVONE, b"\x026________\x0336\x04", UNDER),
        (GENERAL_MEASURE, bytes.fromhex("02 30 31 31 40 41 20 20 20 37 30 30 32 34 0D 0A"), sample(700, 0.01)),
        (GENERAL_MEASURE, b"\x02011@I   70032\r\n", sample(-700, 0.01)),
        (GENERAL_MEASURE, b"\x02011@@    1203\r\n", sample(12, 0.01, UNSTABLE)),
        (GENERAL_MEASURE, b"\x02011@C  OFL 00\r\n", OVER),
        (GENERAL_MEASURE, b"\x02011@A   70025\r\n", None),
        (GENERAL_MEASURE, b"\x02021@A   70025\r\n", None),  # scale 2
        (BRECKNELL, b"\n   12.34kg   \r\nS00\r\x03", sample(12.34, KG_N)),
        (BRECKNELL, b"\n^^^^^^^^lb   \r\nS01\r\x03", OVER),
        (BRECKNELL, b"\n________kg   \r\nS00\r\x03", UNDER),
        (BRECKNELL, b"\n-------- kg  \r\nS00\r\x03", None),  # an error of its zero
        (LUTRON, b"\x0241590200001234\r", sample(1234, 0.01)),
        (LUTRON, b"\x0241591200001234\r", sample(-1234, 0.01)),
        (LUTRON, b"\x0241590100001234\r", None),  # one decimal
        (LUTRON, b"\x0241550200001234\r", None),  # kilograms
        (DEFENDER, b"   0.360 kg    G\r\n", sample(0.36, KG_N)),
        (DEFENDER, b"-  1.640 kg    N\r\n", sample(-1.64, KG_N)),
        (DEFENDER, b"   0.355 kg   ?G\r\n", sample(0.355, KG_N, UNSTABLE)),
        (DEFENDER, b"   0.360 lb    G\r\n", None),
        (DINI, b"US,1,    -2.039kg,PT     1.000kg\r\n", sample(-2.039, KG_N, UNSTABLE)),
        (DINI, b"UL,1,   -99.999kg,       0.000kg\r\n", sample(-99.999, KG_N, OVERLOAD)),
        (SEWHA, b"\x0201RCWTSNP3-0002039kg\x03", sample(-2039, 0.001 * KG_N)),
        (SEWHA, b"\x0201RCWTSNP2+0002039kg\x03", None),  # two decimals
        (SEWHA, b"\x0202RCWTSNP3+0002039kg\x03", None),
        (DIGI, b" -123\r -100\r   23\r\n", sample(-123, 0.1)),
    ],
)
def test_a_frame_is_read_as_it_is_printed(profile: DeviceProfile, line: bytes, found: ForceSample | None) -> None:
    told = Garbage(line) if found is None else found
    assert cell_host(profile).receive(line, 0.0) == [told]
    host = cell_host(profile)
    assert [one for byte in line for one in host.receive(bytes([byte]), 0.0)] == [told], "byte by byte"


PROFILES = {
    "pavone": PAVONE,
    "general measure": GENERAL_MEASURE,
    "brecknell": BRECKNELL,
    "lutron": LUTRON,
    "defender": DEFENDER,
    "dini": DINI,
    "sewha": SEWHA,
    "digi": DIGI,
}


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_the_simulated_one_is_read_as_what_it_shows(profile: DeviceProfile) -> None:
    assert list(rehearse(profile)) == []
    device, host = cell_device(profile), cell_host(profile)
    for force_n in (-7.5, -0.001, 0.0, 0.2, 5.0, 7.6):
        (found,) = host.receive(device.frame(force_n), 0.0)
        assert isinstance(found, ForceSample)
        assert found.force_n == pytest.approx(force_n, abs=0.51 * max(host.resolution_n, 1e-6)), device.frame(force_n)
    if profile.reading.says_overload:
        (found,) = host.receive(device.frame(1e12), 0.0)
        assert isinstance(found, ForceSample)
        assert found.quality is OVERLOAD and found.force_n > 50.0


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_the_rest_of_a_frame_that_was_cut_is_no_other_force(profile: DeviceProfile) -> None:
    line = cell_device(profile).frame(5.0)
    (whole,) = cell_host(profile).receive(line, 0.0)
    for cut in range(1, len(line)):
        found = cell_host(profile).receive(line[cut:] + line + line, 0.0)
        assert found[-1] == whole, line[cut:]
        assert [one for one in found if isinstance(one, ForceSample) and one != whole] == [], line[cut:]


def test_a_question_of_one_control_character_goes_out() -> None:
    assert cell_host(DIGI).poll() == b"\x05\r\n"
    assert cell_device(DIGI).receive(b"\x05\r\n", 0.0) == 1


def test_the_checksums_are_those_of_the_manuals() -> None:
    assert add_checksum(bytes.fromhex("02 30 31 31 40 41 20 20 20 37 30 30"), "sum-decimal").endswith(b"24")
    assert add_checksum(b"\x022   -2.04\x03", "xor-stx-etx") == b"\x022   -2.04\x0327"


def test_a_sign_that_is_no_minus_is_told_where_it_belongs() -> None:
    with pytest.raises(ValueError, match="Where that is another character call it"):
        ForceReading(frame="\x024159{sign:0|1}2{force:08d}", newton_per_count=0.01, rate_hz=10.0)
