"""Progress bars and progress lines of a run."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from rich import progress as bars
from rich.console import Console

from rsfstudy.execution import ProgressCallback
from rsfstudy.formatting import format_duration
from rsfstudy.motion import Engine
from rsfstudy.slider import Scene

#: Maximum number of progress lines of a run, and minimum time in s between two lines.
_MAX_PROGRESS_LINES, _MIN_PROGRESS_LINE_INTERVAL = 10, 10.0
#: Minimum estimated time in s of a run whose estimated time is printed.
_MIN_REMAINING_SECONDS_TO_PRINT = 20.0


@contextlib.contextmanager
def show_progress(
    study_name: str,
    is_shown_or_callback: bool | ProgressCallback,
    item_name: str = "cells",
    delay_seconds: float = 0.0,
) -> Iterator[ProgressCallback]:
    """Show the progress of a run on standard error, or pass the progress to a callback.

    Parameters
    ----------
    study_name : str
        Name of the study, which is displayed next to the bar.
    is_shown_or_callback : bool or callable
        If False, nothing is displayed. If a function, the function receives the number of
        completed items, the number of all items and the remaining time in s instead.
    item_name : str, default: "cells"
        Name of the counted objects.
    delay_seconds : float, default: 0.0
        Time in s before the first output. Nothing is displayed if the run ends earlier.

    Yields
    ------
    callable
        Function ``update(done, total, remaining_seconds)`` that displays the number of completed
        cells and the remaining time. If the first call reports completed cells, an earlier run has
        stored these cells, and the function prints their number.
    """
    console = Console(stderr=True)
    if callable(is_shown_or_callback):
        yield is_shown_or_callback
    elif not is_shown_or_callback:
        yield lambda _done, _all, _remaining: None
    elif not (console.is_terminal or console.is_jupyter):
        yield _make_progress_line_printer(study_name, console, item_name, delay_seconds)
    else:
        counts = (bars.MofNCompleteColumn(), bars.TextColumn(item_name))
        times = (bars.TimeElapsedColumn(), bars.TimeRemainingColumn())
        told = (bars.TextColumn("{task.description}"), bars.BarColumn(), *counts, *times)
        bar = bars.Progress(*told, console=console)
        task = bar.add_task(study_name, total=None)
        began = time.monotonic()
        is_first_call = True

        def update(done: int, total: int, _remaining: float | None = None) -> None:
            """Update the progress bar."""
            nonlocal is_first_call
            if is_first_call and done:
                _print_line(console, study_name, format_reused_cells(done, total, item_name))
            is_first_call = False
            if time.monotonic() - began >= delay_seconds:
                bar.start()  # The bar starts late because a run may fail before its first report.
                bar.update(task, completed=done, total=total)

        try:
            yield update
        finally:
            bar.stop()


def _make_progress_line_printer(
    study_name: str, console: Console, item_name: str, delay_seconds: float
) -> ProgressCallback:
    """Return a function that prints progress lines for log files and pipes.

    For a long run, the function prints the estimated time once, after the first cells have been
    computed. In addition, the function prints a progress line at most once per 10 % of the cells.
    Progress lines are printed at least ten seconds apart, except for the last line, which is always
    printed. A short run therefore prints a single line.
    """
    began = said = time.monotonic()
    told, is_estimated, is_first_call = 0, False, True
    print_line = partial(_print_line, console, study_name)

    def update(done: int, total: int, remaining: float | None = None) -> None:
        """Print a progress line if enough cells have been completed."""
        nonlocal said, told, is_estimated, is_first_call
        if is_first_call and done:
            print_line(format_reused_cells(done, total, item_name))
        is_first_call = False
        now, part = time.monotonic(), _MAX_PROGRESS_LINES * done // total
        left = "" if remaining is None else f", about {format_duration(remaining)} left"
        if now - began < delay_seconds:
            return
        if not is_estimated and (remaining or 0.0) > _MIN_REMAINING_SECONDS_TO_PRINT:
            is_estimated = True
            print_line(f"{done:,} of {total:,} {item_name} are finished{left}")
        if part > told and (
            part == _MAX_PROGRESS_LINES or now - said >= _MIN_PROGRESS_LINE_INTERVAL
        ):
            said, told = now, part
            print_line(
                f"{done:,} of {total:,} {item_name} after {now - began:.0f} "
                f"s{left * (done < total)}"
            )

    return update


def _print_line(console: Console, study_name: str, text: str) -> None:
    """Print a line about the run of a study."""
    console.print(f"{study_name}: {text}", highlight=False, markup=False, soft_wrap=True)


def format_reused_cells(reused: int, total: int, item_name: str = "cells") -> str:
    """Format the number of cells that an earlier run has stored.

    Parameters
    ----------
    reused : int
        Number of cells that are not computed again.
    total : int
        Number of all cells.
    item_name : str, default: "cells"
        Name of the counted objects.

    Returns
    -------
    str
        Sentence without a full stop, for example "12 of 30 cells were stored by an earlier run".
    """
    return f"{reused:,} of {total:,} {item_name} were stored by an earlier run"


def compile_equations_and_print_time(
    example_scenes: Sequence[Scene],
    include_time_equation_flags: Sequence[bool],
    is_notice_shown: bool,
) -> None:
    """Compile the equations of scenes, and print the compilation time.

    The equations are compiled before the first cell is computed, so the measured cell times do not
    include the compilation.

    Parameters
    ----------
    example_scenes : sequence of Scene
        Scenes whose equations are compiled. Scenes with the same parts share their equations.
    include_time_equation_flags : sequence of bool
        Variants of the equations to compile. True selects the equations with time as a variable.
    is_notice_shown : bool
        If False, nothing is displayed.
    """
    console, before = (
        Console(stderr=True, quiet=not is_notice_shown),
        replace(Engine.compilation_log),
    )
    with console.status("compiling the equations ..."):
        for scene, clock in itertools.product(example_scenes, include_time_equation_flags):
            Engine.import_compiled_engine().compile_equations_of_scene(
                scene, include_time_equation=clock
            )
    programs, seconds = (
        Engine.compilation_log.compiled_program_count - before.compiled_program_count,
        Engine.compilation_log.total_compilation_seconds - before.total_compilation_seconds,
    )
    if programs:
        console.print(
            f"compiled the equations ({programs} programs) in {seconds:.0f} s; later "
            "runs use the cache"
        )
