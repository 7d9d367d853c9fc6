"""Properties that are found once."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    derived = cached_property
else:

    class derived(cached_property):  # noqa: N801
        """A cached property whose first reading takes no lock: that of Python before 3.12 costs a
        microsecond, and a scene has a dozen.
        """

        def __get__(self, instance: Any, owner: type | None = None) -> Any:
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value
