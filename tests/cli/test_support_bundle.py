"""A bundle tells how it is, and no secret: whatever stands in the rig's files and the events."""

import json
import os
import tarfile
from dataclasses import fields
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gateway.cli.main import command
from gateway.cli.support_bundle import Redaction, collect_parts, pack_bundle
from gateway.processes.event import encode_event, make_event
from gateway.processes.event_file import EventFile
from gateway.profiles.http_sections import Web
from gateway.profiles.telemetry_sections import BrokerTls, Mqtt, SparkplugNode

SECRETS = """web:
  token: s3cr3t-t0ken
mqtt: {"password_file": "/etc/secret/mqtt", user: robot}
  - api_secret = hunter2
key: |
  -----BEGIN PRIVATE KEY-----
  MIIEvQIBADANBg
  -----END PRIVATE KEY-----
force_max_n: 50
"""


def gateway(*words: str | Path) -> Result:
    return CliRunner().invoke(command, [*map(str, words)])


def with_events(state: Path, *sentences: str) -> Path:
    state.mkdir()
    file = EventFile(state)
    for sentence in sentences:
        file.append(encode_event(make_event(0.0, "control", "refusal", sentence)))
    file.close()
    return state


def test_no_secret_of_a_rig_goes_in_and_all_else_stays() -> None:
    text = Redaction()(SECRETS)
    for secret in ("s3cr3t", "hunter2", "MIIEvQ", "PRIVATE"):
        assert secret not in text
    assert "force_max_n: 50" in text and "token: (left out)" in text


def test_a_secret_in_a_comment_or_in_the_middle_of_a_sentence_does_not_go_in_either() -> None:
    text = Redaction()(
        "# was: passwd=s3cr3t-1, Passwort: s3cr3t-2 (api_key 'x')\n"
        '{"text": "mqtt://robot:s3cr3t-3@broker failed; Authorization: Bearer s3cr3t-4; token=s3cr3t-5;", "time": "10:31:47"}\n'
        'api-key: "s3cr3t-6"\n'
        '{"text": "http://broker/?key=s3cr3t-7&x=1 failed; Kennwort: s3cr3t-8, db_pass=s3cr3t-9, PIN: 4711s3cr3t"}\n'
    )
    assert "s3cr3t" not in text
    assert json.loads(text.splitlines()[1])["time"] == "10:31:47"
    assert "@broker failed" in text and "&x=1 failed" in text
    harmless = "pin 3 is ground, compass: N, key=3, 4 pins 1000 mm, bypass: open"
    assert Redaction()(harmless) == harmless


@pytest.mark.parametrize(
    "comment",
    [
        "# the old token was s3cr3t-abc",
        "limits: 3  # password of the router is s3cr3t-abc, ask Anna",
        "#PSK s3cr3t-abc",
        "  # Passwort für den Broker: >>s3cr3t abc<<",
        "# wifi passphrase 's3cr3t one two'",
        "# pass: s3cr3t one two",
        "# Kennwort s3cr3t",
        "# see http://grafana/?key=s3cr3t of hall 3",
        "# the PIN is 4711, s3cr3t",
    ],
)
def test_a_secret_that_a_comment_of_a_rig_tells_in_a_sentence_does_not_go_in(comment: str, tmp_path: Path) -> None:
    text = f"name: cell  # token ring, pinned, of hall 3\n{comment}\nforce_max_n: 50  # of the tool, pin 3\n"
    told = collect_parts(with_events(tmp_path / "state"), lambda: [("cell.yaml", text)])["rig.txt"]
    assert "s3cr3t" not in told and "one two" not in told and "(left out)" in told
    assert "name: cell  # token (left out)" in told and "force_max_n: 50  # of the tool, pin 3" in told


def test_what_a_fault_quotes_of_a_section_with_secrets_does_not_go_in(tmp_path: Path) -> None:
    """A token that stands where its section should be was in the sentence that says so."""
    rig = tmp_path / "cell.yaml"
    rig.write_text("name: cell\nweb: s3cr3t-abcdefghijklmnop\n")
    state = with_events(tmp_path / "state", 'E151 cell.yaml:2:6 web: "s3cr3t-abcdefghijklmnop" is not a group of keys')
    told = gateway("report", "--show", "--rig", rig, "--state", state).output
    assert "s3cr3t" not in told and told.count("is not a group of keys") == 2
    event = next(line for line in told.splitlines() if line.startswith('{"time"'))
    assert 'web: "(left out)" is not' in json.loads(event)["text"]


