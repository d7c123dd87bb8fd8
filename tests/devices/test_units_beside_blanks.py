"""A unit that goes while the weight moves stands beside blanks: read as health, or read over, it is still the number's unit."""

import pytest

from gateway.devices import TemplateError, cell_host
from gateway.devices.force_reading import ForceReading, ForceUnit, unit_meant
from gateway.devices.messages import ForceSample, Quality
from gateway.units import NEWTON_PER_UNIT
from tests.dialogues.cells.test_overload_dialogue import cell

RINSTRUM = "\x02{sign: |-}{force:7.2f}{status:G|N|U|O}{motion:M| }{range:-|1|2}{still: kg|   }"
HEALTH = {"G": Quality.OK, "N": Quality.OK, "U": Quality.OVERLOAD, "O": Quality.OVERLOAD}


@pytest.mark.parametrize(
    ("words", "unit", "told"),
    [
        ("status:kg |   ", "N", "{status:...} say kg, which is not unit: N; unit: kg"),
        ("status:kg |   ", None, "say kg, which is not said yet; unit: kg"),
        ("status:kg |lb |   ", "kg", "say kg and lb, and are not read as units: leave those out"),
        ("status:kg|lb|OL", "kg", "say kg and lb"),
        ("still:kN|  ", "N", "say another unit, which is not unit: N; leave unit out and say newton_per_count"),
        ("still:  N| kg|   ", "N", "{still:...} say N and kg"),
        ("still: kg|   ", "N", "{still:...} say kg, which is not unit: N; unit: kg"),
        ("still:N| ", "kg", ""),  # net
        ("still:G|N|g|n", "kg", ""),
        ("still:LB|OK", "kg", ""),  # a battery
        ("status:kg |   ", "kg", ""),
        ("still: lb|   ", "lb", ""),
    ],
)
def test_a_unit_that_is_not_read_has_to_be_the_profile_s(words: str, unit: ForceUnit | None, told: str) -> None:
    """Kilograms were believed as newtons where blanks stood beside them: each force 9.8 times too small."""
    name, _, choice = words.partition(":")
    quality = dict.fromkeys(choice.split("|"), Quality.OK) if name == "status" else {}
    frame = f"{{force:8.2f}}{{{words}}}"
    try:
        ForceReading(frame=frame, unit=unit, quality=quality, rate_hz=10.0, overload=("OVER",))
        refused = ""
    except TemplateError as error:
        refused = str(error)
    assert told in refused and bool(told) is bool(refused)


def test_beside_a_unit_that_is_read_another_number_may_have_its_own() -> None:
    reading = ForceReading(
        frame="{force:8.2f}{unit:kg|lb} {tare:8.2f}{of_tare:kg|lb|  }", rate_hz=10.0, overload=("OL",)
    )
    (found,) = cell_host(cell(stream=reading)).receive(b"    1.00lb     2.00kg\r\n", 0.0)
    assert isinstance(found, ForceSample) and found.force_n == pytest.approx(NEWTON_PER_UNIT["lb"])


@pytest.mark.parametrize("line", [b"\x02-   2.34GM-   \r\n", b"\x02-   2.34G - kg\r\n"])
def test_a_unit_beside_another_status_is_read_over(line: bytes) -> None:
    """Format A of a Rinstrum R320 has both: G, N, U or O, and a unit that goes while the weight moves."""
    reading = ForceReading(frame=RINSTRUM, unit="kg", quality=HEALTH, rate_hz=10.0)
    (found,) = cell_host(cell(stream=reading)).receive(line, 0.0)
    assert isinstance(found, ForceSample) and found.force_n == pytest.approx(-2.34 * NEWTON_PER_UNIT["kg"])


@pytest.mark.parametrize(
    ("words", "unit"),
    [("N", "N"), ("kg Kg KG kgf kgF KGF", "kg"), ("g gf gF", "g"), ("lb Lb LB lbs LBS lbf lbF LBF", "lb")],
)
def test_a_unit_is_known_however_indicators_write_it(words: str, unit: str) -> None:
    assert {unit_meant(f" {word} ") for word in words.split()} == {unit}
    assert {unit_meant(word) for word in ("kN", "MN", "oz")} == {"another unit"}
