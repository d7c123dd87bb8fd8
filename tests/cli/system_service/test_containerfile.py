"""The Containerfile, as far as it can be asked without a builder: what it copies is there, what it runs is a verb."""

import json
import re
from pathlib import Path

from gateway.cli.main import command
from gateway.cli.system_service.unit_file import UnitOptions, unit_text

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "tools/container/Containerfile").read_text(encoding="utf-8")


def test_everything_that_is_copied_is_in_the_checkout_and_nothing_else_is() -> None:
    copied = [word for line in re.findall(r"^COPY (?!--)(.+)$", TEXT, re.M) for word in line.split()[:-1]]
    assert set(copied) >= {"pyproject.toml", "requirements.lock", "gateway", "profiles"}
    assert [name for name in copied if not (ROOT / name).exists()] == []


def test_what_the_image_runs_is_a_verb_with_its_options() -> None:
    words = json.loads(re.findall(r"^CMD (.+)$", TEXT, re.M)[0])
    verb = command.get_command(None, words[0])  # type: ignore[arg-type]
    assert verb is not None
    assert verb.make_context(words[0], words[1:]).params["simulate"] is True


def test_a_container_is_tried_again_as_the_unit_without_one_is() -> None:
    """`on-failure:5` left a cell off for good whose device was there after the fifth try."""
    unit = unit_text(
        UnitOptions(stem="cell", rig="/etc/force-gateway/cell.yaml", command=Path("/usr/bin/force-gateway"))
    )
    told = re.findall(r"^#   (\w+=.*)$", TEXT, re.M)
    assert set(re.findall(r"^(?:Restart|StartLimit|TimeoutStop|WantedBy)\w*=.*$", unit, re.M)) <= set(told)
    assert " --restart" not in "".join(re.findall(r"^#   podman run.*$", TEXT, re.M))


def test_the_image_has_no_shell_for_its_command_and_no_root() -> None:
    assert json.loads(re.findall(r"^ENTRYPOINT (.+)$", TEXT, re.M)[0]) == ["force-gateway"]
    assert TEXT.index("\nUSER ") < TEXT.index("\nENTRYPOINT ")
