"""The loader reads YAML 1.2 without its traps, and says where a fault is; with libyaml's parser and with Python's alike."""

from collections.abc import Callable

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.profiles.strict_yaml import text
from gateway.profiles.strict_yaml.faults import ProfileError

STEADY = settings(derandomize=True, deadline=None)
Parse = Callable[[bytes], text.Document]


@pytest.fixture(params=["libyaml", "python"])
def parse(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Parse:
    parser = getattr(yaml, "CBaseLoader", None) if request.param == "libyaml" else yaml.BaseLoader
    if parser is None:
        pytest.skip("PyYAML without libyaml")
    monkeypatch.setattr(text, "_PARSER", parser)
    return lambda data: text.parse(data, "rig.yaml")


def fault_of(parse: Parse, data: bytes) -> str:
    with pytest.raises(ProfileError) as caught:
        parse(data)
    return str(caught.value)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("1e3", 1000.0),
        ("4.1e4", 41000.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("-0.5E-2", -0.005),
        ("12", 12),
        ("+12", 12),
        ("0x1F", 31),
        ("0o17", 15),
        ("0", 0),
        ("true", True),
        ("False", False),
        ("null", None),
        ("~", None),
        ("", None),
        ("yes", "yes"),
        ("no", "no"),
        ("on", "on"),
        ("off", "off"),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("2024-01-01", "2024-01-01"),
        ("1,5", "1,5"),
        ('"12"', "12"),
        ("'true'", "true"),
        ("!!str 12", "12"),
        ("12 N", "12 N"),
    ],
)
def test_a_word_means_what_yaml_1_2_says(parse: Parse, written: str, meant: object) -> None:
    value = parse(f"key: {written}\n".encode()).value["key"]
    assert value == meant and type(value) is type(meant)