@pytest.mark.parametrize(
    "section",
    [
        "web: {s3cr3t-abc: 1}",
        "web:\n  token s3cr3t-abc: x",
        "web:\n  s3cr3t-abc: 1\n  s3cr3t-abc: 2",
        "web:\n  token: !s3cr3t-abc x",
        "web: !!s3cr3t-abc x",
        "mqtt: {host: broker, password s3cr3t-abc: 1}",
    ],
)
def test_a_secret_that_stands_as_a_key_or_tag_does_not_go_in_either(section: str, tmp_path: Path) -> None:
    """`web.TOKEN: is not a known key` was in the bundle, and so were the events that had said it."""
    rig = tmp_path / "cell.yaml"
    rig.write_text(f"name: cell\n{section}\n")
    checked = gateway("check", rig)
    said = next(line for line in checked.output.splitlines() if "s3cr3t" in line)
    state = with_events(tmp_path / "state", f"E151 {said}\n{said}")
    told = gateway("report", "--show", "--rig", rig, "--state", state).output
    assert "s3cr3t" not in told and "(left out)" in told


def test_a_key_of_a_section_with_secrets_that_is_known_stays(tmp_path: Path) -> None:
    keys = [each.name for kind in (Web, Mqtt, BrokerTls, SparkplugNode) for each in fields(kind)]
    faults = "\n".join(
        f"cell.yaml:2:{row} mqtt.{key}: what stands there is not text" for row, key in enumerate(keys, 1)
    )
    told = Redaction()(faults).splitlines()
    assert [line.split("mqtt.")[1].split(":")[0] for line in told] == keys


def test_an_address_of_ipv6_is_one_too() -> None:
    text = Redaction()(
        "W204 [2001:db8::5]:40112 at 10:31:47.123Z, fe80::1ff:fe23:4567:890a%eth0, 2001:db8::5; bind ::1"
    )
    assert text == "W204 [master-1]:40112 at 10:31:47.123Z, master-2%eth0, master-1; bind ::1"


def test_a_master_has_the_same_name_in_every_part_and_never_its_address(tmp_path: Path) -> None:
    state = with_events(tmp_path / "state", "W204 10.1.2.3 asked for 72 N", "W204 10.1.2.4", "W204 10.1.2.3 again")
    parts = collect_parts(state, lambda: [("rig.yaml", "allow: [10.1.2.4/32]\nbind: 127.0.0.1\n")])
    told = [json.loads(line)["text"] for line in parts["events.jsonl"].splitlines()]
    owners = [text.split()[0] for text in told]
    assert owners[0] == owners[2] != owners[1]
    assert f"allow: [{owners[1]}/32]" in parts["rig.txt"] and "bind: 127.0.0.1" in parts["rig.txt"]
    assert "10.1.2." not in "".join(parts.values())


def test_what_cannot_be_read_is_said_and_the_rest_is_packed(tmp_path: Path) -> None:
    state, target = with_events(tmp_path / "state", "A310 master lost"), tmp_path / "bundle.tar.gz"
    done = gateway("report", target, "--state", state, "--rig", "demo")
    assert done.exit_code == 0, done.stderr
    with tarfile.open(target) as archive:
        texts = {Path(name).name: archive.extractfile(name).read().decode() for name in archive.getnames()}  # type: ignore[union-attr]
    assert "A310" in texts["events.jsonl"] and "force-gateway" in json.loads(texts["versions.json"])
    assert "name: demo" in texts["rig.txt"]
    assert texts["live.json"].startswith("not in it: E140"), "no gateway runs"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bundle.tar.gz", "state"], "nothing half beside it"
    again = gateway("report", target, "--state", state, "--rig", "demo")
    assert again.exit_code == 1 and "E405" in again.stderr


