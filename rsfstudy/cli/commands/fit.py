"""Command ``rsfstudy fit``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import rsfstudy
from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import (
    EXIT_STATUS_FAILED,
    EXIT_STATUS_OK,
    CommandResult,
    print_result_as_text_or_json,
)
from rsfstudy.cli.lab_record_options import (
    collect_record_reading_options,
    make_number_with_units_option,
    record_reading_options,
)
from rsfstudy.cli.options import DecoratedFunction
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue
from rsfstudy.motion import Engine

if TYPE_CHECKING:
    import xarray as xr

    from rsfstudy.fitting import LoadingStep, Record

#: Maximum number of steps that are printed for each record.
_MAX_PRINTED_LOADING_STEPS = 24
#: Names of the options whose values are passed to ``rsfstudy.fit`` unchanged.
_OPTIONS_PASSED_TO_FIT = (
    "stiffness", "slip_distance", "laws", "free", "together", "before", "after", "windows",
    "noise", "loading", "averaging", "low_pass", "posterior", "budget", "engine",
)  # fmt: skip


@dataclass(frozen=True)
class FitCommandResult(CommandResult):
    """Output of the ``fit`` command: records and their fits.

    Parameters
    ----------
    records : sequence of Record
        Records with their detected steps.
    fit_dataset : xarray.Dataset
        Dataset of the fits.
    output_files : sequence of Path
        Paths of the figure and the data file.
    """

    records: Sequence[Record]
    fit_dataset: xr.Dataset
    output_files: Sequence[Path]

    @property
    def exit_status(self) -> int:
        """Exit status. The status is 1 if a fit has no values or if its errors are not valid."""
        from rsfstudy.reporting import are_all_fits_valid

        return EXIT_STATUS_OK if are_all_fits_valid(self.fit_dataset) else EXIT_STATUS_FAILED

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        from rsfstudy.reporting import summarise_fits_as_json_fields

        return {
            "records": [
                {
                    "record": record.name,
                    "rows": len(record),
                    "processing": record.processing,
                    "steps": [
                        _convert_loading_step_to_json(*step)
                        for step in enumerate(record.loading_steps, 1)
                    ],
                }
                for record in self.records
            ],
            "fits": summarise_fits_as_json_fields(self.fit_dataset),
            "files": self.output_files,
        }


def _convert_loading_step_to_json(step_number: int, loading_step: LoadingStep) -> dict[str, Any]:
    """Return the JSON entry of a step. The units are s, um/s and Pa."""
    names = "start", "end", "velocity_before", "velocity_after", "stress_before", "stress_after"
    return {"step": step_number, **{name: getattr(loading_step, name) for name in names}}


def _split_comma_separated_list(
    _context: click.Context, _option: click.Parameter, text: str | None
) -> tuple[str, ...]:
    """Split a comma-separated list."""
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


def _make_comma_separated_list_option(
    *option_names: str, help_text: str, default: str | None = None, metavar: str = "TEXT"
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create an option for a comma-separated list."""
    return click.option(
        *option_names,
        callback=_split_comma_separated_list,
        default=default,
        metavar=metavar,
        help=help_text,
    )


