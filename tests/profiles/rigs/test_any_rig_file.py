"""Whatever is done to a rig file, the answer is a rig or faults that point into the files: never anything else."""

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.profiles import Report, check_report
from gateway.profiles.strict_yaml.text import parse

DEMO = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text(encoding="utf-8")
IS_PUSH = settings.default is not None and settings.default.derandomize
DRAWN = settings(deadline=None, max_examples=25 if IS_PUSH else 400)
VALUE: dict[str, Any] = parse(DEMO.encode(), "demo.yaml").value

ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=12)
    | st.sampled_from(["yes", "1e3", "0", ""]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6) | st.integers(), inner, max_size=3),
    max_leaves=4,
)


def paths(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield (*path, key)
        yield from paths(value[key], (*path, key))


PATHS = list(paths(VALUE))


@pytest.fixture(scope="module")
def rig_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rigs") / "rig.yaml"


def told(rig_file: Path, source: str) -> Report:
    """The report, after checking that each finding can be shown and points into its file."""
    rig_file.write_text(source, encoding="utf-8", newline="")
    report = check_report(rig_file)
    lines = source.count("\n") + 2
    for fault in (*report.faults, *report.warnings):
        assert fault.message and str(fault).isprintable() and "Traceback" not in fault.message
        assert fault.file != str(rig_file) or 1 <= fault.line <= lines
    return report


def is_a_rig_or_faults(report: Report) -> bool:
    return bool(report.faults) == (report.rig is None)


def parent(document: Any, path: tuple[Any, ...]) -> Any:
    for step in path[:-1]:
        document = document[step]
    return document


@pytest.mark.parametrize("path", PATHS, ids=str)
def test_a_deleted_key_is_missing_or_has_a_default(rig_file: Path, path: tuple[Any, ...]) -> None:
    document = copy.deepcopy(VALUE)
    del parent(document, path)[path[-1]]
    report = told(rig_file, yaml.safe_dump(document, sort_keys=False))
    assert is_a_rig_or_faults(report)
    assert all(fault.line >= 1 for fault in report.faults)


@DRAWN
@given(path=st.sampled_from(PATHS), value=ANYTHING)
def test_any_value_in_any_place_is_taken_or_told(rig_file: Path, path: tuple[Any, ...], value: Any) -> None:
    document = copy.deepcopy(VALUE)
    parent(document, path)[path[-1]] = value
    assert is_a_rig_or_faults(told(rig_file, yaml.safe_dump(document, sort_keys=False, allow_unicode=True)))


@DRAWN
@given(
    path=st.sampled_from([path for path in PATHS if isinstance(path[-1], str)]),
    key=st.text(max_size=12) | st.integers(),
)
def test_any_key_in_any_place_is_known_or_told(rig_file: Path, path: tuple[Any, ...], key: Any) -> None:
    document = copy.deepcopy(VALUE)
    group = parent(document, path)
    group[key] = group.pop(path[-1])
    assert is_a_rig_or_faults(told(rig_file, yaml.safe_dump(document, sort_keys=False, allow_unicode=True)))


@DRAWN
@given(
    start=st.integers(0, len(DEMO)),
    length=st.integers(0, 60),
    put=st.text(alphabet=" \t\n:-#'\"[]{}&*!|>%@`,?ax1.", max_size=6),
)
def test_any_slip_of_the_editor_is_a_rig_or_faults(rig_file: Path, start: int, length: int, put: str) -> None:
    assert is_a_rig_or_faults(told(rig_file, DEMO[:start] + put + DEMO[start + length :]))


def test_windows_line_ends_and_a_byte_order_mark_are_no_fault(rig_file: Path) -> None:
    assert told(rig_file, "\ufeff" + DEMO.replace("\n", "\r\n")).rig is not None
