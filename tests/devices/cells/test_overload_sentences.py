"""A sentence of its own that means beyond the range: both ends agree on it, and it can be mistaken for nothing else."""

import json
from dataclasses import replace
from math import copysign, inf, isfinite
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.messages import ForceSample, Garbage, Quality
from tests.devices.test_rehearsal import loaded
from tests.profile_files import load_device

WORDS = {"overload": ("S +", "------"), "underload": ("S -",)}
FORCES = st.floats(allow_nan=False).filter(lambda force_n: force_n != 0.0)


def telling(profile: DeviceProfile, **reading: object) -> DeviceProfile:
    """The indicator with such sentences, and without its blanks."""
    assert profile.stream
    return replace(profile, stream=replace(profile.stream, **{"blank_is_overload": False, **WORDS, **reading}))  # type: ignore[arg-type]


@given(FORCES, st.sampled_from([1, -1]))
def test_both_ends_agree_which_end_of_the_range_was_left(indicator: DeviceProfile, force_n: float, sign: int) -> None:
    profile = telling(indicator)
    line = cell_device(profile).frame(force_n, Quality.OVERLOAD)
    side = copysign(inf, force_n)
    assert cell_host(profile, sign).receive(line, 3.0) == [ForceSample(side, sign * side, Quality.OVERLOAD, 3.0)]


@given(FORCES)
def test_a_force_that_the_display_cannot_show_is_said_so(indicator: DeviceProfile, force_n: float) -> None:
    profile = telling(indicator)
    (sample,) = cell_host(profile).receive(cell_device(profile).frame(force_n), 0.0)
    assert isinstance(sample, ForceSample)
    assert (sample.quality is Quality.OVERLOAD) is not isfinite(sample.raw)
    assert sample.force_n == pytest.approx(force_n, abs=0.06) or sample.force_n == copysign(inf, force_n)


@given(st.lists(st.sampled_from([1.0, 1e9, -1e9, 2.0]), max_size=8), st.lists(st.integers(1, 9), max_size=40))
def test_cutting_the_stream_elsewhere_changes_nothing(
    indicator: DeviceProfile, forces_n: list[float], lengths: list[int]
) -> None:
    profile = telling(indicator)
    whole, parted, device = cell_host(profile), cell_host(profile), cell_device(profile)
    stream = b"".join(map(device.frame, forces_n))
    found, rest = [], stream
    for length in [*lengths, len(stream)]:
        found += parted.receive(rest[:length], 0.0)
        rest = rest[length:]
    assert found == whole.receive(stream, 0.0)
    assert not any(isinstance(one, Garbage) for one in found)


def test_each_listed_sentence_is_understood_and_a_part_of_it_is_not(indicator: DeviceProfile) -> None:
    host = cell_host(telling(indicator))
    for text in (b"S +", b"------", b"S -"):
        assert [one.quality for one in host.receive(text + b"\r\n", 0.0)] == [Quality.OVERLOAD]  # type: ignore[union-attr]
        for part in (text[:-1], text[1:], text + b" "):
            assert host.receive(part + b"\r\n", 0.0) == [Garbage(part + b"\r\n")]


def test_known_by_heart_among_many_sentences_it_stays_an_overload(indicator: DeviceProfile) -> None:
    host = cell_host(telling(indicator))
    for count in range(200):
        host.receive(b"ST,GS,+%07.2fkg\r\n" % (count / 100), 0.0)
        assert host.receive(b"S -\r\n", float(count)) == [ForceSample(-inf, -inf, Quality.OVERLOAD, float(count))]


def test_a_checksum_counts_for_it_too(indicator: DeviceProfile) -> None:
    host = cell_host(replace(telling(indicator), checksum="xor"))
    assert host.receive(b"S +\r\n", 0.0) == [Garbage(b"S +\r\n")]
    assert host.receive(b"S +*58\r\n", 0.0) == [ForceSample(inf, inf, Quality.OVERLOAD, 0.0)]


def test_words_in_it_may_be_any_of_theirs(indicator: DeviceProfile) -> None:
    """An indicator prints its overload in place of the digits, and goes on saying what else it says."""
    profile = telling(
        indicator, overload=("{mode:GS|NT},{unit:kg|lb},OVER",), underload=("{mode:GS|NT},{unit:kg|lb},UNDER",)
    )
    device, host = cell_device(profile), cell_host(profile)
    assert device.frame(1e9) == b"GS,kg,OVER\r\n"
    assert device.frame(-1e9) == b"GS,kg,UNDER\r\n"
    for mode in (b"GS", b"NT"):
        for unit in (b"kg", b"lb"):
            for word, side in ((b"OVER", inf), (b"UNDER", -inf)):
                line = b"%b,%b,%b\r\n" % (mode, unit, word)
                assert host.receive(line, 1.0) == [ForceSample(side, side, Quality.OVERLOAD, 1.0)]
    for line in (b"XX,kg,OVER\r\n", b"GS,t,OVER\r\n", b"GS,kg,OVERS\r\n"):
        assert host.receive(line, 1.0) == [Garbage(line)]


