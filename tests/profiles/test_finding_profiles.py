"""Profiles are found by shipped name or path, and what is not found is told with what is there."""

from pathlib import Path
from typing import Any

import pytest

import gateway
from gateway.profiles import ProfileError, check_file, check_report, find, list_shipped, load_rig
from tests.profile_files import load_device

PROFILES = Path(__file__).parents[2] / "profiles"
DEMO = (PROFILES / "rigs" / "demo.yaml").read_text(encoding="utf-8")


def test_what_the_first_issue_ships() -> None:
    assert {"demo", "irc5-cell"} <= set(list_shipped("rig"))
    assert {"smc-itv-rc", "stream-st-gs"} <= set(list_shipped("device"))
    assert (
        "paper-slide" in list_shipped("plant")
        and "force-v1" in list_shipped("registers")
        and "demo" in list_shipped("calibration")
    )


def test_an_installed_wheel_carries_its_profiles_a_checkout_has_them_beside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert find.shipped_profiles_folder() == PROFILES
    package = tmp_path / "site-packages" / "gateway"
    (package / "_profiles").mkdir(parents=True)
    monkeypatch.setattr(gateway, "__file__", str(package / "__init__.py"))
    assert find.shipped_profiles_folder() == package / "_profiles"


def test_a_name_that_is_neither_shipped_nor_a_file_is_told_with_what_is_there() -> None:
    (fault,) = check_report("dmeo").faults
    assert str(fault) == "dmeo: is neither a shipped rig (demo, irc5-cell, paper-pull) nor a file; did you mean demo?"
    with pytest.raises(ProfileError, match="is neither a shipped device"):
        load_device("no-such-thing")


def test_a_path_that_is_not_there_is_told_with_its_neighbour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rig.yaml").write_text(DEMO, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (fault,) = check_report("./rigg.yaml").faults
    assert str(fault) == "./rigg.yaml: is no file (looked for rigg.yaml); did you mean rig.yaml?"


def test_a_file_of_another_kind_is_no_neighbour_that_was_meant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever did as was told was told then that a register map is no rig."""
    (tmp_path / "rigs.yaml").write_text((PROFILES / "registers" / "force-v1.yaml").read_text(encoding="utf-8"))
    (tmp_path / "rig-7.yaml").write_text(DEMO, encoding="utf-8")
    (tmp_path / "half.yaml").write_text("name: [half", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    said = {name: str(check_report(name).faults[0]) for name in ("rig.yaml", "hal.yaml")}
    assert said["rig.yaml"].endswith("did you mean rig-7.yaml?")
    assert said["hal.yaml"].endswith("did you mean half.yaml?"), "one with a fault may be it"


def test_check_proposes_a_file_of_any_kind_a_rig_one_of_the_kind_that_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`check` takes every kind, so a device's file whose name was mistyped is among what was meant; so are names without an
    ending, which rigs use."""
    device = (PROFILES / "devices" / "smc-itv-rc.yaml").read_text(encoding="utf-8")
    (tmp_path / "devices").mkdir()
    for place in ("my-dac.yaml", "devices/my-other.yaml"):
        (tmp_path / place).write_text(device, encoding="utf-8")
    (tmp_path / "rig.yaml").write_text(
        DEMO.replace("device: smc-itv-rc", "device: my-othr").replace("registers: force-v1", "registers: force_v1")
    )
    monkeypatch.chdir(tmp_path)
    for name, meant in (("my-dacc.yaml", "my-dac.yaml"), ("my-dacc", "my-dac"), ("smc-itv-r", "smc-itv-rc")):
        (fault,) = check_file(name).faults
        assert fault.message.endswith(f"; did you mean {meant}?")
    assert "did you mean" not in str(check_report("my-dacc.yaml").faults[0])
    faults = {fault.path: fault.message for fault in check_file("rig.yaml").faults}
    assert faults["output.device"].endswith("nor a file; did you mean my-other?")
    assert faults["registers"] == (
        "force_v1 is neither a shipped register map (force-v1) nor a file; did you mean force-v1?"
    )


@pytest.mark.parametrize(
    "name", ["", ".", "/", "a\0b", "x" * 5000, "\n", "~", "/proc/self/mem", "no/such/folder/rig.yaml"]
)
def test_no_name_whatever_ends_in_anything_but_a_rig_or_faults(name: str) -> None:
    assert check_report(name).faults


