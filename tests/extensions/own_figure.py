"""A user-defined figure: a function that plots a dataset."""

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import LinearStability


def stiffness_map(dataset, axes):
    drawn = dataset.critical_stiffness.plot(ax=axes, x="b_over_a", xscale="log")
    axes.set_ylabel("Angle (degrees)")
    drawn.colorbar.set_label("Critical stiffness")


study = Study(
    name="stiffness_map",
    title="Critical stiffness",
    base=Scene(),
    axes=[Axis("phi", [50, 60, 70]), Axis("b_over_a", [1.5, 2, 3])],
    measure=LinearStability(),
    plot=stiffness_map,
)