BLOCK = "`>` and `|` begin text on the lines below them: quote the text that begins so"
NO_BREAK_SPACE = "a no-break space (U+00A0), as web pages have it: type a plain space"
BEHIND_A_BRACE = "nothing but a comma stands behind `}`: quote the whole of a text that has braces in it"


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "rig.yaml:1:1: the file is empty: keys such as `name:` are expected"),
        (b"# only a comment\n", "rig.yaml:1:1: the file is empty: keys such as `name:` are expected"),
        (b"---\n", "rig.yaml:1:1: the file is empty: keys such as `name:` are expected"),
        (b"- a\n- b\n", "rig.yaml:1:1: a list at the top: keys such as `name:` are expected"),
        (b"demo\n", "rig.yaml:1:1: a single value at the top: keys such as `name:` are expected"),
        (b"a: 1\nb: 2\na: 3\n", "rig.yaml:3:1 a: the key stands twice; the first is in line 1"),
        (b"a:\n  b: 1\n  b: 1\n", "rig.yaml:3:3 a.b: the key stands twice; the first is in line 2"),
        (b"1: a\n'1': b\n", "rig.yaml:2:1 1: the key stands twice; the first is in line 1"),
        (b"a: 0123\n", 'rig.yaml:1:4 a: 0123 has a leading zero (octal or decimal?): write 123, or "0123" if it is text'),
        (b"a: .inf\n", "rig.yaml:1:4 a: .inf is not a finite number"),
        (b"a: -.INF\n", "rig.yaml:1:4 a: -.INF is not a finite number"),
        (b"a: .nan\n", "rig.yaml:1:4 a: .nan is not a finite number"),
        (b"a: 1e999\n", "rig.yaml:1:4 a: 1e999 is too large for a number"),
        (b"a: " + b"9" * 5000, "rig.yaml:1:4 a: a number of 5000 characters: 40 are enough"),
        (b"a:\n\tb: 1\n", "rig.yaml:2:1: a tab: YAML is indented with spaces"),
        (b"a: 1\n\tb: 1\n", "rig.yaml:2:1: a tab: YAML is indented with spaces"),
        (b"a: 'x\nb: 1\n", "rig.yaml:1:4: a quote is opened and never closed"),
        (b"a: [1, 2\nb: 3\n", "rig.yaml:1:4: a list is opened with `[` and not closed, or a comma is missing"),
        (b"a: {x: 1\nb: 3\n", "rig.yaml:1:4: a mapping is opened with `{` and not closed, or a comma is missing"),
        (b"a: 1\nframe: {force:8.2f} kg\n", f"rig.yaml:2:21: {BEHIND_A_BRACE}"),
        (b"frame: {status:ST|OL},{force:+08.2f}\n", f"rig.yaml:1:22: {BEHIND_A_BRACE}"),
        (b"ask: {address:02X}?\n", f"rig.yaml:1:19: {BEHIND_A_BRACE}"),
        (b"a: {frame: {force:8.2f} kg, unit: N}\n", f"rig.yaml:1:25: {BEHIND_A_BRACE}"),
        (b"a: {b: {c: 1} d: 2}\n", f"rig.yaml:1:15: {BEHIND_A_BRACE}"),
        (b"a: 1\n---\nb: 2\n", "rig.yaml:2:1: a second document (`---`): a profile is one document"),
        (b"a: \x07\n", "rig.yaml:1:4: a control character that no text editor shows: delete it"),
        (b"a: *\nb: 1\n", "rig.yaml:1:4: `*` and `&` name a value of YAML: quote the text that begins so"),
        (b"a: {b: *{c:d}}\n", "rig.yaml:1:8: `*` and `&` name a value of YAML: quote the text that begins so"),
        (b"a: &\n", "rig.yaml:1:4: `*` and `&` name a value of YAML: quote the text that begins so"),
        (b"a: @x\n", "rig.yaml:1:4: a value cannot begin with this character: quote the text"),
        ("a: @x \u00a0y\n".encode(), "rig.yaml:1:4: a value cannot begin with this character: quote the text"),
        ("a:\n\u00a0 b: 1\n  c: 2\n".encode(), f"rig.yaml:2:1: {NO_BREAK_SPACE}"),
        ("a: 1\nb:\u00a02\nc: 3\n".encode(), f"rig.yaml:2:3: {NO_BREAK_SPACE}"),
        *((f"a: {begun}V{{v:d}}\n".encode(), f"rig.yaml:1:4: {BLOCK}") for begun in (">", "|", ">+0", "|-")),
        (b"a: !V{v:d}\n", "rig.yaml:1:4: tags (`!...`) are not used here; quote the text"),
        (b"a: !!python/object:os.system x\n",
         "rig.yaml:1:4 a: tag `tag:yaml.org,2002:python/object:os.system`: tags are not used here; quote the text"),
        (b"a: !\n", "rig.yaml:1:4 a: tag `!`: tags are not used here; quote the text"),
        (b"a: !secret x\n", "rig.yaml:1:4 a: tag `!secret`: tags are not used here; quote the text"),
        (b"a: >\nb: 1\n",
         "rig.yaml:1:4 a: `>` begins text on the lines below it, and none is there: quote it where it is meant itself"),
        (b"a:\n  b: |\n  c: 1\n",
         "rig.yaml:2:6 a.b: `|` begins text on the lines below it, and none is there: quote it where it is meant itself"),
        (b"true: 1\n", "rig.yaml:1:1: a key must be a word or a whole number"),
        (b"? [a, b]\n: 1\n", "rig.yaml:1:3: a key must be a word or a whole number"),
        (b"\xff\xfea\x00", "rig.yaml:1:1: the file is UTF-16: save it as UTF-8"),
        ("a: 1\nb: é\n".encode("latin-1"), "rig.yaml:2:4: byte 0xE9 is not UTF-8 (a Latin-1 file?): save it as UTF-8"),
        (b"a: " + b"[" * 900, "rig.yaml:1:35: nested deeper than any profile"),
    ],
)  # fmt: skip
def test_a_trap_is_a_fault_with_its_place(parse: Parse, data: bytes, told: str) -> None:
    assert fault_of(parse, data) == told


def test_brackets_without_end_are_told_as_too_deep(parse: Parse) -> None:
    """Where a newer libyaml gives up, or where ours does."""
    assert fault_of(parse, b"a: " + b"[" * 5000).endswith(": nested deeper than any profile")


