"""Computations of a view in a thread, with a progress bar and a cancel button."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import panel as pn

#: Function with which a computation reports its progress: a fraction from 0 to 1, and a text.
Report = Callable[[float, str], None]


class Cancelled(BaseException):
    """Raised in the thread of a computation when the user cancels the computation.

    The class is not derived from ``Exception``, so that no handler of errors catches it. A
    computation is therefore cancelled in the same way as Ctrl-C interrupts a command.
    """


class _Job(NamedTuple):
    """Computation that waits for its thread, and the functions that receive its outcome."""

    label: str
    compute: Callable[[Report], Any]
    deliver: Callable[[Any], None]
    fail: Callable[[Exception], None]
    document: Any


class Jobs:
    """Runner of the computations of one view, with at most one thread.

    If a computation is started while another one is running, the new computation waits, and it
    replaces a computation that is already waiting. Results of a computation are discarded if a new
    computation is waiting. A slider that moves faster than the computation therefore causes no
    queue.

    Attributes
    ----------
    indicator : panel.Row
        Progress bar and cancel button, which are visible while a long computation is running.
    """

    def __init__(self) -> None:
        """Create the runner without a computation."""
        self._bar = pn.indicators.Progress(
            active=True, value=-1, max=1000, sizing_mode="stretch_width", margin=(12, 5)
        )
        self._label = pn.pane.Str("", margin=(5, 5))
        self._button = pn.widgets.Button(name="Cancel", button_type="danger", width=90)
        self._button.on_click(lambda _event: self.cancel())
        self.indicator = pn.Row(self._label, self._bar, self._button, visible=False)
        self._lock = threading.Lock()
        self._running: tuple[_Job, threading.Thread] | None = None
        self._waiting: _Job | None = None

    @property
    def is_running(self) -> bool:
        """True while a computation is running or waiting."""
        return self._running is not None

    def start(
        self,
        compute: Callable[[Report], Any],
        deliver: Callable[[Any], None],
        fail: Callable[[Exception], None],
        *,
        label: str = "",
    ) -> None:
        """Run a computation in a thread.

        Parameters
        ----------
        compute : callable
            Function that takes a function ``report(fraction, text)`` and returns the result. The
            function may call ``report`` to move the progress bar.
        deliver : callable
            Function that receives the result, in the thread of the page.
        fail : callable
            Function that receives an exception of the computation, in the thread of the page.
        label : str, optional
            Text next to the progress bar. Without a text, the progress bar is not shown, which
            suits computations that take a fraction of a second.
        """
        job = _Job(label, compute, deliver, fail, pn.state.curdoc)
        with self._lock:
            if self._running is not None:
                self._waiting = job
                return
            self._launch(job)
        self._show(label)

    def cancel(self) -> None:
        """Cancel the running computation, and discard a waiting computation."""
        with self._lock:
            self._waiting = None
            if self._running is None:
                return
            thread = self._running[1]
            if thread.ident is not None:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(
                    ctypes.c_ulong(thread.ident), ctypes.py_object(Cancelled)
                )

    def _launch(self, job: _Job) -> None:
        """Start the thread of a job."""
        thread = threading.Thread(target=self._work, args=(job,), daemon=True)
        self._running = job, thread
        thread.start()

    def _work(self, job: _Job) -> None:
        """Compute the result of a job, and deliver the result to the page."""
        outcome: Callable[[], None] | None = None
        try:
            result = job.compute(partial(self._report, job))
            outcome = partial(job.deliver, result)
        except Exception as error:
            outcome = partial(job.fail, error)
        except Cancelled:
            pass
        with self._lock:
            successor, self._waiting, self._running = self._waiting, None, None
            if successor is not None:
                self._launch(successor)
        _call_in_document(job, lambda: self._finish(outcome, successor))

    def _finish(self, outcome: Callable[[], None] | None, successor: _Job | None) -> None:
        """Deliver the outcome of a job unless another job has replaced it."""
        self._show(successor.label if successor else "")
        if outcome is not None and successor is None:
            outcome()

    def _report(self, job: _Job, fraction: float, text: str = "") -> None:
        """Move the progress bar."""

        def move() -> None:
            self._bar.value = max(0, min(1000, round(1000 * fraction)))
            if text:
                self._label.object = text

        _call_in_document(job, move)

    def _show(self, label: str) -> None:
        """Show the progress bar if a label is given, and hide it otherwise."""
        self._label.object, self._bar.value = label, -1
        self.indicator.visible = bool(label)


def _call_in_document(job: _Job, function: Callable[[], None]) -> None:
    """Call a function in the thread of the page, or immediately if there is no page."""
    if job.document is None or not job.document.session_context:
        function()
    else:
        job.document.add_next_tick_callback(function)
