"""Start-up: light, the same by every door, and one clear message when something is wrong."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from gateway.cli import main
from gateway.service.supervisor.guardian import RunOptions

NOBODY_THERE = 69
HEAVY = ("scipy", "matplotlib", "pandas", "pyarrow", "pymodbus", "rich", "uvloop")


def loaded_modules(*words: str, exit_code: int = 0) -> set[str]:
    """What a call of the command line that ends with this code leaves in sys.modules, in a process of its own."""
    code = (
        "import sys, json\n"
        f"sys.argv = ['force-gateway', *{list(words)!r}]\n"
        "from gateway.cli.main import main\n"
        "try:\n    main()\nfinally:\n"
        "    print('\\n' + json.dumps([name.split('.')[0] for name in sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == exit_code, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("words", [("--help",), ("--version",), ("run", "--help"), ("explain", "E110")])
def test_help_and_version_import_nothing_heavy(words: tuple[str, ...]) -> None:
    assert loaded_modules(*words).isdisjoint({*HEAVY, "numpy", "yaml", "pydantic"})


def test_check_never_imports_scipy() -> None:
    assert loaded_modules("check", "demo").isdisjoint(HEAVY)  # of a whole check: it ends with 0


def test_who_needs_the_register_map_alone_waits_for_no_mathematics() -> None:
    """A third of a second for each `read`, and for each Tab behind it."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    assert "numpy" not in loaded_modules("registers")
    read = ("read", "force_measured", "--gateway", f"127.0.0.1:{port}")
    assert "numpy" not in loaded_modules(*read, exit_code=NOBODY_THERE)
    assert "numpy" in loaded_modules("registers", "--format", "csv", "--rig", "demo")


def test_the_guardian_is_reached_without_numpy() -> None:
    assert loaded_modules("run", "--help", "--json").isdisjoint({"numpy", "yaml", "pydantic"})
    imported = "sys, gateway.cli.verbs.operation.run, gateway.service.supervisor.guardian"
    code = f"import {imported}; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("diagnose", "1", "--json"), "--json OUT: - is stdout."),
        (("calibration", "export", "1", "--yaml"), "--yaml PATH: YAML; - is stdout."),
        (("diagnose", "1", "--closed-loop=3"), ""),
    ],
)
def test_an_option_without_its_argument_says_what_belongs_there(words: tuple[str, ...], said: str) -> None:
    done = CliRunner().invoke(main.command, words)
    assert done.exit_code == 2
    assert done.stderr.rstrip().endswith(said or "does not take a value.")


def test_module_and_command_are_the_same() -> None:
    by_module = subprocess.run(
        [sys.executable, "-m", "gateway", "--version"], capture_output=True, text=True, check=True
    )
    by_command = subprocess.run(
        [Path(sys.executable).with_name("force-gateway"), "--version"], capture_output=True, text=True, check=True
    )
    assert by_module.stdout == by_command.stdout == "force-gateway 0.1.0\n"


@pytest.mark.parametrize("verb", main.VERBS)
def test_every_verb_has_help_that_fits_its_list_line(verb: str, call) -> None:
    answer = call(verb, "--help")
    assert answer.exit_code == 0, answer.output
    (line,) = (line for line in call("--help").output.splitlines() if line.split()[:1] == [verb])
    assert not line.endswith("..."), "the first sentence of its docstring is too long"


def test_options_of_run_are_the_fields_of_run_options() -> None:
    context = click.Context(main.command)
    run = main.command.get_command(context, "run")
    assert run is not None
    assert {parameter.name for parameter in run.params} == set(RunOptions.__dataclass_fields__)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("127.0.0.1:502", ("127.0.0.1", 502)),
        (":0", ("127.0.0.1", 0)),
        ("192.168.125.20", ("192.168.125.20", 5020)),
        ("[::1]:5020", ("::1", 5020)),
        ("::1", ("::1", 5020)),
    ],
)
def test_an_endpoint_is_read_as_people_write_it(text: str, expected: tuple[str, int], call, monkeypatch) -> None:
    values: list[RunOptions] = []
    monkeypatch.setattr("gateway.service.supervisor.guardian.run", lambda options: values.append(options) or 0)
    assert call("run", "--bind", text).exit_code == 0
    assert values[0].bind == expected


@pytest.mark.parametrize(
    "text", ["127.0.0.1:http", "host:70000", "1.2.3.4:-1", "http://127.0.0.1:5020", "tcp://127.0.0.1", "10.0.0.0/8:502"]
)
@pytest.mark.parametrize("command", [("run", "--bind"), ("read", "state", "--gateway")], ids=lambda words: words[0])
def test_a_wrong_endpoint_is_a_usage_error(text: str, command: tuple[str, ...], call) -> None:
    answer = call(*command, text)
    assert answer.exit_code == 2
    assert f"{text} is not HOST:PORT" in answer.stderr


