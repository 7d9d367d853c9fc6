"""What the load point does, one file a history."""

from __future__ import annotations

from rsfstudy.slider.parts import found_in

PARTS = found_in(__name__, __path__)
