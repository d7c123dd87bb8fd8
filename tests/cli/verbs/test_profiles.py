"""`check`, `init`, `schema`, `registers`, `ports`: what a newcomer types before anything runs."""

import csv
import io
import json
import re
import shutil
from pathlib import Path

import jsonschema
import pytest

from gateway.cli.setup.wire_example import example
from gateway.devices.force_reading import ForceReading
from gateway.ports import PortInfo
from gateway.processes import exit_codes
from gateway.profiles import ProfileError, load_rig, shipped_profiles_folder
from gateway.registers import RegisterMap
from tests.dialogues.cells.test_overload_dialogue import cell
from tests.disk.failing_disks import FailingDisk
from tests.disk.watched_disk import watching


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_disk_that_is_full_keeps_no_half_rig_file_and_the_name_is_free(here: Path, call) -> None:
    with watching(FailingDisk(here.resolve(), "full", 2)):
        answer = call("init", "cell-7")
    assert answer.exit_code == 1 and "cell-7.yaml: No space left" in answer.output
    assert list(here.iterdir()) == []
    assert call("init", "cell-7").exit_code == 0


def test_a_fresh_rig_is_refused_for_its_placeholders_alone_and_runs_once_they_are_edited(here: Path, call) -> None:
    assert call("init", "cell-7").exit_code == 0
    text = (here / "cell-7.yaml").read_text()
    assert text.count("EDIT") >= 8
    document = json.loads(call("check", "cell-7.yaml", "--json").output)
    assert [fault["path"] for fault in document["faults"]] == ["output.port", "load_cell.port"]
    assert all("is a placeholder: put your adapter's path here" in fault["message"] for fault in document["faults"])
    assert all(text.splitlines()[fault["line"] - 1].strip().startswith("port:") for fault in document["faults"])
    (here / "cell-7.yaml").write_text(text.replace("EDIT-output", "usb-A").replace("EDIT-load-cell", "usb-B"))
    answer = call("check", "cell-7.yaml")
    assert answer.exit_code == 0, answer.output
    assert "rig          cell-7: " in answer.output


def test_a_line_that_is_still_marked_edit_is_a_warning_that_says_what_belongs_there(here: Path, call) -> None:
    call("init", "cell")
    text = (here / "cell.yaml").read_text()
    warnings = json.loads(call("check", "cell.yaml", "--json").output)["warnings"]
    marks = {warning["path"]: warning for warning in warnings if "still marked EDIT" in warning["message"]}
    assert "rated force of your cell" in marks["load_cell.range_n"]["message"]
    marked = {number for number, line in enumerate(text.splitlines(), 1) if "# EDIT" in line}
    assert marked - {warning["line"] for warning in marks.values()} == {14, 19}, "the ports are refused instead"
    (here / "cell.yaml").write_text(text.replace("# EDIT", "#"))
    assert "still marked" not in call("check", "cell.yaml").output


def test_a_fresh_rig_runs_simulated_and_says_what_is_left_to_edit(here: Path, call) -> None:
    call("init", "cell")
    rig = load_rig("cell.yaml", simulated=True)
    assert rig.simulated and not rig.ports()
    notes = " / ".join(rig.notes)
    assert "to be edited before it runs without --sim: cell.yaml:14:9 output.port" in notes
    assert "are still marked EDIT: force-gateway check cell.yaml says what each is" in notes
    with pytest.raises(ProfileError, match="placeholder"):
        load_rig("cell.yaml")
    (here / "cell.yaml").write_text(
        "\n".join(line for line in (here / "cell.yaml").read_text().splitlines() if "port: /dev" not in line)
    )
    assert load_rig("cell.yaml", simulated=True).simulated, "no ports at all will do, too"


@pytest.mark.parametrize(
    ("file", "is_one"),
    [
        ("devices/smc-itv-rc", "a device profile"),
        ("devices/stream-st-gs", "a device profile"),
        ("plants/paper-slide", "a plant"),
        ("calibrations/demo", "a calibration"),
        ("registers/force-v1", "a register map"),
    ],
)
def test_check_says_what_a_file_is_and_checks_it_as_that(file: str, is_one: str, here: Path, call) -> None:
    text = (shipped_profiles_folder() / f"{file}.yaml").read_text(encoding="utf-8")
    (here / "c2.yaml").write_text(text, encoding="utf-8")
    answer = call("check", "c2.yaml")
    assert answer.exit_code == 0, answer.output
    assert answer.stdout.startswith(f"c2.yaml is {is_one}; check takes it as one\n")
    (here / "c2.yaml").write_text(text + "no_such_key: 1\n", encoding="utf-8")
    answer = call("check", "c2.yaml")
    assert answer.exit_code == exit_codes.CONFIGURATION
    assert re.search(r"^c2\.yaml:\d+:\d+ no_such_key: is not a known key", answer.stderr, re.MULTILINE), answer.stderr
    assert answer.stderr.endswith(f"1 fault; this {is_one.split(' ', 1)[1]} cannot be used\n")
    (here / "c2.yaml").write_text(text + "\tname: 1\n", encoding="utf-8")  # no YAML: it was called a rig
    answer = call("check", "c2.yaml")
    assert re.search(r"^c2\.yaml:\d+:1: a tab", answer.stderr, re.MULTILINE), answer.stderr
    assert answer.stderr.endswith(f"1 fault; this {is_one.split(' ', 1)[1]} cannot be used\n")


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("groups: 2\nstep_v: 0.5\n", "a ladder of 2 groups in steps of 0.5 V"),
        ("name: next\nparts:\n  - name: rest\n    moves: [{do: force, to: 0, for_s: 1}]\n", ""),
    ],
)
def test_check_takes_plans(text: str, facts: str, here: Path, call) -> None:
    (here / "plan.yaml").write_text(text)
    answer = call("check", "plan.yaml")
    assert "plan.yaml is a plan; check takes it as one" in answer.output
    assert facts in answer.output