def test_who_packs_a_bundle_is_told_what_is_not_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a service's state a user who may not read it sent a bundle without events, and the list of files was just empty."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "none"))
    done = gateway("report", tmp_path / "b.tar.gz", "--rig", "demo")
    told = {line.split()[0]: line for line in done.stderr.splitlines()}
    assert done.exit_code == 0 and {"live.json", "health.json", "state.txt"} <= told.keys()
    packed = set(done.stdout.split(" into ")[0].removeprefix("packed ").split(", "))
    assert {"versions.json", "rig.txt"} <= packed and not packed & told.keys(), "nothing is said to be in it and not"
    assert (
        told["state.txt"].endswith("/none/force-gateway/demo: No such file or directory") and "Errno" not in done.stderr
    )


def test_a_link_of_the_state_leads_nowhere_in_it_and_the_newest_events_are_there(tmp_path: Path) -> None:
    state = with_events(tmp_path / "state", *(f"W204 number {number}" for number in range(30)))
    (tmp_path / "other.txt").write_text("x")
    (state / "link").symlink_to(tmp_path / "other.txt")
    parts = collect_parts(state, list)
    assert "link" not in parts["state.txt"]
    assert len(parts["events.jsonl"].splitlines()) == 30


def test_a_rig_with_faults_has_its_faults_in_the_bundle_and_all_else(tmp_path: Path) -> None:
    """That is when somebody wants help."""
    state, rig, target = (
        with_events(tmp_path / "state", "A310 master lost"),
        tmp_path / "cell.yaml",
        tmp_path / "b.tar.gz",
    )
    rig.write_text("name: cell\nweb: {token: quokka horse}\n")
    done = gateway("report", target, "--state", state, "--rig", rig)
    assert done.exit_code == 0, done.stderr
    with tarfile.open(target) as archive:
        texts = {Path(name).name: archive.extractfile(name).read().decode() for name in archive.getnames()}  # type: ignore[union-attr]
    assert texts["rig.txt"].startswith("not in it: ") and "limits: is missing" in texts["rig.txt"]
    assert "A310" in texts["events.jsonl"] and not any("quokka" in text for text in texts.values())


def test_a_file_whose_name_is_no_text_is_listed_all_the_same(tmp_path: Path) -> None:
    state, target = with_events(tmp_path / "state", "A310 master lost"), tmp_path / "b.tar.gz"
    (state / os.fsdecode(b"odd-\xff")).write_text("x")
    done = gateway("report", target, "--state", state, "--rig", "demo")
    assert done.exit_code == 0, done.stderr
    assert "odd-\\udcff" in collect_parts(state, list)["state.txt"]


def test_who_has_packed_a_bundle_is_told_how_to_see_what_is_in_it_not_what_would_go_in_now(tmp_path: Path) -> None:
    state, target = with_events(tmp_path / "state", "A310 master lost"), tmp_path / "b.tar.gz"
    done = gateway("report", target, "--state", state, "--rig", "demo")
    assert f"`tar -xzOf {target}` prints what is in it" in done.stdout


def test_the_newest_events_go_in_and_what_each_part_is_named_by(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a log of months the oldest ones tell nothing of what is wrong today."""
    monkeypatch.setattr("gateway.cli.support_bundle.EVENT_LINES", 2)
    monkeypatch.setattr("gateway.cli.control_socket.ask", lambda state, request: {"asked": request["do"]})
    parts = collect_parts(with_events(tmp_path / "state", "first", "second", "third"), lambda: ())
    assert [json.loads(line)["text"] for line in parts["events.jsonl"].splitlines()] == ["second", "third"]
    asked = {name: json.loads(parts[name])["asked"] for name in ("live.json", "health.json")}
    assert asked == {"live.json": "state", "health.json": "health"}


def test_a_clock_that_is_far_ahead_keeps_nobody_from_a_bundle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To 2126: gzip has room for a time until 2106."""
    monkeypatch.setattr("time.time", lambda: 4.95e9)
    pack_bundle({"events": "all is well"}, tmp_path / "b.tar.gz")
    with tarfile.open(tmp_path / "b.tar.gz") as archive:
        assert archive.getnames() == ["force-gateway-report/events"]
