"""A word where a verb or a subcommand belongs, and there is none of this name: the answer says which there are."""

import click
import pytest
from click.testing import CliRunner

from gateway.cli.main import VERBS, command, import_verb

GROUPS = [verb for verb in VERBS if isinstance(import_verb(verb).command, click.Group)]


def refused(*words: str) -> str:
    done = CliRunner().invoke(command, [*words])
    assert done.exit_code == 2, done.output
    return done.stderr.splitlines()[-1]


@pytest.mark.parametrize("verb", GROUPS)
def test_an_unknown_subcommand_is_told_all_that_there_are_or_the_nearest(verb: str) -> None:
    """click named the nearest one, and where none was near it said nothing."""
    known = sorted(import_verb(verb).command.commands)
    assert refused(verb, "foo") == f"Error: foo is not a subcommand; there are {', '.join(known)}"
    slip = known[-1][1:]
    assert refused(verb, slip) == f"Error: {slip} is not a subcommand; did you mean {known[-1]}?"


def test_an_unknown_verb_is_told_the_same() -> None:
    assert refused("foo") == f"Error: foo is not a verb; there are {', '.join(VERBS)}"
    assert refused("calibrat") == "Error: calibrat is not a verb; did you mean calibrate?"
    assert "No such option" in refused("calibration", "--foo")


def test_another_name_of_a_subcommand_stays_known() -> None:
    assert "Missing argument" in refused("install-service")
