"""Errors in threads and destructors while a cell is computed. Python would print them, over the
progress bar or on a worker where nobody looks; here they become part of the cell's message.
"""

from __future__ import annotations

import sys
import threading
import traceback

#: What was heard for the cell of each thread.
_heard: dict[int, list[str]] = {}
_hooks = (threading.excepthook, sys.unraisablehook)
_lock = threading.Lock()


class Overhearing:
    """Listens while this thread computes a cell; ``with`` gives the list of what was heard so far.

    Where other threads compute cells too, each hears of every thread that raises.
    """

    def __enter__(self) -> list[str]:
        global _hooks
        mine: list[str] = []
        self._thread = threading.get_ident()
        with _lock:
            if not _heard:
                _hooks = (threading.excepthook, sys.unraisablehook)
                threading.excepthook, sys.unraisablehook = _thread_raised, _destructor_raised
            self._outer = _heard.get(self._thread)  # a cell may run a study of its own
            _heard[self._thread] = mine
        return mine

    def __exit__(self, *_raised: object) -> None:
        with _lock:
            if self._outer is None:
                del _heard[self._thread]
            else:
                _heard[self._thread] = self._outer
            if not _heard:
                threading.excepthook, sys.unraisablehook = _hooks


def _thread_raised(raised: threading.ExceptHookArgs) -> None:
    if raised.exc_type is not SystemExit:  # which ends a thread without a word
        for heard in list(_heard.values()):
            heard.append(f"a thread raised {_in_words(raised.exc_type, raised.exc_value)}")


def _destructor_raised(raised: sys.UnraisableHookArgs) -> None:
    heard = _heard.get(threading.get_ident())
    if heard is None:  # it belongs to no cell
        _hooks[1](raised)
    else:
        heard.append(f"a destructor raised {_in_words(raised.exc_type, raised.exc_value)}")


def _in_words(kind: type[BaseException], error: BaseException | None) -> str:
    return traceback.format_exception_only(kind, error)[-1].strip()
