"""Runner that performs computations in a thread and shows a progress bar and cancel button."""

from __future__ import annotations

import ctypes
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import panel as pn

from rsfstudy.errors import RsfStudyWarning

#: Function with which a computation reports its progress: a fraction from 0 to 1, and a text.
ReportProgressFunction = Callable[[float, str], None]


#: Time in s after which the progress bar of a computation becomes visible.
PROGRESS_BAR_DELAY_SECONDS = 0.4
_WARNINGS_OF_THREAD = threading.local()


def redirect_warnings_to_browser_page() -> None:
    """Send warnings to ``collect_warnings_of_thread`` instead of the terminal.

    The server calls this function once. In a notebook, the function is not called, and warnings are
    displayed as usual.
    """
    print_warning = warnings.showwarning

    def show(message: Warning | str, *place: Any, **options: Any) -> None:
        if isinstance(message, RsfStudyWarning) and hasattr(_WARNINGS_OF_THREAD, "messages"):
            _WARNINGS_OF_THREAD.messages.append(str(message))
        else:
            print_warning(message, *place, **options)

    warnings.filterwarnings("always", category=RsfStudyWarning)
    warnings.showwarning = show


@contextmanager
def collect_warnings_of_thread() -> Iterator[list[str]]:
    """Collect the warnings that this thread issues during a ``with`` block.

    Yields
    ------
    list of str
        Messages, if the server has called ``redirect_warnings_to_browser_page``.
    """
    _WARNINGS_OF_THREAD.messages = []
    try:
        yield _WARNINGS_OF_THREAD.messages
    finally:
        del _WARNINGS_OF_THREAD.messages


class JobCancelled(KeyboardInterrupt):
    """Raised in the thread of a computation when the user cancels the computation.

    Studies and fits record all exceptions except ``KeyboardInterrupt`` as outcomes of cells. The
    class is therefore a subclass of ``KeyboardInterrupt``, and cancelling a computation has the
    same effect as pressing Ctrl-C.
    """


class _BackgroundJob(NamedTuple):
    """Waiting computation, and the callbacks that receive the outcome of the computation."""

    progress_label: str
    computation_function: Callable[[ReportProgressFunction], Any]
    on_result: Callable[[Any], None]
    on_error: Callable[[Exception], None]
    bokeh_document: Any


