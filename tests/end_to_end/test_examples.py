"""Every example at the end of a verb's help runs as it stands, in a prepared directory, beside one running gateway.

What lasts (a whole ladder, a self-test, diagnoses) runs with the bigger budget; in the gate its options are read.
"""

import io
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from gateway.calibrations.store import CalibrationStore
from gateway.cli.control_socket import ask
from gateway.cli.main import VERBS, command, import_verb
from gateway.profiles import load_calibration
from gateway.service.supervisor.guardian import RunOptions
from tests.end_to_end.conftest import RunningGateway, start, stop

LASTING = ("calibrate", "self-test", "diagnose", "simulate", "fleet")


def examples_of(verb: str) -> tuple[str, ...]:
    return getattr(import_verb(verb), "EXAMPLES", ())


EXAMPLES = [(verb, example) for verb in VERBS for example in examples_of(verb)]
SHORT = [example for verb, example in EXAMPLES if verb not in LASTING and verb != "run"]


def write_table(path: Path, command_v: np.ndarray) -> None:
    """A recording at 100 Hz of a machine that is half hysteresis, half spring."""
    force, forces = 0.0, []
    for volts in command_v:
        force = float(np.clip(force, 8.0 * volts - 1.5, 8.0 * volts + 1.5))
        forces.append(force)
    force_n = np.array(forces) + np.random.default_rng(7).normal(0.0, 0.05, command_v.size)
    columns = np.stack([np.arange(command_v.size) * 0.01, command_v, force_n], axis=1)
    text = io.StringIO()
    np.savetxt(text, columns, fmt="%.4f", delimiter=",", header="time_s,command_v,force_n", comments="")
    path.write_text(text.getvalue())


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    """A gateway on the demo rig with a recording and a calibration, and files of every kind in the working directory."""
    root = tmp_path_factory.mktemp("examples")
    state, here = root / "force-gateway" / "demo", root / "here"
    for folder in (here, state.parent):
        folder.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(root))
        patch.chdir(here)
        gateway = start(state, "--sim")
        ask(state, {"do": "record", "on": True})
        CalibrationStore(state, load_calibration("demo")).add(load_calibration("demo"))
        stairs = np.concatenate([np.arange(0.0, 6.01, 0.5), np.arange(5.5, -0.01, -0.5)])
        write_table(here / "ladder.csv", np.append(np.tile(np.repeat(stairs, 50), 2), np.zeros(50)))
        write_table(here / "press.csv", np.repeat(np.random.default_rng(1).uniform(0.5, 6.0, 60), 100))
        fleet = here / "recordings" / "cell=1" / "date=2026-11-23"
        fleet.mkdir(parents=True)
        (fleet / "ladder.csv").write_bytes((here / "ladder.csv").read_bytes())
        assert CliRunner().invoke(command, ["backup", "kept.tar.gz"]).exit_code == 0
        ask(state, {"do": "record", "on": False})
        yield gateway
        stop(gateway)


def leaf_of(words: list[str]) -> click.Command:
    """The command that stands behind the words, a group's or the verb itself."""
    context = click.Context(command)
    found = command.get_command(context, words[0])
    assert found is not None
    return found.commands[words[1]] if isinstance(found, click.Group) else found


def complaint_of(example: str, gateway: RunningGateway) -> str:
    """Run an example and return what is wrong. Instead of the usual port it gets this gateway's, which had to be a free one."""
    words = shlex.split(example)
    if any(parameter.name == "endpoint" for parameter in leaf_of(words).params) and words[0] != "calibrate":
        words += ["--gateway", f"127.0.0.1:{gateway.port}"]
    answer = CliRunner().invoke(command, words)
    return "" if answer.exit_code == 0 else f"force-gateway {example}: {answer.exit_code}\n{answer.output}"


@pytest.mark.parametrize("verb", VERBS)
def test_a_verbs_help_ends_with_two_examples_of_it(verb: str) -> None:
    examples = examples_of(verb)
    assert len(examples) >= 2
    assert all(shlex.split(example)[0] == verb for example in examples)
    text = CliRunner().invoke(command, [verb, "--help"]).output
    assert text.rstrip().endswith("\n".join(f"    force-gateway {example}" for example in examples))


def test_short_examples_run_as_they_stand(prepared: RunningGateway) -> None:
    assert len(SHORT) > 40
    complaints = [complaint for example in SHORT if (complaint := complaint_of(example, prepared))]
    assert not complaints, "\n".join(complaints)


@pytest.mark.parametrize("example", [example for verb, example in EXAMPLES if verb in LASTING])
def test_options_of_lasting_examples_are_read(example: str, prepared: RunningGateway) -> None:
    words = shlex.split(example)
    assert leaf_of(words).make_context(words[0], words[1:]).params


@pytest.mark.parametrize("example", examples_of("run"))
def test_examples_of_run_are_taken(example: str, monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[RunOptions] = []
    monkeypatch.setattr("gateway.service.supervisor.guardian.run", lambda options: taken.append(options) or 0)
    assert CliRunner().invoke(command, shlex.split(example)).exit_code == 0
    assert taken[0].rig == shlex.split(example)[1]


@pytest.mark.long
@pytest.mark.parametrize("example", [example for verb, example in EXAMPLES if verb in LASTING])
def test_lasting_examples_run_as_they_stand(example: str, prepared: RunningGateway) -> None:
    prepared.rest()
    assert complaint_of(example, prepared) == ""
    assert prepared.process.poll() is None
