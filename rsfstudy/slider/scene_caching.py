"""Decorators that cache values in a scene, so that each value is computed only once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

ParametersAfterScene = ParamSpec("ParametersAfterScene")
FunctionResult = TypeVar("FunctionResult")

if TYPE_CHECKING:
    cached_attribute = cached_property
else:

    class cached_attribute(cached_property):  # noqa: N801
        """Cached property that does not acquire a lock.

        Before Python 3.12, the first access to a `functools.cached_property` acquires a lock, which
        takes about a microsecond. A scene has about a dozen cached properties.
        """

        def __get__(self, instance: Any, owner: type | None = None) -> Any:
            """Return the value of the attribute, and cache the value."""
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value


def cached_per_scene(
    function: Callable[Concatenate[Any, ParametersAfterScene], FunctionResult],
) -> Callable[Concatenate[Any, ParametersAfterScene], FunctionResult]:
    """Cache the results of a function in the scene that is its first argument.

    Parameters
    ----------
    function : callable
        Function whose first argument is a scene. The other arguments must be hashable.

    Returns
    -------
    callable
        Function that calls `function` once for each scene and each combination of the other
        arguments.
    """

    @wraps(function)
    def wrapper(
        scene: Any, /, *stated: ParametersAfterScene.args, **named: ParametersAfterScene.kwargs
    ) -> FunctionResult:
        made, key = scene.result_cache, (function, *stated, *named.values())
        # The code looks the key up only once, because hashing a key can be slow.
        found = made.get(key)
        if found is None:
            found = made[key] = function(scene, *stated, **named)
        return found

    return wrapper
