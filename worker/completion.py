"""`completion`: a script that completes commands and options in bash, zsh or fish."""

import argparse

from .__main__ import COMMANDS, command_parser

_BASH = """\
_slipstick() {{
    local current="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD-1]}}" words=""
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W "{commands} --help --version" -- "$current"))
        return
    fi
    if [ "${{current:0:1}}" = "-" ]; then
        case "${{COMP_WORDS[1]}}" in
{options}
        esac
    else
        case "${{COMP_WORDS[1]}} $previous" in
{choices}
        esac
    fi
    if [ -n "$words" ]; then
        COMPREPLY=($(compgen -W "$words" -- "$current"))
    else
        local IFS=$'\n'  # names may contain spaces
        COMPREPLY=($(compgen -f -- "$current"))
    fi
}}
complete -o filenames -F _slipstick slipstick
"""
_SHELLS = ("bash", "zsh", "fish")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("shell", choices=_SHELLS, help="the shell; for bash: source <(slipstick completion bash)")


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    print({"bash": bash, "zsh": zsh, "fish": fish}[arguments.shell](), end="")
    return 0


def bash() -> str:
    """The script for bash: commands, options, and the values of options that have a choice; otherwise files."""
    actions = {name: command_parser(name)._actions for name in COMMANDS}
    options = "\n".join(f'            {name}) words="{" ".join(_options(given))}" ;;'
                        for name, given in actions.items())
    choices = "\n".join(f'            "{name} {option}") words="{" ".join(map(str, action.choices))}" ;;'
                        for name, given in actions.items() for action in given if action.choices
                        for option in action.option_strings or (name,))
    return _BASH.format(commands=" ".join(COMMANDS), options=options, choices=choices)


def zsh() -> str:
    """The script for zsh, which reads that for bash."""
    return f"autoload -U +X bashcompinit && bashcompinit\n{bash()}"


def fish() -> str:
    """The script for fish, with descriptions."""
    lines = [f"complete -c slipstick -n __fish_use_subcommand -f -a {name} -d {_quoted(text)}"
             for name, text in COMMANDS.items()]
    for name in COMMANDS:
        for action in command_parser(name)._actions:
            long = [option.removeprefix("--") for option in action.option_strings if option.startswith("--")]
            values = f" -x -a {_quoted(' '.join(map(str, action.choices)))}" if action.choices else ""
            lines += [f"complete -c slipstick -n '__fish_seen_subcommand_from {name}' -l {option}{values}"
                      for option in long]
    return "\n".join(lines) + "\n"


def _options(actions: list[argparse.Action]) -> list[str]:
    """The options of a command, and those of its actions, as `bench` has them."""
    nested = [action for given in actions if isinstance(given, argparse._SubParsersAction)
              for parser in given.choices.values() for action in parser._actions]
    options = [option for action in (*actions, *nested) for option in action.option_strings if option.startswith("--")]
    return list(dict.fromkeys(options))


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "\\'") + "'"