def test_wrong_indent_and_second_colon_are_told_in_words(parse: Parse) -> None:
    assert "a second `: ` in one line" in fault_of(parse, b"a: b: c\n")
    assert "rig.yaml:3:2: this line does not fit the lines before it" in fault_of(parse, b"a:\n  b: 1\n c: 2\n")
    assert "nothing can follow here" in fault_of(parse, b"a: 1\n...\nb: 2\n")


def test_anchors_cannot_make_a_document_grow(parse: Parse) -> None:
    bomb = b"a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\n"
    told = fault_of(parse, bomb).splitlines()
    assert (
        told[0]
        == "rig.yaml:1:4 a: `&a`: anchors are not used here; write the value where it is needed, or quote the text"
    )
    assert told[2] == "rig.yaml:2:8 b[0]: `*a`: aliases are not used here; write the value again, or quote the text"
    assert len(told) == 7


def test_every_fault_is_told_at_once(parse: Parse) -> None:
    told = fault_of(parse, b"a: 01\nb: .nan\nb: 2\nc: {d: !x 1}\n").splitlines()
    assert [line.split()[0] for line in told] == ["rig.yaml:1:4", "rig.yaml:2:4", "rig.yaml:3:1", "rig.yaml:4:8"]


def test_byte_order_mark_and_windows_line_ends_change_nothing(parse: Parse) -> None:
    plain = parse(b"a: 1\nb:\n  - c: 2\n")
    windows = parse(b"\xef\xbb\xbfa: 1\r\nb:\r\n  - c: 2\r\n")
    assert windows.value == plain.value and windows.marks == plain.marks


def test_every_value_knows_its_line_and_column(parse: Parse) -> None:
    document = parse("name: äö\nlist: [1, {x: 2}]\ngroup:\n  key: 3\n".encode())
    places = {path: (mark.line, mark.column, mark.key_line, mark.key_column) for path, mark in document.marks.items()}
    assert places == {
        (): (1, 1, 1, 1),
        ("name",): (1, 7, 1, 1),
        ("list",): (2, 7, 2, 1),
        ("list", 0): (2, 8, 2, 8),
        ("list", 1): (2, 11, 2, 11),
        ("list", 1, "x"): (2, 15, 2, 12),
        ("group",): (4, 3, 3, 1),
        ("group", "key"): (4, 8, 4, 3),
    }


def test_a_file_beyond_any_profile_is_not_read(parse: Parse) -> None:
    assert "a profile has at most" in fault_of(parse, b"#" * (2 << 20))


@pytest.mark.parametrize("begin", ["|", ">"])
def test_text_on_the_lines_below_is_text(begin: str) -> None:
    assert text.parse(f"description: {begin}\n  12.5\n".encode(), "rig.yaml").value == {"description": "12.5\n"}


@STEADY
@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_no_bytes_whatever_end_in_anything_but_a_document_or_faults(data: bytes) -> None:
    try:
        document = text.parse(data, "rig.yaml")
    except ProfileError as error:
        assert error.faults and all(fault.file == "rig.yaml" and fault.message for fault in error.faults)
    else:
        assert isinstance(document.value, dict)


@STEADY
@given(st.text(alphabet="ab: -[]{}&*!|>'\"#\n\t01.e,?%@~", max_size=60))
def test_no_yaml_whatever_ends_in_anything_but_a_document_or_faults(source: str) -> None:
    lines = source.count("\n") + 1
    try:
        text.parse(source.encode(), "rig.yaml")
    except ProfileError as error:
        assert all(1 <= fault.line <= lines + 1 and fault.column >= 1 for fault in error.faults)


def test_no_text_has_a_nul_in_it(parse: Parse) -> None:
    """A port of "\\0" ended check with a ValueError of the operating system's call."""
    fault = fault_of(parse, b'name: a\noutput: {port: "/dev/\\0"}')
    assert fault == "rig.yaml:2:16 output.port: `\\0` may stand in no text: leave it out"
