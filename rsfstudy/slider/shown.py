"""How a scene shows itself: as text, as the table of a notebook, and to tab completion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rsfstudy.markup import Markup, symbol, table, unit
from rsfstudy.quantity import Quantity
from rsfstudy.slider.fields import QUANTITIES, quantities_with

HEADINGS = ("field", "symbol", "value", "unit", "meaning")
#: Attributes of a scene that only its equations and its lattice ask for.
_INNER = frozenset(
    {
        "combination",
        "functions",
        "numbers",
        "numbers_of_friction",
        "owner",
        "under",
        "varied",
    }
)


class Shown:
    """What a scene says of itself."""

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        raise TypeError(f"{type(self).__name__} states no fields")

    @property
    def own_parts(self) -> tuple[type[Any], ...]:
        """Those of its parts that are the user's own."""
        raise TypeError(f"{type(self).__name__} states no parts")

    def __repr__(self) -> str:
        return f"Scene({', '.join(f'{k}={v!r}' for k, v in self.as_dict().items())})"

    def __dir__(self) -> list[str]:
        """What users ask for; a field without meaning in this scene is left out."""
        void = {name for name, value in self.as_dict().items() if value is None}
        void -= set(dir(type(self)))  # what is not stated may follow from other fields
        names = set(super().__dir__()) - void - _INNER
        return sorted(name for name in names if not name.startswith("_"))

    def _repr_html_(self) -> str:
        return fields_table(self, self.as_dict(), "Scene")


def fields_table(scene: Shown, values: Mapping[str, Any], caption: str = "") -> Markup:
    """A table of fields of a scene, less those without meaning in it."""
    about = {one.name: one for one in (*QUANTITIES, *quantities_with(scene.own_parts))}
    stated = ((name, value) for name, value in values.items() if value is not None)
    rows = (described(about.get(name, Quantity(name, "", "", "")), value) for name, value in stated)
    return table(HEADINGS, rows, caption)


def described(about: Quantity, value: object) -> tuple[object, ...]:
    """The row of a quantity, under `HEADINGS`."""
    return about.name, symbol(about.symbol), value, unit(about), about.long_name
