"""Arguments and options that several commands have."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Any], Any]
PATH = click.Path(path_type=Path)
_SENTENCE = 1000  # characters: longer than any


def complain(*sentences: str) -> None:
    """Print each of the sentences once, where errors go."""
    for sentence in dict.fromkeys(sentences):
        print(f"archord: {sentence}.", file=sys.stderr, flush=True)


def warn(*messages: str) -> None:
    """Print each of the warnings once."""
    complain(*(f"warning: {message}" for message in messages))


class Group(click.Group):
    """Commands; of a name that is none of them the message says which may be meant."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Each command with the whole first sentence of its help, wrapped."""
        found = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [
            (name, command.get_short_help_str(_SENTENCE))
            for name, command in found
            if command is not None
        ]
        if rows:
            with formatter.section("Commands"):
                formatter.write_dl(rows)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """The command of ``args``. Raises `click.UsageError`."""
        if self.get_command(ctx, args[0]) is None and args[0][:1] != "-":
            near = difflib.get_close_matches(args[0], self.list_commands(ctx), 1)
            ctx.fail(
                " ".join(
                    [f"No such command {args[0]!r}.", *(f"Did you mean {name}?" for name in near)]
                )
            )
        return super().resolve_command(ctx, args)


class _Argument(click.Argument):
    """An argument that help pages explain; click's own have no help."""

    def __init__(self, names: Sequence[str], help: str, **settings: Any) -> None:
        super().__init__(names, **settings)
        self.help = help

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        return self.metavar or "", self.help


def argument(name: str, metavar: str, help: str, **settings: Any) -> Decorator:
    """A path, or several with ``nargs=-1``, or of another ``type``."""
    return click.argument(
        name, metavar=metavar, help=help, cls=_Argument, **{"type": PATH, **settings}
    )


def flag(name: str, help: str) -> Decorator:
    """An option without a value."""
    return click.option(name, is_flag=True, help=help)


def file(
    name: str, help: str, metavar: str | None = "FILE", parameter: str | None = None
) -> Decorator:
    """An option that takes a path; ``parameter`` is its name in the function."""
    return click.option(*filter(None, (name, parameter)), type=PATH, metavar=metavar, help=help)


def output(help: str, default: str | None = None, metavar: str | None = None) -> Decorator:
    """The option ``-o``; ``help`` tells a default that depends on other arguments."""
    return click.option("-o", "--output", type=PATH, default=default, metavar=metavar, help=help)


def quiet(but: str = "errors") -> Decorator:
    """The option ``-q``."""
    return click.option("-q", "--quiet", is_flag=True, help=f"print nothing but {but}")


def overrides(of: str = "scene") -> Decorator:
    """The option ``--set``."""
    help = f"override a key of the {of}, or drop it: =none; may be repeated"
    return click.option("--set", "overrides", metavar="SECTION.KEY=VALUE", multiple=True, help=help)


def pictures(what: str) -> Decorator:
    """The option ``--no-pictures``."""
    return click.option("--pictures/--no-pictures", default=True, help=f"draw {what}, too")


SCENE = argument("scene", "SCENE", "scene file (TOML)")
