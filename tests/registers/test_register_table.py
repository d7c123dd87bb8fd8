"""The register table is the map: every register once, under both names of its address."""

import csv
import io
import json

import pytest

from gateway.registers import render_block, render_registers
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
    assert "mbpoll -1 -p 5020 -t 4:float -B -r 201 -c 46 HOST" in text
    assert "mbpoll -1 -p 5020 -t 4:float -r 301 -c 46 HOST" in text
    widths = {line.count("|") for line in text.splitlines() if line.startswith("|")}
    assert widths == {11}


def test_one_block_can_be_shown_alone(register_map):
    assert render_block(register_map, "command").count("\n") == 2 + 13
    with pytest.raises(LookupError, match="no block comand"):
        render_block(register_map, "comand")


def test_an_unknown_form_is_refused(register_map):
    with pytest.raises(ValueError, match="markdown, csv, json"):
        render_registers(register_map, "yaml")
