"""Click classes that import the module of a command only when it is needed.

The command ``rsfstudy NAME`` imports only the module of the command ``NAME``. The command
``rsfstudy --help`` imports the modules of all commands. However, large libraries are not imported
by ``--help``, because they are imported inside the functions of the commands.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator, MutableMapping
from typing import Any

import click

from rsfstudy.cli.commands import MODULE_BY_COMMAND
from rsfstudy.cli.options import CommandOptions
from rsfstudy.errors import Interrupted


class LazyCommandMapping(MutableMapping[str, click.Command]):
    """Mapping from command names to commands.

    The module of a command is imported when the command is looked up.
    """

    def __init__(self) -> None:
        """Create the mapping without importing the modules of the commands."""
        self._loaded: dict[str, click.Command] = {}
        self._module_by_name = dict(MODULE_BY_COMMAND)

    def __getitem__(self, name: str) -> click.Command:
        """Import the module of a command, and return the command."""
        if name not in self._loaded:
            module_name = self._module_by_name[name]
            module = importlib.import_module(f"rsfstudy.cli.commands.{module_name}")
            self._loaded[name] = getattr(module, module_name)
        return self._loaded[name]

    def __setitem__(self, name: str, command: click.Command) -> None:
        """Add a command whose module has already been imported."""
        self._module_by_name.setdefault(name, "")
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        """Remove a command."""
        del self._module_by_name[name]
        self._loaded.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names in the order of the help text."""
        return iter(self._module_by_name)

    def __len__(self) -> int:
        """Return the number of commands."""
        return len(self._module_by_name)


class CommandGroup(click.Group):
    """Command group that lists its commands in the order of ``MODULE_BY_COMMAND``."""

    def __init__(self, **settings: Any) -> None:
        """Create the group with all commands of rsfstudy."""
        super().__init__(**settings | {"commands": LazyCommandMapping()})

    def list_commands(self, _context: click.Context) -> list[str]:
        """Return the names of the commands.

        Parameters
        ----------
        _context : click.Context
            Context of the command line, which is not used.

        Returns
        -------
        list of str
            Names in the order of the help text.
        """
        return list(self.commands)

    def invoke(self, context: click.Context) -> Any:
        """Call a command, and raise ``Interrupted`` after Ctrl-C or a signal.

        Without this method, Click would handle the interruption and would print an empty line
        before the message.

        Parameters
        ----------
        context : click.Context
            Context of the command line.

        Returns
        -------
        object
            Return value of the command.

        Raises
        ------
        Interrupted
            If the user or a signal interrupts the command.
        """
        try:
            return super().invoke(context)
        except KeyboardInterrupt as error:
            raise Interrupted(str(error) or "interrupted") from error


class CommandWithOptionsObject(click.Command):
    """Command that passes its arguments and options to a function as one object."""

    def invoke(self, context: click.Context) -> int:
        """Call the function of the command.

        Parameters
        ----------
        context : click.Context
            Context with the values of arguments and options.

        Returns
        -------
        int
            Exit status.
        """
        assert self.callback is not None
        status: int = self.callback(CommandOptions(**context.params))
        return status