class BackgroundJobRunner:
    """Runner that executes the computations of a view in a thread, one at a time.

    If a computation is started while another computation is running, the new computation waits. The
    new computation replaces any computation that is already waiting, so at most one computation
    waits. When the running computation ends, its results are discarded if another computation is
    waiting. Therefore, moving a slider quickly does not build up a queue of computations.

    Parameters
    ----------
    warn : callable
        Function that receives the warnings of a computation, in the thread of the page. If there
        are no warnings, the sequence is empty.

    Attributes
    ----------
    indicator : panel.Row
        Progress bar and cancel button. They become visible if a computation takes longer than
        `PROGRESS_BAR_DELAY_SECONDS` seconds.
    """

    def __init__(self, warn: Callable[[Sequence[str]], None]) -> None:
        """Create a runner that has no running or waiting computation."""
        self._warn = warn
        self._bar = pn.indicators.Progress(
            active=True, value=-1, max=1000, sizing_mode="stretch_width", margin=(12, 5)
        )
        self._label = pn.pane.Str("", margin=(5, 5))
        self._button = pn.widgets.Button(label="Cancel", color="danger", width=90)
        self._button.on_click(lambda _event: self.cancel_all())
        self.indicator = pn.Row(self._label, self._bar, self._button, visible=False)
        self._lock = threading.Lock()
        self._running: tuple[_BackgroundJob, threading.Thread] | None = None
        self._waiting: _BackgroundJob | None = None
        self._cancelled: _BackgroundJob | None = None

    @property
    def is_running(self) -> bool:
        """True while a computation is running or waiting."""
        return self._running is not None

    def start(
        self,
        computation_function: Callable[[ReportProgressFunction], Any],
        on_result: Callable[[Any], None],
        on_error: Callable[[Exception], None],
        *,
        progress_label: str = "",
    ) -> None:
        """Run a computation in a thread, as soon as the browser has loaded the page.

        Parameters
        ----------
        computation_function : callable
            Function that takes a function ``report(fraction, text)`` and returns the result. The
            function may call ``report`` to move the progress bar.
        on_result : callable
            Function that receives the result, in the thread of the page.
        on_error : callable
            Function that receives an exception of the computation, in the thread of the page.
        progress_label : str, optional
            Text next to the progress bar.
        """
        job = _BackgroundJob(
            progress_label, computation_function, on_result, on_error, pn.state.curdoc
        )
        pn.state.onload(partial(self._start_or_queue, job))

    def _start_or_queue(self, job: _BackgroundJob) -> None:
        """Start a job, or keep it waiting if another job is running."""
        with self._lock:
            if self._running is not None:
                self._waiting = job
                return
            self._start_thread(job)

    def cancel_all(self) -> None:
        """Cancel the running computation, and discard a waiting computation."""
        with self._lock:
            self._waiting = None
            if self._running is None:
                return
            self._cancelled, thread = self._running
            if thread.ident is not None:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(
                    ctypes.c_ulong(thread.ident), ctypes.py_object(JobCancelled)
                )

    def _start_thread(self, job: _BackgroundJob) -> None:
        """Start the thread of a job, and show the progress bar if the job takes long."""
        thread = threading.Thread(target=self._run_job, args=(job,), daemon=True)
        self._running = job, thread
        timer = threading.Timer(
            PROGRESS_BAR_DELAY_SECONDS,
            _call_in_page_thread,
            (job, partial(self._show_progress_bar_if_running, job)),
        )
        timer.daemon = True
        thread.start()
        timer.start()

    def _run_job(self, job: _BackgroundJob) -> None:
        """Compute the result of a job, and deliver the result to the page."""
        outcome: Callable[[], None] | None = None
        with collect_warnings_of_thread() as messages:
            try:
                outcome = partial(
                    job.on_result, job.computation_function(partial(self._update_progress_bar, job))
                )
            except Exception as error:
                outcome = partial(job.on_error, error)
            except JobCancelled:
                pass
        with self._lock:
            if job is self._cancelled:  # A run converts the exception to another exception.
                outcome = None
            successor, self._waiting, self._running = self._waiting, None, None
            if successor is not None:
                self._start_thread(successor)
        if successor is None:
            _call_in_page_thread(job, partial(self._finish_job, job, outcome, messages))

    def _finish_job(
        self,
        job: _BackgroundJob,
        deliver_outcome: Callable[[], None] | None,
        warning_messages: Sequence[str],
    ) -> None:
        """Hide the progress bar, and deliver the outcome of a job."""
        if self._running is None:
            self.indicator.visible = False
        if deliver_outcome is not None:
            self._warn(warning_messages)
            try:
                deliver_outcome()
            except Exception as error:
                job.on_error(error)

    def _update_progress_bar(self, job: _BackgroundJob, fraction: float, text: str = "") -> None:
        """Move the progress bar."""

        def move() -> None:
            self._bar.value = max(0, min(1000, round(1000 * fraction)))
            if text:
                self._label.object = text

        _call_in_page_thread(job, move)

    def _show_progress_bar_if_running(self, job: _BackgroundJob) -> None:
        """Show the progress bar if the job is still running."""
        if self._running is not None and self._running[0] is job:
            if not self.indicator.visible:
                self._bar.value, self._label.object = -1, job.progress_label
            self.indicator.visible = True


def _call_in_page_thread(job: _BackgroundJob, function: Callable[[], None]) -> None:
    """Call a function in the thread of the page, or in this thread if there is no page."""
    if job.bokeh_document is None or not job.bokeh_document.session_context:
        function()
    else:
        job.bokeh_document.add_next_tick_callback(function)
