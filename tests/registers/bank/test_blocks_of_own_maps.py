"""Sentences name the blocks of the map in use: they said 200 and 300 whatever the map had."""

from pathlib import Path

import pytest

from gateway.modbus import Peer
from gateway.profiles import load_register_map
from gateway.registers import BankRules, MapError, RegisterBank
from gateway.registers.map.map_reader import read_map
from gateway.registers.refusal import Refusal
from gateway.registers.values import WordOrder, pack_number
from tests.registers.test_register_map import small

SHIPPED = (Path(__file__).parents[3] / "profiles" / "registers" / "force-v1.yaml").read_text()
FLOATS = SHIPPED[SHIPPED.index("  float_cdab:") : SHIPPED.index("  proof:")]
MOVED = FLOATS.replace(" 300", " 3000").replace("395", "3095").replace("332", "3032")
PEER = Peer("10.0.0.9", 40000)


@pytest.mark.parametrize(
    ("floats", "block"),
    [(MOVED, "use block 3000"), (FLOATS.replace("command: 300, ", ""), "use no float block")],
)
def test_the_block_for_swapped_words_is_that_of_the_map_in_use(floats: str, block: str, tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(SHIPPED.replace(FLOATS, floats))
    own = load_register_map(tmp_path / "own.yaml")
    bank = RegisterBank(own, BankRules(rig_name="own", force_max_n=60.0), now=lambda: 0.0)
    told: list[str] = []
    bank.on_accepted = lambda sentence, peer: told.append(sentence)
    with pytest.raises(Refusal) as refused:
        bank.write_registers(202, pack_number("float32", WordOrder.CDAB, 12.0), PEER)
    assert f"your client sends CDAB, {block} or mbpoll -B" in refused.value.sentence
    bank.write_registers(416, pack_number("float32", WordOrder.CDAB, 1234.5), PEER)
    assert told == [f"byte_order_echo CDAB: {block}"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("name: lag, address: 1154, type: float32", "word_order: cdab, ", "lag@staging is float32, low word first"),
        ("name: lag, address: 1654, type: float32", "word_order: cdab, ", "lag@active is float32, low word first"),
        ("name: crc32, address: 1142, type: uint32", "word_order: cdab, ", "crc32@staging is uint32, low word first"),
        (
            "name: rising_b, address: 1506, count: 16, type: float32",
            "word_order: cdab, ",
            "rising_b_0@active is float32, low",
        ),
        ("name: range_low, address: 1002, type: float32", "float32>int32", "range_low@staging is int32"),
    ],
)
def test_a_number_of_an_upload_is_no_other_than_the_gateway_takes_it_for(
    old: str, new: str, told: str, tmp_path: Path
) -> None:
    """It was served: `read lag@active` said -6.98e21 s, and what was staged by its name was another number."""
    before, _, after = new.partition(">")
    changed = old.replace(before, after) if after else f"{new}{old}"
    assert SHIPPED.count(old) == 1
    (tmp_path / "own.yaml").write_text(SHIPPED.replace(old, changed))
    own = load_register_map(tmp_path / "own.yaml")
    with pytest.raises(ValueError, match=f"{told}.*, an upload has (float32|uint32), high word first"):
        RegisterBank(own, BankRules(rig_name="own", force_max_n=60.0), now=lambda: 0.0)


def test_a_word_of_the_command_that_a_map_has_read_only_is_written_by_nobody(tmp_path: Path) -> None:
    ramp = "name: force_ramp, address: 2, type: int16, scale: 0.1, unit: N/s, access: RW"
    assert SHIPPED.count(ramp) == 1
    (tmp_path / "own.yaml").write_text(SHIPPED.replace(ramp, ramp.replace("RW", "R")))
    own = load_register_map(tmp_path / "own.yaml")
    bank = RegisterBank(own, BankRules(rig_name="own", force_max_n=60.0), now=lambda: 0.0)
    bank.write_registers(0, bytes((0, 1, 4, 176)), PEER)
    with pytest.raises(Refusal, match="force_ramp"):
        bank.write_registers(1, bytes((4, 176, 0, 100)), PEER)
    assert bank.command.force_ramp_n_per_s == 0.0


@pytest.mark.parametrize("block", [{"registers": [], "repeats": {}}, {}])
def test_a_block_has_either_registers_or_repeats(block: dict[str, object]) -> None:
    document = small()
    document["blocks"]["other"] = {"first": 20, "last": 29} | block
    with pytest.raises(MapError, match="has either registers or repeats"):
        read_map(document)