def test_a_file_that_may_not_be_read_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(DEMO, encoding="utf-8")

    def refuse(self: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    (fault,) = check_report(path).faults
    assert fault.message == "cannot be read: Permission denied"


def test_a_folder_that_may_not_be_looked_into_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """'is no file' had its owner look for a mistyped name."""
    path, stat = tmp_path / "shut" / "rig.yaml", Path.stat

    def refuse(self: Path, **how: Any) -> Any:
        if self == path:
            raise PermissionError(13, "Permission denied")
        return stat(self, **how)

    monkeypatch.setattr(Path, "stat", refuse)
    (fault,) = check_report(path).faults
    assert fault.message == "cannot be looked for: Permission denied"


def test_a_file_that_is_far_too_long_is_refused_without_being_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """2 GB given to `check` or `upload` took minutes, and as much memory."""

    def refuse(self: Path) -> bytes:
        raise AssertionError(f"{self} was read as a whole")

    path = tmp_path / "rig.yaml"
    with path.open("wb") as file:
        file.write(b"name: x\n")
        file.truncate(2 << 30)
    monkeypatch.setattr(Path, "read_bytes", refuse)
    for report in (check_report(path), check_file(path)):
        (fault,) = report.faults
        assert fault.message == "is 2147483648 bytes long: a profile has at most 1048576"


def test_a_rig_names_profiles_beside_itself_and_faults_in_them_point_into_them(tmp_path: Path) -> None:
    device = (PROFILES / "devices" / "smc-itv-rc.yaml").read_text(encoding="utf-8")
    (tmp_path / "devices").mkdir()
    (tmp_path / "devices" / "mine.yaml").write_text(device, encoding="utf-8")
    rig = tmp_path / "rig.yaml"
    rig.write_text(DEMO.replace("device: smc-itv-rc", "device: devices/mine.yaml"), encoding="utf-8")
    assert load_rig(rig).output.device == load_device("smc-itv-rc")

    (tmp_path / "devices" / "mine.yaml").write_text(device.replace("terminator:", "terminater:"), encoding="utf-8")
    (fault,) = check_report(rig).faults
    line = device[: device.index("terminator:")].count("\n") + 1
    assert str(fault).endswith(f"devices/mine.yaml:{line}:1 terminater: is not a known key; did you mean terminator?")


def test_the_fingerprint_changes_with_every_text_that_was_read(tmp_path: Path) -> None:
    names = {"plant": "plants/paper-slide", "calibration": "calibrations/demo", "registers": "registers/force-v1"}
    rig = tmp_path / "rig.yaml"
    text = DEMO
    for key, source in names.items():
        shipped_text = (PROFILES / f"{source}.yaml").read_text(encoding="utf-8")
        (tmp_path / f"{key}.yaml").write_text(shipped_text, encoding="utf-8")
        text = text.replace(f"{key}: {source.split('/')[1]}", f"{key}: ./{key}.yaml")
    rig.write_text(text, encoding="utf-8")
    first = load_rig(rig)
    assert set(first.texts) >= {str(rig), *(str(tmp_path / f"{key}.yaml") for key in names)}
    seen = {first.fingerprint}
    for changed in (rig, *(tmp_path / f"{key}.yaml" for key in names)):
        changed.write_text(changed.read_text(encoding="utf-8") + "# a comment\n", encoding="utf-8")
        seen.add(load_rig(rig).fingerprint)
    assert len(seen) == 1 + 1 + len(names)
    assert load_rig("demo").fingerprint == load_rig("demo").fingerprint


@pytest.mark.parametrize(
    ("ending", "shown"), [(r"'\r\n'", r"'\r\n'"), ('"CRLF"', "'CRLF'"), ('"<CR><LF>"', "'<CR><LF>'")]
)
def test_an_ending_that_is_spelt_is_told_so(ending: str, shown: str, tmp_path: Path) -> None:
    """YAML reads no escapes between single quotes, and both look the same in a message."""
    device = (PROFILES / "devices" / "hx711-line.yaml").read_text(encoding="utf-8")
    changed = device.replace('terminator: "\\r\\n"', f"terminator: {ending}")
    assert changed != device
    (tmp_path / "any.yaml").write_text(changed, encoding="utf-8")
    (fault,) = check_file(tmp_path / "any.yaml").faults
    assert f"terminator: {shown} would be {len(shown) - 2} characters on the wire: between double quotes CR LF" in str(
        fault
    )


def test_a_link_whose_file_is_gone_is_told_with_where_it_leads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It stands in the folder, and was said to be no file."""
    (tmp_path / "rig.yaml").symlink_to("/mnt/usb/cell.yaml")
    monkeypatch.chdir(tmp_path)
    (fault,) = check_report("rig.yaml").faults
    assert str(fault) == "rig.yaml: is a link to /mnt/usb/cell.yaml, where no file is"
