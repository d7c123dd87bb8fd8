"""The wheel as people install it, by pip, pipx and uv, without an extra: a force is held, the page is served, and what
belongs to an extra says which. Minutes, and the package index has to answer."""

import json
import os
import shutil
import signal
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen

import pytest

ROOT = Path(__file__).parents[2]
INSTALLERS = ("pip", "pipx", "uv")
MOST_MB = 330
"""With pip and its own files; 307 MB when it was written, 143 of them scipy."""

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(folder),
        str(ROOT),
    ]
    subprocess.run(command, check=True)
    (made,) = folder.glob("force_gateway-*.whl")
    return made


@pytest.fixture(params=INSTALLERS)
def installed(request: pytest.FixtureRequest, wheel: Path, tmp_path: Path) -> Path:
    """The command, in an environment that the installer has made."""
    home, found = tmp_path / "home", shutil.which(request.param)
    if found is None:
        pytest.skip(f"no {request.param} here: THE WHEEL IS NOT TRIED BY IT")
    if request.param == "pip":
        venv.create(home, with_pip=True)
        command, folder = [str(home / "bin" / "python"), "-m", "pip", "install", "-q", str(wheel)], home / "bin"
    elif request.param == "pipx":
        command, folder = [found, "install", "--quiet", str(wheel)], home / "bin"
    else:
        command, folder = [found, "tool", "install", "--quiet", str(wheel)], home / "bin"
    places = {
        "PIPX_HOME": home,
        "PIPX_BIN_DIR": home / "bin",
        "UV_TOOL_DIR": home / "tools",
        "UV_TOOL_BIN_DIR": home / "bin",
    }
    subprocess.run(command, check=True, env=os.environ | {name: str(place) for name, place in places.items()})
    return folder / "force-gateway"


@pytest.fixture
def gateway(installed: Path, tmp_path: Path) -> Iterator[tuple[Path, dict[str, object], Path]]:
    """(command, ready line, state directory) of a gateway that runs."""
    state = tmp_path / "state"
    words = ["run", "demo", "--sim", "--json", "--bind", "127.0.0.1:0", "--web", "127.0.0.1:0", "--state", str(state)]
    with subprocess.Popen([installed, *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as running:
        assert running.stdout is not None
        try:
            yield installed, json.loads(running.stdout.readline()), state
        finally:
            running.send_signal(signal.SIGINT)
            assert running.wait(20) == 0


def run(command: Path, *words: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([command, *words], capture_output=True, text=True, check=False, cwd=folder)


def test_what_is_installed_holds_a_force_serves_the_page_and_names_the_extra_that_lacks(
    gateway: tuple[Path, dict[str, object], Path], tmp_path: Path
) -> None:
    command, ready, state = gateway
    (host, port), modbus = ready["web"], "{}:{}".format(*ready["modbus"])  # type: ignore[misc]
    for file in ("", "static/style.css", "static/uplot/uPlot.iife.min.js", "static/tabs/calibrate.js"):
        with urlopen(f"http://{host}:{port}/{file}") as answer:
            assert answer.status == 200 and answer.read()
    assert run(command, "check", "demo", folder=tmp_path).returncode == 0
    assert run(command, "record", "on", "--state", str(state), folder=tmp_path).returncode == 0
    held = run(command, "hold", "12", "--for", "2s", "--json", "--gateway", modbus, folder=tmp_path)
    assert held.returncode == 0, held.stderr
    forces = [json.loads(line)["force_n"] for line in held.stdout.splitlines() if "force_n" in line]
    assert any(abs(force_n - 12.0) < 1.0 for force_n in forces), held.stdout[-500:]
    assert run(command, "record", "off", "--state", str(state), folder=tmp_path).returncode == 0
    refused = run(command, "diagnose", "1", "--state", str(state), folder=tmp_path)
    assert refused.returncode != 0 and "pip install 'force-gateway[analysis]'" in refused.stderr


def test_the_environment_without_extras_is_small(wheel: Path, tmp_path: Path) -> None:
    venv.create(tmp_path / "lean", with_pip=True)
    subprocess.run([str(tmp_path / "lean/bin/python"), "-m", "pip", "install", "-q", str(wheel)], check=True)
    size_mb = sum(file.stat().st_size for file in (tmp_path / "lean").rglob("*") if file.is_file()) / 1e6
    print(f"{size_mb:.0f} MB")
    assert size_mb < MOST_MB
