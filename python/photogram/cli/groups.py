"""A command with side commands: `photogram giant DIR` beside `photogram giant check DIR`."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup


class GroupWithMain(TyperGroup):
    """A group whose first command is run when the first word names none.

    The job that people come for needs no name; a directory with the name of a side command is `./check`.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the commands in the order in which they were added."""
        return list(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command; the help of the main one, which is that of the group, names the others."""
        command = super().get_command(ctx, cmd_name)
        if command is not None and cmd_name == self._main:
            others = [self.commands[name] for name in self.list_commands(ctx) if name != self._main]
            lines = [
                f"{ctx.command_path} {each.name}: {each.get_short_help_str(limit=200)}" for each in others
            ]
            command.epilog = "\n\n".join(["Other commands:", *lines])
        return command

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the main command before arguments that name no command.

        While a shell completes the first word, either may follow: see :meth:`shell_complete`.
        """
        if (args or not ctx.resilient_parsing) and (not args or args[0] not in self.commands):
            args = [self._main, *args]
        return list(super().parse_args(ctx, args))

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """Return the side commands, and what the main command begins with."""
        main = self.commands[self._main]
        with main.make_context(self._main, [], parent=ctx, resilient_parsing=True) as own:
            return [*super().shell_complete(ctx, incomplete), *main.shell_complete(own, incomplete)]

    @property
    def _main(self) -> str:
        return next(iter(self.commands))
