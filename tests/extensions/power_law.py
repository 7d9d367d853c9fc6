"""A user-defined reduction: the exponent of a power law along an axis.

The exponent is computed from the first and the last point of the axis.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import LinearStability, Quantity
from rsfstudy.reductions import Reduction


@dataclass(frozen=True)
class Exponent(Reduction):
    on: str = ""
    kind: ClassVar[str] = "exponent"

    @property
    def quantities(self):
        return (Quantity(self.name, "$n$", "1", f"exponent of {self.of} as a power of {self.on}"),)

    def __call__(self, dataset):
        ends = dataset[[self.of, self.on]].isel({self.on: [0, -1]})
        rise = np.log(ends[self.of]).diff(self.on).squeeze(self.on, drop=True)
        run = np.log(ends[self.on]).diff(self.on).squeeze(self.on, drop=True)
        return (rise / run).to_dataset(name=self.name)


study = Study(
    name="power_law",
    title="Critical stiffness against the direct effect",
    base=Scene(normal_stress="constant"),
    axes=[Axis("b_over_a", [1.5, 2]), Axis("a", [0.005, 0.01, 0.02])],
    measure=LinearStability(),
    reductions=[Exponent(name="exponent", of="critical_stiffness", on="a")],
)
