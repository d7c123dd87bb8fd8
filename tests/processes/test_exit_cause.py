"""Why a control process ended: in words, with the code that `explain` expands, and the same behind a message."""

import pytest

from gateway.codes.all_codes import CATALOGUE
from gateway.processes.exit_cause import EndCause, Ending

CODES = {
    EndCause.DIED: "",
    EndCause.DEFECT: "A499",
    EndCause.NONSENSE: "A499",
    EndCause.NOT_STARTED: "A406",
    EndCause.MACHINE_BUSY: "A403",
    EndCause.STALLED: "A404",
    EndCause.STOPPED: "A405",
}


@pytest.mark.parametrize("cause", EndCause)
def test_each_cause_is_told_with_the_code_that_explains_it(cause: EndCause) -> None:
    """Of a death by a signal A401 is said beside it."""
    code = CODES[cause]
    assert Ending(cause, "it ended").sentence == (f"it ended ({code})" if code else "it ended")
    assert not code or code in CATALOGUE


@pytest.mark.parametrize("cause", EndCause)
def test_an_end_is_the_same_behind_a_message(cause: EndCause) -> None:
    ending = Ending(cause, "it ended")
    assert Ending.from_json(ending.to_json()) == ending and Ending.from_json(None) is None
