"""Modules of the commands of ``rsfstudy``. Each module defines one command.

To add a command, write one module and add one line to ``MODULE_BY_COMMAND``. The module contains a
function with the name of the module:

- The decorators of the function declare the arguments and options. The class
  ``CommandWithOptionsObject`` of ``rsfstudy.cli.command_group`` passes all arguments and options to
  the function as one object.
- The docstring of the function is the help text.
- The function creates a result object, prints the result and returns the exit status. If the
  command has the option ``--json``, the result is a subclass of ``CommandResult``, and
  ``print_result_as_text_or_json`` prints the result as text or as JSON.
- Large libraries are imported inside the functions that use them, because ``rsfstudy --help``
  imports all modules of this package. A command never imports the module of another command.
"""

from __future__ import annotations

#: Module of each command, by the name of the command. The help text lists the commands in this
#: order.
MODULE_BY_COMMAND = {
    "list": "list_studies",
    "show": "show",
    "run": "run",
    "check": "check",
    "plot": "plot",
    "report": "report",
    "compare": "compare",
    "rerun": "rerun",
    "export": "export",
    "simulate": "simulate",
    "fit": "fit",
    "events": "events",
    "healing": "healing",
    "explore": "explore",
    "problems": "write_referee_problems",
    "verify": "verify",
}
