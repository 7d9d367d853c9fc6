"""Progress of a run: a bar on a terminal and in a notebook, lines everywhere else."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

from rich import progress as bars
from rich.console import Console

from rsfstudy.execution import ProgressCallback
from rsfstudy.motion import compilation_log, import_compiled_engine
from rsfstudy.slider import Scene

#: Most lines of a whole run, where there is no bar, and s between two of them.
_MAX_PROGRESS_LINES, _MIN_PROGRESS_LINE_INTERVAL = 10, 10.0


@contextlib.contextmanager
def show_progress(study_name: str, is_shown: bool) -> Iterator[ProgressCallback]:
    """Display of how far the run of a study has come, on the standard error."""
    console = Console(stderr=True)
    if not is_shown:
        yield lambda _done, _all: None
    elif not (console.is_terminal or console.is_jupyter):
        yield _print_progress_lines(study_name, console)
    else:
        cells = (bars.MofNCompleteColumn(), bars.TextColumn("cells"))
        times = (bars.TimeElapsedColumn(), bars.TimeRemainingColumn())
        told = (bars.TextColumn("{task.description}"), bars.BarColumn(), *cells, *times)
        bar = bars.Progress(*told, console=console)
        task = bar.add_task(study_name, total=None)

        def update(done: int, total: int) -> None:
            bar.start()  # only now, because a run may fail before its first report
            bar.update(task, completed=done, total=total)

        try:
            yield update
        finally:
            bar.stop()


def _print_progress_lines(study_name: str, console: Console) -> ProgressCallback:
    """A line for each tenth of the cells, but no two at once, for log files and pipes; a run that
    is soon over has one.
    """
    began = said = time.monotonic()
    told = 0

    def update(done: int, total: int) -> None:
        nonlocal said, told
        now, part = time.monotonic(), _MAX_PROGRESS_LINES * done // total
        if part > told and (
            part == _MAX_PROGRESS_LINES or now - said >= _MIN_PROGRESS_LINE_INTERVAL
        ):
            said, told = now, part
            text = f"{study_name}: {done:,} of {total:,} cells after {now - began:.0f} s"
            console.print(text, highlight=False, markup=False, soft_wrap=True)

    return update


def compile_scenes_with_notice(
    example_scenes: Sequence[Scene], with_time_variants: Sequence[bool], is_shown: bool
) -> None:
    """Compile what such scenes need, with time or without it, before any cell is timed, and say how
    long it took.
    """
    console, before = Console(stderr=True, quiet=not is_shown), replace(compilation_log)
    with console.status("compiling the equations ..."):
        for scene, clock in itertools.product(example_scenes, with_time_variants):
            import_compiled_engine().compile_equations_of_scene(scene, with_time=clock)
    programs, seconds = (
        compilation_log.compiled_program_count - before.compiled_program_count,
        compilation_log.total_compilation_seconds - before.total_compilation_seconds,
    )
    if programs:
        console.print(f"compiled the equations ({programs} programs) in {seconds:.0f} s, once")