def test_the_command_for_a_file_of_another_kind_can_be_pasted(here: Path) -> None:
    """`force-gateway check cell left.yaml` asked for two files."""
    shutil.copy(shipped_profiles_folder() / "calibrations" / "demo.yaml", here / "cell left.yaml")
    with pytest.raises(ProfileError, match=r"`force-gateway check 'cell left.yaml'` takes it as one"):
        load_rig("cell left.yaml")


def test_a_file_of_another_kind_gets_one_sentence(here: Path, call) -> None:
    shutil.copy(shipped_profiles_folder() / "calibrations" / "demo.yaml", here / "c2.yaml")
    with pytest.raises(ProfileError) as refused:
        load_rig("c2.yaml")
    assert str(refused.value) == (
        "c2.yaml: is a calibration, a rig is needed here: `force-gateway check c2.yaml` takes it as one"
    )
    (here / "rig.yaml").write_text(
        (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text().replace("plant: paper-slide", "plant: c2.yaml")
    )
    answer = call("check", "rig.yaml")
    assert re.search(r"^rig\.yaml:\d+:8 plant: c2\.yaml is a calibration, a plant is needed here", answer.stderr), (
        answer.stderr
    )


def test_init_overwrites_nothing(here: Path, call) -> None:
    (here / "my-cell.yaml").write_text("mine")
    answer = call("init")
    assert answer.exit_code == 1
    assert answer.stderr.startswith("E405 my-cell.yaml exists")
    assert (here / "my-cell.yaml").read_text() == "mine"


@pytest.mark.parametrize("name", ["demo", "Cell", "../x", "a b", "sub/x.yaml"])
def test_init_takes_no_name_that_cannot_be_a_rigs(name: str, here: Path, call) -> None:
    assert call("init", name).exit_code == 2
    assert list(here.iterdir()) == []


def test_check_tells_every_fault_with_its_place(here: Path, call) -> None:
    call("init", "cell")
    text = (here / "cell.yaml").read_text()
    text = text.replace("baud: 9600", "baud: 115300").replace("force_max_n: 40", "force_max: 40")
    (here / "cell.yaml").write_text(text)
    answer = call("check", "cell.yaml")
    assert answer.exit_code == 78
    assert "output.baud: 115300 is not one of 300, " in answer.stderr
    assert "did you mean 115200?" in answer.stderr
    assert "did you mean force_max_n" in answer.stderr
    line = 1 + next(at for at, line in enumerate(text.splitlines()) if "115300" in line)
    assert f"cell.yaml:{line}:9 output.baud" in answer.stderr
    document = json.loads(call("check", "cell.yaml", "--json").output)
    assert document["ok"] is False
    assert {"file", "line", "column", "path", "message"} == set(document["faults"][0])


def test_check_takes_a_plant_file_for_what_it_is(here: Path, call) -> None:
    text = (shipped_profiles_folder() / "plants" / "paper-slide.yaml").read_text(encoding="utf-8")
    (here / "plant.yaml").write_text(text, encoding="utf-8")
    done = call("check", "plant.yaml")
    assert done.exit_code == 0
    assert done.output.splitlines()[-1].split(maxsplit=1) == ["ok", "no faults"]
    assert json.loads(call("check", "plant.yaml", "--json").stdout)["plant"].startswith("paper-slide: ")
    (here / "plant.yaml").write_text(text.replace("lag_s: {value: ", "lag_s: {value: x"), encoding="utf-8")
    done = call("check", "plant.yaml")
    assert done.exit_code == exit_codes.CONFIGURATION
    assert "regulator.lag_s" in done.output and "2 faults; this plant cannot be used" in done.output


def test_check_of_the_shipped_rigs_is_ok(call) -> None:
    for rig in ("demo", "irc5-cell"):
        answer = call("check", rig)
        assert answer.exit_code == 0, answer.output
        assert "no faults" in answer.stdout


def test_a_rig_that_is_not_there_is_a_configuration_error(call) -> None:
    answer = call("check", "demoo")
    assert answer.exit_code == 78
    assert "did you mean demo?" in answer.stderr


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("smc-itv-rc", r"on the wire  5 V: 'SET 512\r\n' -> '512\r\n'"),
        ("stream-st-gs", r"on the wire  -20 N: 'ST,GS,-0002.04kg\r\n'"),
        ("laumas-tlb", "on the wire  -20 N: 01 03 00 06 00 05 65 C8 -> 01 03 0A 00 80 00 00 00 CC 00 00 00 00 55 60"),
        ("mcu-valve", r"on the wire  pull: 'VALVE PULL*6D\n' -> 'OK PULL*21\n'"),
        ("stream-st-gs", "read over    mode ('GS', 'NT')"),
        ("adam-4016", "read over    lead ('>', '!')"),
    ],
)
def test_check_shows_what_goes_over_the_wire_and_what_is_not_listened_to(name: str, told: str, call) -> None:
    assert told in call("check", str(shipped_profiles_folder() / "devices" / f"{name}.yaml")).output.splitlines()