@click.command(cls=CommandWithOptionsObject)
@click.argument("records", nargs=-1, required=True, type=options.PathParameterType())
@record_reading_options
@make_number_with_units_option(
    "--stiffness",
    "Stiffness of the machine, optionally divided by the normal stress. To estimate "
    "the stiffness from the record, pass 'from record'. Examples: '0.03 MPa/um' or '1.6e-3 /um'.",
)
@make_number_with_units_option(
    "--slip-distance", "Initial guess of the slip distance D_c. Example: '10 um'."
)
@_make_comma_separated_list_option(
    "--law",
    "laws",
    metavar="LAW,...",
    default="slip,slowness",
    help_text="State evolution laws, separated by commas. A separate fit is computed for each law.",
)
@_make_comma_separated_list_option(
    "--free",
    metavar="NAME,...",
    help_text="Parameters to fit, separated by commas. In addition to the default parameters, "
    "you can fit stiffness, step_time, trend2, alpha and, for law=family, law_exponent. "
    "Parameters that do not occur in a law are ignored for that law.  [default: a, b, "
    "slip_distance, mu_star and trend1; for laws with two state variables: a, b1, b2, "
    "slip_distance, slip_distance_2, mu_star and trend1]",
)
@_make_comma_separated_list_option(
    "--step",
    "steps",
    metavar="N,...",
    help_text="Numbers of the steps to fit. Example: 1,3.  [default: all steps]",
)
@click.option(
    "--together",
    is_flag=True,
    help="Fit all steps in all RECORDS jointly, with common values of a, b and D_c.",
)
@make_number_with_units_option(
    "--before",
    "Length of the fit window before each step, as a load point displacement. Example: '100 "
    "um'.  [default: half the displacement since the previous step]",
    "0 um",
)
@make_number_with_units_option(
    "--after",
    "Length of the fit window after each step, as a load point displacement. Example: '250 "
    "um'.  [default: displacement until the next step]",
    "0 um",
)
@options.make_positive_integer_option(
    "--windows",
    1,
    "Number of fit windows. Their lengths range from half to all of the data after a step. The "
    "results show how sensitive the parameters are to the length of the window.",
)
@click.option(
    "--noise",
    metavar="MODEL",
    default="ar",
    help="Noise model: white noise (white) or an autoregressive model, whose order is selected "
    "automatically (ar) or fixed (ar1, ar2, ...).",
)
@click.option(
    "--loading",
    type=click.Choice(["steps", "recorded"]),
    default="steps",
    help="Load point history in the model: ideal velocity steps (steps) or the recorded "
    "displacement (recorded).",
)
@make_number_with_units_option(
    "--averaging",
    "Averaging time of the data logger. If each averaging window ends at the recorded time, "
    "write 'trailing' before the averaging time. Examples: '1 s' or 'trailing 1 s'.  [default: "
    "no averaging]",
)
@click.option(
    "--low-pass",
    metavar="FILTER",
    default="",
    show_default=False,
    help="Low-pass filter that was applied to friction during recording: first_order, "
    "butterworth_2 or butterworth_4, followed by the corner frequency. Example: "
    "'butterworth_2 2 Hz'.  [default: no filter]",
)
@click.option(
    "--posterior",
    type=click.IntRange(0),
    metavar="N",
    default=0,
    show_default=False,
    help="Number of samples to draw from the posterior distribution with emcee.  [default: 0]",
)
@options.make_set_scene_fields_option("Set a scene field that is not fitted. Example: a=0.01.")
@options.make_positive_integer_option(
    "--budget",
    Defaults.FIT_EVALUATION_BUDGET,
    "Maximum number of right-hand-side evaluations per fit.",
)
@click.option(
    "--engine",
    type=click.Choice(Engine.NAMES),
    help="Integration engine.  [default: compiled if Numba is installed, otherwise scipy]",
)
@options.make_image_path_option(
    "--output",
    Path("fit.png"),
    "Figure path. The data are written to a NetCDF file in the same directory.",
)
@options.figure_style_options
@options.figure_header_option
@options.quiet_option
@options.json_option
def fit(command_options: options.CommandOptions) -> int:
    """Fit friction parameters to velocity steps in RECORDS.

    The command prints the detected steps and a table of a, b, D_c and their standard errors. The
    standard errors account for the correlation of the noise. The command also lists the parameters
    that the record does not constrain. The fits are written to a figure and a data file.

    The exit status is 1 if a fit has no values, if its values are not verified, or if its standard
    errors are not valid. The exit status is 2 if the command line is invalid. Otherwise the exit
    status is 0, even if a parameter is not identified.
    """
    from rsfstudy.api import STIFFNESS_OPTION_FROM_RECORD
    from rsfstudy.cli.overwrite_checks import check_output_may_be_replaced
    from rsfstudy.reporting import contains_fits

    data = command_options.output.with_suffix(".nc")
    check_output_may_be_replaced(data, contains_fits, "fit")
    about = collect_record_reading_options(command_options)
    if command_options.stiffness != STIFFNESS_OPTION_FROM_RECORD:
        about["stiffness"] = command_options.stiffness
    records = [rsfstudy.read_record(path, **about) for path in command_options.records]
    if not command_options.as_json:
        for record in records:
            _print_loading_steps(record)
    dataset = _fit_and_write_files(records, data, command_options)
    result = FitCommandResult(records, dataset, [command_options.output, data])
    return print_result_as_text_or_json(result, _print_fits, command_options.as_json)


