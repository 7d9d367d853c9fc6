"""Commands of the command line, with one module per command.

To add a command, write one module and add one line to ``MODULE_BY_COMMAND``. The module contains a
function with the name of the module:

- The decorators declare the arguments and options. The class ``Command`` of
  ``rsfstudy.cli.command_group`` passes them to the function as one object.
- The docstring of the function is the help text.
- The function computes a result, which includes the exit status, and then prints the result. If the
  command has the option ``--json``, the result is a subclass of ``CommandResult``, and
  ``output_result`` prints the result as text or as JSON.
- Functions import large libraries when they are called, because ``rsfstudy --help`` imports all
  modules of this package. A command never imports another command.
"""

from __future__ import annotations

#: Modules of the commands, by the name of the command. The help text lists the commands in this
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
    "problems": "problems",
    "verify": "verify",
}
