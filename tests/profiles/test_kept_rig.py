"""A rig that is read again while the gateway runs: as it was, or not at all."""

from pathlib import Path

import pytest

from gateway.profiles import shipped_profiles_folder
from gateway.profiles.kept_rig import ChangedRigError, unchanged_rig

DEMO = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "cell.yaml"
    path.write_text(DEMO, encoding="utf-8")
    return path


def test_a_rig_whose_files_are_as_they_were_is_read(file: Path) -> None:
    first = unchanged_rig(str(file), None, simulated=True)
    assert unchanged_rig(str(file), first.fingerprint, simulated=True) == first


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DEMO.replace("lease_s: null", "lease_s: 0.5"), "have changed"),
        (DEMO + "# a comment\n", "have changed"),
        ("name: [", "have faults now"),
        ("", "have faults now"),
        (None, "have faults now"),
    ],
)
def test_a_rig_whose_files_have_changed_is_another_one(file: Path, text: str | None, words: str) -> None:
    """The page that was started again went by the lease of the edited file: each enable of its ended as a lost master."""
    fingerprint = unchanged_rig(str(file), None, simulated=True).fingerprint
    if text is None:
        file.unlink()
    else:
        file.write_text(text, encoding="utf-8")
    with pytest.raises(ChangedRigError, match=f"W247 .* {words}"):
        unchanged_rig(str(file), fingerprint, simulated=True)
