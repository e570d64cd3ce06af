"""The completion in a real bash: commands, options, choices and files."""

import subprocess
from pathlib import Path

import pytest

from worker.__main__ import COMMANDS, command_parser, main


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    from worker.completion import bash, fish, zsh

    return {"bash": bash(), "zsh": zsh(), "fish": fish()}


def complete(script: str, folder: Path, *words: str) -> list[str]:
    """What bash offers for the last word of a line."""
    line = " ".join(f"'{word}'" for word in words)
    code = (f"{script}\nCOMP_WORDS=(slipstick {line}); COMP_CWORD={len(words)}; _slipstick\n"
            "printf '%s\\n' \"${COMPREPLY[@]}\"")
    done = subprocess.run(["bash", "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.splitlines()


def test_commands_are_completed(scripts: dict[str, str], tmp_path: Path) -> None:
    assert complete(scripts["bash"], tmp_path, "") == [*COMMANDS, "--help", "--version"]
    assert complete(scripts["bash"], tmp_path, "s") == [name for name in COMMANDS if name.startswith("s")]


@pytest.mark.parametrize("name", COMMANDS)
def test_options_are_those_of_the_command(scripts: dict[str, str], tmp_path: Path, name: str) -> None:
    offered = complete(scripts["bash"], tmp_path, name, "--")
    assert "--help" in offered
    own = {option for action in command_parser(name)._actions for option in action.option_strings
           if option.startswith("--")}
    assert set(offered) - own == ({"--picture"} if name in ("bench", "machine") else set())  # of its action `check`
    assert own <= set(offered)


def test_choices_and_files_are_completed(scripts: dict[str, str], tmp_path: Path) -> None:
    assert complete(scripts["bash"], tmp_path, "build", "--accuracy", "") == ["default", "tight"]
    assert complete(scripts["bash"], tmp_path, "completion", "") == ["bash", "zsh", "fish"]
    (tmp_path / "my runs.h5").touch()
    assert complete(scripts["bash"], tmp_path, "study", "my") == ["my runs.h5"]
    assert complete(scripts["bash"], tmp_path, "bench", "") == ["new", "check"]


def test_the_other_shells_have_the_same_commands(scripts: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert scripts["zsh"].endswith(scripts["bash"])
    for name in COMMANDS:
        assert f"-a {name} " in scripts["fish"]
    assert main(["completion", "fish"]) == 0
    assert capsys.readouterr().out == scripts["fish"]
