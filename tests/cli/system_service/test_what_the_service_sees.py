"""What the service's user sees and may read is looked at before it starts: root, who installs it, may read everything."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.cli.errors import CliError
from gateway.cli.system_service import installation, user_access
from gateway.cli.system_service.installation import Installation, plan_installation
from gateway.cli.system_service.user_access import refuse_closed_program, refuse_unreadable
from gateway.processes import exit_codes
from gateway.profiles import Rig, load_rig
from gateway.profiles.rigs.faces import TlsFace


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "home"
    folder.mkdir()
    monkeypatch.setattr(installation, "_HIDDEN", (str(folder),))
    return folder


def planned(rig: Rig, *, name: str = "demo", command: Path | None = Path("/opt/force-gateway")) -> Installation:
    return plan_installation(name, rig, networks=(), command=command)


def test_a_rig_that_is_a_link_to_one_below_home_is_refused(home: Path, tmp_path: Path) -> None:
    """The unit was written, and its service ended at once: it saw no such file."""
    (home / "cell.yaml").write_text("name: cell\n")
    (tmp_path / "cell.yaml").symlink_to(home / "cell.yaml")
    with pytest.raises(CliError, match=r"cell\.yaml leads to .*/home/cell\.yaml: the service sees nothing below"):
        planned(load_rig("demo"), name=str(tmp_path / "cell.yaml"))


def test_a_profile_of_ones_own_below_home_is_refused(home: Path) -> None:
    own = home / "dac.yaml"
    rig = replace(load_rig("demo"), texts={**load_rig("demo").texts, str(own): ""})
    with pytest.raises(CliError, match=r"E107 .*/home/dac\.yaml: the service sees nothing below"):
        planned(rig)


def test_a_python_below_home_is_refused(home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of pyenv, say, or uv: /opt/force-gateway has a link to it alone, and systemd could not start the program."""
    (home / "python3").touch()
    (tmp_path / "python3").symlink_to(home / "python3")
    (tmp_path / "force-gateway").touch()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python3"))
    with pytest.raises(CliError, match=r"python3 leads to .*/home/python3: the service sees nothing below"):
        planned(load_rig("demo"), command=None)


def test_what_the_service_reads_is_in_the_plan_and_nothing_that_comes_with_it(tmp_path: Path) -> None:
    face = TlsFace(type="tls", certificate="/x/a.crt", key="/x/a.key", ca="/x/ca.crt")
    rig = replace(load_rig("demo"), fieldbus=(face,))
    own = {**rig.texts, "/etc/cell.yaml": ""}
    assert planned(rig).reads == ("/x/a.crt", "/x/a.key", "/x/ca.crt")
    assert planned(replace(rig, texts=own)).reads == ("/etc/cell.yaml", "/x/a.crt", "/x/a.key", "/x/ca.crt")


def test_a_key_of_roots_is_told_before_the_service_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`sudo force-gateway certs` makes one: check found no fault as root, the service ended with E171, and systemctl said no
    more than that its job had failed."""
    folder = tmp_path / "my keys"
    folder.mkdir()
    key = folder / "gateway.key"
    key.touch()
    asked: list[str] = []
    monkeypatch.setattr(installation, "run_command", lambda words, **_: asked.append(" ".join(words)) or "")
    may_not = {str(folder), str(key)}
    monkeypatch.setattr(user_access, "_may", lambda path, way: str(path) not in may_not)
    commands = (("systemd-sysusers", "x"), ("systemctl", "enable", "--now", "u"))
    plan = Installation("u", {}, commands, reads=(str(key),))
    with pytest.raises(CliError) as refused:
        installation.install_service(plan, Path("/"))
    both = f"'{folder}' '{key}'"
    assert f"sudo chgrp force-gateway {both} && sudo chmod g+rX {both}" in refused.value.message
    assert refused.value.exit_code == exit_codes.PERMISSION
    assert asked[-1] == "systemd-sysusers x", "the user is there then, and nothing is started"
    may_not.clear()
    assert installation.install_service(plan, Path("/")) == ([], False)
    assert asked[-1] == "systemctl enable --now u"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can ask for another user")
def test_another_user_is_asked_and_not_root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(user_access, "USER", "nobody")
    secret = tmp_path / "key"
    secret.touch(0o600)
    refuse_unreadable(("/etc/passwd",))
    refuse_closed_program(Path("/bin/sh"))
    with pytest.raises(CliError, match=r"E107 .*key: the service's user, nobody, may not read it"):
        refuse_unreadable((str(secret),))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can ask for another user")
def test_a_program_that_the_service_cannot_run_is_told_before_it_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A root of umask 077 made the virtual environment, or --command had a typing error: systemd tried it again for ever."""
    monkeypatch.setattr(user_access, "USER", "nobody")
    monkeypatch.setattr(installation, "run_command", lambda words, **_: "")
    program = tmp_path / "bin" / "force-gateway"
    plan = Installation("u", {}, (("systemctl", "enable", "--now", "u"),), program=program)
    with pytest.raises(CliError, match=r"E107 .*force-gateway: there is no such program") as missing:
        installation.install_service(plan, Path("/"))
    program.parent.mkdir()
    program.touch(0o700)
    with pytest.raises(CliError, match=rf"may not run it: sudo chmod -R go\+rX {tmp_path}, then") as closed:
        installation.install_service(plan, Path("/"))
    assert (missing.value.exit_code, closed.value.exit_code) == (exit_codes.CONFIGURATION, exit_codes.PERMISSION)


def test_the_unit_of_another_rig_of_that_name_is_left_alone(tmp_path: Path) -> None:
    """The second cell.yaml took the first one's unit, and at the next boot its state: the calibration of another machine."""
    program, image = Path("/opt/50% x/force-gateway"), tmp_path / "image"
    plan_of = {
        place: plan_installation(f"/etc/{place}/cell.yaml", load_rig("demo"), networks=(), command=program)
        for place in ("line 1", "line 2")
    }
    first = plan_of["line 1"]
    written, _ = installation.install_service(first, image)
    assert installation.install_service(first, image)[0] == written, "its own may be written anew"
    with pytest.raises(
        CliError, match=r'E107 .*cell\.service is of "/etc/line 1/cell\.yaml": .*another name'
    ) as refused:
        installation.install_service(plan_of["line 2"], image)
    assert refused.value.exit_code == exit_codes.CONFIGURATION and "uninstall cell" in refused.value.message
    assert (image / "etc/systemd/system" / first.unit).read_text() == first.files[f"etc/systemd/system/{first.unit}"]