def test_run_hands_over_everything_and_ends_with_the_guardians_code(call, monkeypatch, tmp_path: Path) -> None:
    values: list[RunOptions] = []
    monkeypatch.setattr("gateway.service.supervisor.guardian.run", lambda options: values.append(options) or 69)
    answer = call("run", "my.yaml", "--sim", "--state", tmp_path, "--json", "--record", "--realtime")
    assert answer.exit_code == 69
    expected = RunOptions(rig="my.yaml", simulate=True, state=tmp_path, json=True, record=True, realtime=True)
    assert values == [expected]


def test_a_mistyped_verb_gets_a_proposal(call) -> None:
    answer = call("moniter")
    assert answer.exit_code == 2
    assert "did you mean monitor?" in answer.stderr


def test_a_defect_says_so_without_a_traceback(call, monkeypatch) -> None:
    monkeypatch.setattr("gateway.service.supervisor.guardian.run", lambda options: {}["missing"])
    answer = call("run")
    assert answer.exit_code == 1
    assert answer.stderr.startswith("E500 internal error: KeyError")
    assert "Traceback" not in answer.stderr
    assert "Traceback" in call("--debug", "run").stderr


@pytest.mark.parametrize(
    ("error", "code", "exit_code"),
    [
        (PermissionError(13, "Permission denied", "/x"), "E105", 77),
        (OSError(28, "No space left on device", "/x"), "E106", 1),
    ],
)
def test_what_the_system_refuses_is_told_in_one_line(
    error: OSError, code: str, exit_code: int, call, monkeypatch
) -> None:
    def fail(options: RunOptions) -> int:
        raise error

    monkeypatch.setattr("gateway.service.supervisor.guardian.run", fail)
    answer = call("run")
    assert answer.exit_code == exit_code
    assert answer.stderr.startswith(f"{code} /x: {error.strerror}")
    assert answer.stderr.count("\n") == 1


@pytest.mark.parametrize(("shell", "word"), [("bash", "complete"), ("zsh", "compdef"), ("fish", "complete")])
def test_completion_prints_a_script_for_the_shell(shell: str, word: str, call) -> None:
    answer = call("completion", shell)
    assert answer.exit_code == 0
    assert word in answer.output
    assert "_FORCE_GATEWAY_COMPLETE" in answer.output


def test_completion_offers_the_verbs(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "gateway"],
        env={"_FORCE_GATEWAY_COMPLETE": "bash_complete", "COMP_LINE": "force-gateway re"},
        capture_output=True,
        text=True,
        check=False,
    )
    offered = {line.split(",")[1] for line in done.stdout.splitlines()}
    assert offered == {"read", "registers", "record", "recordings", "replay", "report", "restore"}


def test_version_names_what_a_report_needs(call) -> None:
    facts = json.loads(call("version", "--json").output)
    assert set(facts) == {"force-gateway", "python", "system", "executable"}


@pytest.mark.parametrize("verb", main.VERBS)
def test_help_names_no_bound_where_there_is_none(verb: str, call) -> None:
    """`recordings prune --bytes SIZE` ended with [x<=None]."""
    subcommands = getattr(main.import_verb(verb).command, "commands", {})
    shown = [call(verb, "--help").output, *(call(verb, one, "--help").output for one in subcommands)]
    assert not any("None]" in text for text in shown)


def test_an_alias_is_the_subcommand_and_no_verb_of_the_help(call) -> None:
    alias, meant = call("install-service", "--help"), call("service", "install", "--help")
    assert alias.exit_code == 0
    assert alias.output.split("[OPTIONS]")[1] == meant.output.split("[OPTIONS]")[1]
    assert "install-service" not in call("--help").output


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("--bind", "nonsense", "nonsense is no IP address of this machine such as 127.0.0.1"),
        ("--bind", "5020", "it is HOST:PORT, PORT alone is :PORT"),
        ("--web", "cell.local:8080", "cell.local is no IP address"),
        ("--metrics", "cell.local:9100", "cell.local is no IP address"),
    ],
)
def test_an_address_to_listen_on_that_is_none_is_told_before_anything_starts(
    option: str, value: str, told: str, call
) -> None:
    """As `--web` it ended control with a traceback, five times; as `--bind` it was called reachable from the network."""
    answer = call("run", "demo", "--sim", option, value)
    assert answer.exit_code == 2
    assert told in " ".join(answer.output.split())
