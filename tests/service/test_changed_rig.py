"""What a control process that is started again says of rig files that are others by now."""

from pathlib import Path

import pytest

from gateway.profiles import load_rig
from gateway.profiles.find import shipped_profiles_folder
from gateway.service.control_process import describe_change

DEMO = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text().replace("name: demo", "name: cell")
GOES_ON = "it goes on as it was started"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DEMO, ""),
        (DEMO.replace("force_max_n: 60", "force_max_n: 50"), f"have changed: {GOES_ON}, a new start takes them"),
        ("name: [", f"): {GOES_ON}, a new start would be refused"),
    ],
)
def test_what_a_new_start_would_do_is_said(tmp_path: Path, text: str, words: str) -> None:
    """One with faults is taken by none."""
    file = tmp_path / "cell.yaml"
    file.write_text(DEMO)
    rig = load_rig(str(file), simulated=True)
    file.write_text(text)
    options = {"rig": str(file), "simulate": True, "restarted": {}}
    told = describe_change(rig, options)
    assert told.endswith(words) and told.startswith("W247 the files of rig cell " if words else "")
    assert bool(told) is bool(words)
    assert describe_change(rig, options | {"restarted": None}) == ""