@pytest.mark.parametrize(
    ("register", "told"), [(0, False), (40004, True), (30004, True), (39999, True), (29999, False)]
)
def test_a_register_as_manuals_count_them_is_told_with_the_number_that_goes_over_the_wire(
    register: int, told: bool, call, tmp_path: Path
) -> None:
    """40004 was taken as it stands, and the module was silent, or another register answered."""
    text = (shipped_profiles_folder() / "devices" / "waveshare-ao8b.yaml").read_text()
    changed = text.replace("register: 0}", f"register: {register}}}")
    assert changed != text or not register
    (tmp_path / "own.yaml").write_text(changed)
    lines = call("check", str(tmp_path / "own.yaml")).output.splitlines()
    first = 40001 if register > 40000 else 30001
    sentence = (
        f"register     {register} goes out as it stands: if it is a manual's {register}, write {register - first}"
    )
    assert (sentence in lines) is told and any(line.startswith("register ") for line in lines) is told


def test_what_a_small_display_has_no_digits_for_is_shown_smaller() -> None:
    profile = cell(read_force=ForceReading(ask="SI", frame="S {force:6.3f} g", unit="g"))
    assert example(profile) == r"-0.05 N: 'SI\r\n' -> 'S -5.099 g\r\n'"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("hx711-line", r"'-20\r\n'"),
        ("hbm-aed", r"'MSV?;' -> '-0000020\r\n'"),
        ("hbm-aed-binary", "'MSV?;' -> FF FF EC 00 0D 0A"),
    ],
)
def test_a_reading_whose_size_only_a_rig_knows_is_shown_in_counts(name: str, told: str, call) -> None:
    answer = call("check", str(shipped_profiles_folder() / "devices" / f"{name}.yaml"))
    assert answer.exit_code == 0
    assert f"on the wire  -20 counts: {told}" in answer.output.splitlines()
    assert "read over" not in answer.output


@pytest.mark.parametrize("kind", ["rig", "device", "plant", "calibration", "registers"])
def test_schemas_are_schemas(kind: str, call) -> None:
    schema = json.loads(call("schema", kind).output)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert not jsonschema.Draft202012Validator(schema).is_valid([]), "a schema that takes anything checks nothing"


def test_the_register_table_has_three_forms(call, register_map: RegisterMap) -> None:
    entries = json.loads(call("registers", "--format", "json").output)
    rows = list(csv.DictReader(io.StringIO(call("registers", "--format", "csv").output)))
    assert len(entries) == len(rows) == len(register_map.registers)
    promised = set("name address words type scale unit access min max block text values bits".split())
    assert promised <= set(entries[0])
    assert "| force_setpoint |" in call("registers").output


def test_a_map_that_is_not_there_is_told(call) -> None:
    answer = call("registers", "--map", "force-v2")
    assert answer.exit_code == 78
    assert "did you mean force-v1?" in answer.stderr


def test_ports_lists_by_id_names_first(call, monkeypatch: pytest.MonkeyPatch) -> None:
    by_id = "/dev/serial/by-id/usb-FTDI_FT232R_A10K-if00-port0"
    result = [PortInfo(by_id, "/dev/ttyUSB0", "FTDI FT232R USB UART", "ftdi_sio", 16, "minicom (4711)")]
    monkeypatch.setattr("gateway.ports.list_ports", lambda: result)
    answer = call("ports")
    assert answer.output.splitlines()[0] == by_id
    assert "latency timer 16 ms (slow" in answer.output
    assert "in use by minicom (4711)" in answer.output
    assert json.loads(call("ports", "--json").output)[0]["path"] == by_id
    monkeypatch.setattr("gateway.ports.list_ports", list)
    assert "plug the adapter in" in call("ports").output


def test_check_tells_every_face_of_a_rig(call, tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    demo = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    path.write_text(f"{demo}\nfieldbus: [{{type: rtu, port: /dev/ttyS9, unit: 7}}]\n", encoding="utf-8")
    answer = call("check", str(path))
    assert "serial:1     modbus rtu, /dev/ttyS9, 19200 8E1, unit 7" in answer.output
    path.write_text(path.read_text(encoding="utf-8").replace("  bind:", "  plain: false\n  bind:"), encoding="utf-8")
    assert "modbus tcp   off (network.plain: false)" in call("check", str(path)).output