def _fit_and_write_files(
    records: Sequence[Record], data_path: Path, command_options: options.CommandOptions
) -> xr.Dataset:
    """Fit the records, and write the figure and the data."""
    from rsfstudy.cli.assignment_parsing import parse_scene_field_assignments
    from rsfstudy.plots import save_figure
    from rsfstudy.storage import write_dataset

    dataset = rsfstudy.fit(
        records,
        steps=[_parse_step_number(text) for text in command_options.steps],
        progress=not command_options.quiet,
        command=command_options.command_line,
        **command_options.collect_option_values(*_OPTIONS_PASSED_TO_FIT),
        **parse_scene_field_assignments(command_options.settings),
    )
    dataset = write_dataset(dataset, data_path)
    appearance = command_options.collect_option_values("style", "width", "header")
    save_figure(dataset, command_options.output, **appearance)
    return dataset


def _parse_step_number(text: str) -> int:
    """Convert a step number of the option ``--step``."""
    if not text.isdecimal():
        rule = "must be an integer or a list of integers, for example 1,2"
        raise InvalidValue("--step", text, rule)
    return int(text)


def _print_fits(result: FitCommandResult) -> None:
    """Print the parameters of the fits, and the files."""
    from rsfstudy.reporting import build_summary_tables_and_sentences

    print_tables_and_sentences(build_summary_tables_and_sentences(result.fit_dataset))
    print_line(f"wrote {' and '.join(map(str, result.output_files))}", soft_wrap=True)


def _print_loading_steps(record: Record) -> None:
    """Print the steps of a record."""
    from rsfstudy.reporting import TextTable

    print_line(f"{record.name}: {len(record):,} rows, {len(record.loading_steps)} steps")
    stressed = any(step.normal_stress_ratio != 1.0 for step in record.loading_steps)
    rows = [
        {
            "step": str(number),
            "time (s)": f"{step.start:.6g}",
            "duration (s)": f"{step.end - step.start:.6g}",
            "V0 (um/s)": f"{step.velocity_before:.6g}",
            "V1 (um/s)": f"{step.velocity_after:.6g}",
            **_format_normal_stresses_of_step(step, stressed),
        }
        for number, step in enumerate(record.loading_steps[:_MAX_PRINTED_LOADING_STEPS], start=1)
    ]
    print_tables_and_sentences([TextTable(rows)])
    if (left := len(record.loading_steps) - _MAX_PRINTED_LOADING_STEPS) > 0:
        print_line(f"and {left} more steps")


def _format_normal_stresses_of_step(
    loading_step: LoadingStep, include_stresses: bool
) -> dict[str, str]:
    """Format the normal stresses before and after a step in MPa.

    The dictionary is empty if ``include_stresses`` is False.
    """
    stresses = {
        "sigma0 (MPa)": loading_step.stress_before,
        "sigma1 (MPa)": loading_step.stress_after,
    }
    return {heading: f"{of * 1e-6:.6g}" for heading, of in stresses.items() if include_stresses}
