"""What a person is asked before a run: with the run's own numbers, and of the air only where the run looks for it."""

from gateway.control.runs.preconditions import preconditions


def test_the_questions_name_the_largest_force_and_the_highest_voltage() -> None:
    force, people, air = preconditions(46.7, 6.25, has_check=True)
    assert "takes 47 N?" in force and "hands and people away" in people and "enough for 6.25 V?" in air
    assert preconditions(46.7, 6.25, has_check=False) == (force, people)


def test_of_a_rig_elsewhere_no_number_is_made_up() -> None:
    """60 N were asked for, whatever the rig there may press: a stop that takes so much was not enough for 120 N."""
    force, _, air = preconditions(None, None, has_check=True)
    assert "takes the largest force that its rig file allows" in force and "enough for the highest voltage" in air
    assert not any(sign.isdigit() for sign in force + air)