def test_a_constant_in_it_is_the_rigs() -> None:
    addressed = replace(load_device("stream-st-gs"), constants={"address": 5})
    profile = telling(addressed, frame="{address:02d},{force:+08.2f}", quality={}, unit="N",
                      overload=("{address:02d},OL",), underload=())  # fmt: skip
    assert cell_device(profile).frame(-1e9) == b"05,OL\r\n", "with one word for both ends it is said at both"
    assert cell_host(profile).receive(b"05,OL\r\n", 0.0) == [ForceSample(inf, inf, Quality.OVERLOAD, 0.0)]
    assert cell_host(profile).receive(b"06,OL\r\n", 0.0) == [Garbage(b"06,OL\r\n")], "another device's"


FRAME = "{status:ST|US|OL},{mode:GS|NT},{force:+08.2f}{unit:kg|lb|g|N}"


@pytest.mark.parametrize(
    ("reading", "place", "told"),
    [
        ({"overload": ["S +"], "underload": ["S -"]}, "", None),
        ({"overload": ["------", "OL,GS,+0099.99kg"]}, "stream.overload[1]",
         f"'OL,GS,+0099.99kg' is an ordinary reading of '{FRAME}', too: leave it out where that means an overload already"),
        ({"underload": ["US,NT,        g"]}, "stream.underload[0]", "is an ordinary reading"),  # blank_is_overload
        ({"overload": ["S"], "underload": ["S -", "S"]}, "stream.underload[1]", "'S' stands here twice: it can mean one side"),
        ({"overload": ["S" * 140]}, "stream.overload[0]", "a line has at most 128 characters"),
        ({"overload": ["S\r\n"]}, "stream", "'S\\r\\n' is not printable text"),
        ({"overload": ["µ"]}, "stream", "'µ' is not printable text"),
        ({"overload": [""]}, "stream", "'' is not printable text"),
        ({"overload": ["OL {force:d}"]}, "stream.overload[0]",
         "'OL {force:d}' of overload or underload carries no number and no text"),
        ({"overload": ["OL {word:4s}"]}, "stream.overload[0]", "nothing changes in it but words and constants"),
        ({"overload": ["{mode:GS|NT},OL,{unit:kg|lb|g|N}"], "underload": ["UL,{mode:GS|NT}"]}, "", None),
        ({"overload": ["ST,GS,{force:------|+0001.00}kg"]}, "stream.overload[0]",
         f"'ST,GS,{{force:------|+0001.00}}kg', as 'ST,GS,+0001.00kg', is an ordinary reading of '{FRAME}', too"),
        ({"underload": ["NT,OL"], "overload": ["{mode:GS|NT},OL"]}, "stream.overload[0]",
         "'{mode:GS|NT},OL', as 'NT,OL', stands here twice"),
        ({"overload": "S +"}, "stream.overload", "is not a list"),
    ],
)  # fmt: skip
def test_a_sentence_that_means_something_else_is_told_with_its_place(
    reading: dict[str, Any], place: str, told: str | None, tmp_path: Path
) -> None:
    faults = loaded(tmp_path, "stream-st-gs", **{f"stream__{key}": value for key, value in reading.items()})
    if told is None:
        assert faults == []
        return
    (fault,) = [one for one in faults if told in one and place in one]
    line, column = map(int, fault.split(":")[1:3] if not place else fault.split(" ")[0].split(":")[1:3])
    text = (tmp_path / "own.yaml").read_text().splitlines()[line - 1]
    last = next(iter(reading.values()))[-1] if place.endswith("]") else None
    assert last is None or text[column - 1 :].startswith(json.dumps(next(reversed(reading.values()))[int(place[-2])]))


@pytest.mark.parametrize(
    ("name", "told"),
    [("laumas-tlb", "beside `modbus` say the bits in `modbus.overload`"), ("hbm-aed-binary", "is read as nothing")],
)
def test_a_device_without_sentences_has_none_of_overload(name: str, told: str, tmp_path: Path) -> None:
    (fault,) = loaded(tmp_path, name, read_force__overload=["OL"])
    assert told in fault
