"""The register table is the map: every register once, under both names of its address."""

import csv
import io
import json
import re
from copy import deepcopy

import pytest

from gateway.modbus import Role
from gateway.registers import BankRules, RegisterBank, Status, render_block, render_registers
from gateway.registers.image import RegisterImage
from gateway.registers.map.map_reader import read_map
from gateway.registers.words import State

FIELDS = [
    "name",
    "address",
    "words",
    "type",
    "scale",
    "unit",
    "access",
    "min",
    "max",
    "block",
    "text",
    "values",
    "bits",
]


def test_json_lists_every_register_with_the_promised_fields(register_map):
    entries = json.loads(render_registers(register_map, "json"))
    assert len(entries) == len(register_map.registers)
    for entry in entries:
        assert [field for field in FIELDS if field not in entry] == []
    assert len({(entry["name"], entry["block"]) for entry in entries}) == len(entries)
    (setpoint,) = (entry for entry in entries if (entry["name"], entry["block"]) == ("force_setpoint", "command"))
    assert {field: setpoint[field] for field in FIELDS[1:9]} == {
        "address": 1,
        "words": 1,
        "type": "int16",
        "scale": 0.01,
        "unit": "N",
        "access": "RW",
        "min": 0,
        "max": 327.67,
    }
    (state,) = (entry for entry in entries if (entry["name"], entry["block"]) == ("state", "status"))
    assert state["values"] == {str(member.value): member.name.lower() for member in State}


def test_csv_has_one_row_per_register(register_map):
    rows = list(csv.DictReader(io.StringIO(render_registers(register_map, "csv"))))
    assert len(rows) == len(register_map.registers)
    assert rows[1] | {"text": ""} == {
        "block": "command",
        "4xxxx/3xxxx": "40002/30002",
        "address": "1",
        "hex": "0x0001",
        "R/W": "RW",
        "name": "force_setpoint",
        "type": "int16",
        "scale": "0.01",
        "unit": "N",
        "range": "0 .. 327.67",
        "text": "",
    }


def test_markdown_has_all_blocks_and_the_masters_own_words(register_map):
    text = render_registers(register_map, "markdown")
    assert text.count("\n## ") == len(register_map.blocks)
    assert f"map_hash 0x{register_map.map_hash:08X}" in text
    assert "| 40103/30103 | 102 | 0x0066 | R | force_measured | int16 | 0.01 | N |" in text
    assert "| 40203/30203 | 202 | 0x00CA | RW | force_setpoint | float32 ABCD | 1 | N |" in text
    assert "0 off, 1 ready, 2 ramping, 3 holding, 4 fault" in text
    assert "MB_MODE 1 writes, MB_DATA_ADDR 40001, MB_DATA_LEN 13" in text
    assert "mbpoll -1 -p 5020 -t 4:float -B -r 201 -c 48 HOST" in text
    assert "mbpoll -1 -p 5020 -t 4:float -r 301 -c 48 HOST" in text
    widths = {line.count("|") for line in text.splitlines() if line.startswith("|")}
    assert widths == {11}


S7_ROW = re.compile(r"- S7 MB_CLIENT: MB_MODE (\d) (reads|writes), MB_DATA_ADDR 4(\d{4}), MB_DATA_LEN (\d+) \(")
MBPOLL_ROW = re.compile(r"- mbpoll -1 -p 5020 (-t 4:float )?(-B )?-r (\d+) -c (\d+) HOST")


def rows_of(text: str, mode: int) -> list[tuple[int, int]]:
    """(first address, words) of every S7 row."""
    found = [tuple(map(int, (kind, name, words))) for kind, _, name, words in S7_ROW.findall(text)]
    return [(name - 1, words) for kind, name, words in found if kind == mode]


def addresses(rows: list[tuple[int, int]]) -> list[int]:
    return [first + k for first, words in rows for k in range(words)]


def test_the_s7_rows_read_every_block_whole_and_cut_no_value(bank, register_map):
    rows = rows_of(render_registers(register_map, "markdown"), 0)
    read = addresses(rows)
    assert len(read) == len(set(read))
    assert {at for r in register_map.registers for at in range(r.address, r.address + r.words)} <= set(read)
    assert max(words for _, words in rows) <= 125
    for first, words in rows:
        assert len(bank.read_registers(first, words)) == 2 * words
        assert RegisterImage(register_map).cuts_value(first, words) is None
    staging, active = ([(a - base, n) for a, n in rows if base <= a < base + 200] for base in (1000, 1500))
    assert staging == active == [(0, 124), (124, 76)]


def test_the_s7_rows_write_all_that_may_be_written_and_what_acts_alone(make_bank, master_of, register_map):
    rows = rows_of(render_registers(register_map, "markdown"), 1)
    written = addresses(rows)
    assert {r.address for r in register_map.registers if r.is_writable} <= set(written)
    assert max(words for _, words in rows) <= 123
    assert rows[-2:] == [(1145, 1), (1149, 1)], "after the set that they act on"
    master = master_of(make_bank(), "10.0.0.1", Role.CALIBRATION)
    for first, words in rows:
        if first != 1149 and first != 416:  # would select a slot; takes 1234.5 only
            master.write(first, *(0,) * words)


def test_the_mbpoll_rows_read_the_same(register_map):
    text = render_registers(register_map, "markdown")
    told = [(int(name) - 1, (2 if typed else 1) * int(count)) for typed, _, name, count in MBPOLL_ROW.findall(text)]
    assert told == rows_of(text, 0)


def test_one_block_can_be_shown_alone(register_map):
    assert render_block(register_map, "command").count("\n") == 2 + 13
    with pytest.raises(LookupError, match="no block comand"):
        render_block(register_map, "comand")


def test_an_unknown_form_is_refused(register_map):
    with pytest.raises(ValueError, match="markdown, csv, json"):
        render_registers(register_map, "yaml")


def test_the_coils_are_where_the_words_are(document, register_map):
    assert "Coils 0-15 (FC01, FC05, FC15) are the bits of control_word, coils 100-115" in render_registers(
        register_map, "markdown"
    )
    moved = deepcopy(document)
    moved["blocks"]["status"] |= {"first": 140, "last": 171}
    for register in moved["blocks"]["status"]["registers"]:
        register["address"] += 40
    bank = RegisterBank(read_map(moved), BankRules(rig_name="own", force_max_n=60.0), now=lambda: 0.0)
    bank.publish(Status(status_word=0b110))
    assert bank.read_bits(140, 16) == b"\x06\0"
    assert "coils 140-155 those of status_word" in render_registers(read_map(moved), "markdown")
    del moved["blocks"]["command"]["registers"][0]
    assert "(FC01, FC05, FC15)" not in render_registers(read_map(moved), "markdown"), (
        "nor are there any without the word"
    )
