"""What the program decides by is a type, a code or a field; sentences are for people."""

import re
from pathlib import Path

import pytest

import gateway

SOURCES = sorted(Path(gateway.__file__).parent.rglob("*.py"))
SAYS = r"(sentence|message|reason|said|error|fault\.message|str\([a-z_]+\))"


@pytest.mark.parametrize(
    "decides",
    [
        r"(?<!\")f?\"info [a-z{]",  # the severity is a field of the record, from the code alone
        rf"[\"'][^\"']*[a-z][^\"']*[\"'] (not )?in {SAYS}\b(?!\.)",
        rf"\b{SAYS}(\[.*\])?\.(startswith|endswith)\(",
        r"\bin str\((e|error|exc|problem|getattr)\b",
    ],
)
def test_nothing_is_decided_by_english(decides: str) -> None:
    result = [
        f"{file.name}: {line.strip()}"
        for file in SOURCES
        for line in file.read_text().splitlines()
        if re.search(decides, line)
    ]
    assert not result
