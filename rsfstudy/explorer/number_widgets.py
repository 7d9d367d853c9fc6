"""Widgets for numbers: a slider and a box for exact values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import panel as pn

#: Rules with which parts declare fields that have no negative values.
POSITIVE, NON_NEGATIVE = "must be greater than 0", "must be 0 or greater"
#: Steps of a slider.
_SLIDER_STEP_COUNT = 200
#: Ratio of the largest value of a slider to the typical value, for fields without a scale, such as
#: a, and for times and velocities.
_RATIO_OF_PLAIN_FIELD, _RATIO_OF_SCALED_FIELD = 4.0, 100.0


class SliderRange(NamedTuple):
    """Range of a slider.

    Parameters
    ----------
    low, high : float
        Smallest and largest value.
    is_logarithmic : bool
        True if equal distances on the slider are equal ratios of the value.
    has_only_whole_numbers : bool
        True if all values are whole numbers.
    """

    low: float
    high: float
    is_logarithmic: bool = False
    has_only_whole_numbers: bool = False

    @classmethod
    def choose_for_field(
        cls, default_value: float, typical_value: float, validation_rule: str, scale_name: str
    ) -> SliderRange:
        """Choose the range of a slider from the declaration of the field.

        Parameters
        ----------
        default_value : float
            Default value, which is 0 if the field is optional.
        typical_value : float
            Positive value in the middle of the range.
        validation_rule : str
            Rule that the values satisfy, as the part declares it.
        scale_name : str
            Scale of the field, such as "D_c/V_*", or an empty string.

        Returns
        -------
        SliderRange
            Range. The box accepts values outside the range.
        """
        high = _RATIO_OF_PLAIN_FIELD * typical_value
        if "whole number" in validation_rule:
            return cls(0.0, max(20.0, 2.0 * typical_value), has_only_whole_numbers=True)
        if "between 0 and 1" in validation_rule:
            return cls(0.0, 1.0)
        if validation_rule == POSITIVE or (
            validation_rule == NON_NEGATIVE and scale_name in ("V_*", "D_c/V_*")
        ):
            ratio = _RATIO_OF_SCALED_FIELD if scale_name else _RATIO_OF_PLAIN_FIELD
            return cls(typical_value / ratio, typical_value * ratio, is_logarithmic=True)
        return cls(0.0 if validation_rule == NON_NEGATIVE or default_value else -high, high)

    def convert_position_to_value(self, position: float) -> float:
        """Return the value at a position between 0 and 1, with 4 significant digits."""
        if self.is_logarithmic:
            value = self.low * (self.high / self.low) ** position
        else:
            value = self.low + (self.high - self.low) * position
        return float(round(value) if self.has_only_whole_numbers else f"{value:.4g}")

    def convert_value_to_position(self, value: float) -> float:
        """Return the position of a value, or the nearest end of the slider."""
        if not self.is_logarithmic:
            position = (value - self.low) / (self.high - self.low)
        elif value > 0.0:
            position = math.log(value / self.low) / math.log(self.high / self.low)
        else:
            position = 0.0
        return min(1.0, max(0.0, position))


class NumberWidget:
    """Slider and box for one number.

    Parameters
    ----------
    label : str
        Description of the number.
    unit : str
        Unit, which is shown above the box.
    value : float or None
        Value. None leaves the box empty, and the field has its default value.
    limits : SliderRange
        Range of the slider.
    changed : callable
        Function that receives a new value, or None if the box is cleared.
    meaning : str, default: ""
        Description of the number, which a tooltip shows.

    Attributes
    ----------
    row : panel.Row
        Slider and box.
    """

    def __init__(
        self,
        label: str,
        unit: str,
        value: float | None,
        limits: SliderRange,
        changed: Callable[[float | None], None],
        meaning: str = "",
    ) -> None:
        """Create the widgets."""
        self._limits, self._changed, self._is_moved_by_code = limits, changed, False
        self._slider = pn.widgets.FloatSlider(
            label=label, start=0.0, end=1.0, step=1.0 / _SLIDER_STEP_COUNT, show_value=False,
            width=145, value=limits.convert_value_to_position(value or 0.0), tooltips=False,
        )  # fmt: skip
        step = 10.0 ** math.floor(math.log10(max(abs(limits.low), abs(limits.high)))) / 100.0
        self._box = pn.widgets.FloatInput(
            label=unit or " ", value=value, width=95, step=step, description=meaning or None
        )
        self._slider.param.watch(self._update_box_from_slider, "value")
        self._box.param.watch(self._update_slider_from_box, "value")
        self.row = pn.Row(self._slider, self._box, margin=0)

    def _update_box_from_slider(self, event: Any) -> None:
        """Write the value of the slider to the box."""
        if not self._is_moved_by_code:
            self._set_value_without_callback(
                self._box, self._limits.convert_position_to_value(event.new)
            )
            self._changed(self._box.value)

    def _update_slider_from_box(self, event: Any) -> None:
        """Move the slider to the value in the box."""
        if not self._is_moved_by_code:
            self._set_value_without_callback(
                self._slider, self._limits.convert_value_to_position(event.new or 0.0)
            )
            self._changed(event.new)

    def _set_value_without_callback(self, widget: Any, value: float) -> None:
        """Set the value of a widget without calling the callback for changed values."""
        self._is_moved_by_code = True
        try:
            widget.value = value
        finally:
            self._is_moved_by_code = False
