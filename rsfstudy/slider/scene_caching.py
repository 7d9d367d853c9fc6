"""What is found once for each scene."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

if TYPE_CHECKING:
    cached_attribute = cached_property
else:

    class cached_attribute(cached_property):  # noqa: N801
        """A cached property whose first reading takes no lock: that of Python before 3.12 costs a
        microsecond, and a scene has a dozen.
        """

        def __get__(self, instance: Any, owner: type | None = None) -> Any:
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value


def cached_per_scene(
    function: Callable[Concatenate[Any, P], T],
) -> Callable[Concatenate[Any, P], T]:
    """A function of a scene that is called once for each scene and what is stated beside it."""

    @wraps(function)
    def wrapper(scene: Any, /, *stated: P.args, **named: P.kwargs) -> T:
        made, key = scene.cache, (function, *stated, *named.values())
        found = made.get(key)  # a key may take long to hash
        if found is None:
            found = made[key] = function(scene, *stated, **named)
        return found

    return wrapper
