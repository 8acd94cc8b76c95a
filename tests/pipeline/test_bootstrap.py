"""The set-up's look for system libraries: what is missing is named, installed where allowed, or a command printed."""

import subprocess
from typing import Any

import pytest

from pipeline import bootstrap
from pipeline.errors import StageError


def test_this_machine_has_everything() -> None:
    assert bootstrap.missing_packages() == []
    assert bootstrap.main() == 0


def test_one_of_two_libraries_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bootstrap, "_loads", lambda name: name != "libEGL.so.1")
    assert bootstrap.missing_packages() == []
    monkeypatch.setattr(bootstrap, "_loads", lambda name: "EGL" not in name and "Mesa" not in name)
    assert bootstrap.missing_packages() == ["libegl1"]


def test_a_user_without_rights_gets_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap, "_loads", lambda name: name != "libGLU.so.1")
    monkeypatch.setattr(bootstrap, "_is_root", lambda: False)
    monkeypatch.setattr(bootstrap, "_sudo_without_password", lambda: False)
    assert bootstrap.main() == 1
    assert capsys.readouterr().err.splitlines() == [
        "missing system packages: libglu1-mesa",
        "install them with: sudo apt-get update && sudo apt-get install -y --no-install-recommends libglu1-mesa",
    ]


def test_root_installs(monkeypatch: pytest.MonkeyPatch) -> None:
    installed: list[list[str]] = []

    def run(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        installed.append(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(bootstrap, "_loads", lambda name: name != "libGLU.so.1" or len(installed) == 2)
    monkeypatch.setattr(bootstrap, "_is_root", lambda: True)
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(bootstrap.subprocess, "run", run)
    assert bootstrap.main() == 0
    assert [command[2] for command in installed] == ["update", "install"]
    assert installed[1][-1] == "libglu1-mesa"


def test_a_run_without_a_system_library_names_the_command() -> None:
    missing = OSError("libGLU.so.1: cannot open shared object file: No such file or directory")
    assert "libGLU.so.1" in str(StageError("mesh", missing))
    assert "; python -m pipeline.bootstrap installs" in str(StageError("mesh", missing))
    assert "bootstrap" not in str(StageError("mesh", OSError("disk full")))
