"""Generator of the problem descriptions on the referee page.

Run ``python tests/benchmarks/referee_page.py`` to update the page.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from second_referee_way import PROBLEMS, read_stated_problem

PAGE = Path(__file__).parents[2] / "studies" / "pages" / "reference" / "referee.md"
PROBLEMS_MARKER = "<!-- problems: written by tests/benchmarks/referee_page.py -->\n"
#: Wording of the conventions on the page, by their wording in the problem files. Problem files
#: never change, so the page rephrases their sentences.
PAGE_WORDING = {
    "Friction is spring stress over normal stress.": (
        "The quantity `friction` is the spring stress divided by the normal stress."
    ),
    "Friction is that of the fault, mu, and not tau/sigma of the spring.": (
        "The quantity `friction` is the friction coefficient mu of the fault, and not the ratio "
        "tau/sigma of the spring."
    ),
    "Friction is mu, and not tau/sigma of the spring.": (
        "The quantity `friction` is the friction coefficient mu, and not the ratio tau/sigma of "
        "the spring."
    ),
    "Friction is shear stress over effective normal stress.": (
        "The quantity `friction` is the shear stress divided by the effective normal stress."
    ),
    "theta is in s.": "The state variable theta is in seconds.",
    "theta_1 and theta_2 are in s.": "The state variables theta_1 and theta_2 are in seconds.",
    "theta is in s; no mass, no damping.": (
        "The state variable theta is in seconds. The slider has no mass, and there is no radiation "
        "damping."
    ),
    "The motion is quasi-static: no mass, no damping.": (
        "The motion is quasi-static, without inertia and radiation damping."
    ),
    "There is no mass.": "The slider has no mass.",
    "There is no damping.": "There is no radiation damping.",
    "It slides steadily at V_* before the first velocity of the load point.": (
        "The slider is in steady sliding at V_* before t = 0."
    ),
    "In steady sliding it is 2 D_c/V, and the logarithm has 2 D_c too: without that friction "
    "would be higher by b ln 2.": (
        "In steady sliding, theta is equal to 2 D_c/V. The logarithm also contains 2 D_c instead "
        "of D_c. With D_c in the logarithm, the friction coefficient would be higher by b ln 2."
    ),
    "The load point is held from 10 s to 1010 s.": (
        "The load point does not move between 10 s and 1010 s."
    ),
    "The second state strengthens.": (
        "The second state variable has a velocity-strengthening effect, because b_2 is negative."
    ),
    "e = 1 is the slowness law, e to 0 the slip law.": (
        "For e = 1, the equation is the slowness law. As e approaches 0, the equation approaches "
        "the slip law."
    ),
    "theta_* is that of steady sliding at V_*, where mu is mu_*: theta_* = (D_c/V_*) exp(u) with "
    "u exp(u) = exp(-V_*/V_c), and not D_c/V_*.": (
        "In steady sliding at V_*, theta is equal to theta_* and mu is equal to mu_*. The value of "
        "theta_* is (D_c/V_*) exp(u) with u exp(u) = exp(-V_*/V_c), and not D_c/V_*."
    ),
    "Friction at V_* and theta = D_c/V_*, with which it begins, is a arcsinh[exp(mu_*/a)/2] and "
    "not mu_*: here the logarithm and arcsinh differ in the third digit.": (
        "The motion starts with V = V_* and theta = D_c/V_*. The initial friction coefficient is "
        "a arcsinh[exp(mu_*/a)/2], and not mu_*. In this problem, the results of the logarithm and "
        "of arcsinh differ in the third digit."
    ),
    "eta = G/(2 c_s) is radiation_damping: codes that take G/c_s have twice as much.": (
        "The parameter `radiation_damping` is eta = G/(2 c_s). Codes that use G/c_s have twice "
        "this damping."
    ),
    "eta = G/(2 c_s) is radiation_damping.": (
        "The parameter `radiation_damping` is eta = G/(2 c_s)."
    ),
    "eta = G/(2 c_s) is radiation_damping, and V_0 load_velocity.": (
        "The parameter `radiation_damping` is eta = G/(2 c_s), and the parameter `load_velocity` "
        "is V_0."
    ),
    "It begins with the slip rate and theta stated, and not in steady sliding; tau follows from "
    "them.": (
        "The motion starts with the given slip rate and theta, and not in steady sliding. The "
        "initial value of tau follows from the slip rate and theta."
    ),
    "It begins with the slip rate and thetas stated.": (
        "The motion starts with the given slip rate and the given values of theta_1 and theta_2."
    ),
    "It slides steadily at V_* until the load point steps to its velocity at t = 0; slip rate "
    "does not jump then.": (
        "The slider is in steady sliding at V_* until the load point velocity changes suddenly at "
        "t = 0. The slip rate is continuous at t = 0."
    ),
    "Normal stress rises suddenly at 10 s, and theta falls with it by the factor "
    "(sigma_before/sigma_after)^(alpha/b); tau does not change then.": (
        "The normal stress increases suddenly at 10 s. At the same time, theta is multiplied by "
        "the factor (sigma_before/sigma_after)^(alpha/b), and tau does not change."
    ),
    "It slides steadily at V_* before t = 0, and the load point goes on so.": (
        "The slider is in steady sliding at V_* before t = 0. The load point continues to move at "
        "V_* after t = 0."
    ),
    "p is pore pressure above that of the surroundings, and phi porosity above that of steady "
    "sliding at V_* over compressibility, in Pa.": (
        "The variable p is the difference between the pore pressure and the pressure of the "
        "surroundings. The variable phi is the difference between the porosity and the porosity in "
        "steady sliding at V_*, divided by the compressibility, and its unit is Pa."
    ),
    "The stiffness below which steady sliding at V_* is unstable.": (
        "The quantity `critical_stiffness` is the stiffness below which steady sliding at V_* is "
        "unstable."
    ),
    "Small departures from steady sliding at V_* grow as exp(p t): growth_rate is the real, "
    "angular_frequency the imaginary part of p.": (
        "Small perturbations of steady sliding at V_* grow as exp(p t). The quantity `growth_rate` "
        "is the real part of p, and `angular_frequency` is the imaginary part of p."
    ),
    "critical_stiffness is the one at which they neither grow nor decay.": (
        "The quantity `critical_stiffness` is the stiffness at which small perturbations neither "
        "grow nor decay."
    ),
    "It slides steadily at V_* until the load point steps to V_0.": (
        "The slider is in steady sliding at V_* until the load point velocity changes suddenly to "
        "V_0."
    ),
    "critical_velocity is the smallest V_0 for which slip rate reaches V_unstable.": (
        "The quantity `critical_velocity` is the smallest V_0 for which the slip rate reaches "
        "`V_unstable`."
    ),
    "It slides steadily at V_* until the load point moves suddenly by a displacement, and then "
    "rests (V_0 = 0).": (
        "The slider is in steady sliding at V_* until the load point moves suddenly by a "
        "displacement. After this step, the load point does not move (V_0 = 0)."
    ),
    "critical_displacement is the smallest for which slip rate reaches V_unstable.": (
        "The quantity `critical_displacement` is the smallest displacement for which the slip rate "
        "reaches `V_unstable`."
    ),
    "Numbers are of the limit cycle, which every motion comes to: the time between maxima of slip "
    "rate, that maximum and the minimum.": (
        "The results describe the limit cycle, to which every motion converges. The quantity "
        "`recurrence_interval` is the time between two maxima of the slip rate. The quantities "
        "`peak_slip_rate` and `slowest_slip_rate` are the maximum and the minimum of the slip rate."
    ),
    **{
        f"A peak is a maximum of slip rate over time; the first {count} are told.": (
            "A peak is a local maximum of the slip rate as a function of time. The answer contains "
            f"the first {count} peaks."
        )
        for count in ("two", "five", "sixteen")
    },
}


def problem_section(number: int, problem: dict[str, Any]) -> str:
    """Return the section of a problem."""
    lines = [
        f"### {number}. {problem['title']}",
        "",
        *(f"    {line}" for line in problem["equations"].splitlines()),
        "",
        describe_conventions(problem["conventions"]),
        "",
        *_table(problem["parameters"]),
        "",
        f"- {_initial_state(problem.get('initial'))}",
    ]
    if "loading" in problem:
        segments = ", and then ".join(map(_segment, problem["loading"]))
        lines.append(f"- The load point velocity V_0 is {segments}.")
    return "\n".join([*lines, f"- Report {_report(problem)}.", ""])


def describe_conventions(conventions: str) -> str:
    """Return the conventions of a problem file in the wording of the page."""
    text = " ".join(conventions.split())
    for in_file, on_page in PAGE_WORDING.items():
        text = text.replace(in_file, on_page)
    return text


def _table(parameters: dict[str, Any]) -> list[str]:
    """Return the lines of a table with one column per parameter."""
    cells = [[f"`{name}`" for name in parameters], ["---"] * len(parameters)]
    cells.append([str(value) for value in parameters.values()])
    return [f"| {' | '.join(row)} |" for row in cells]


def _initial_state(initial: dict[str, Any] | None) -> str:
    if not initial:
        return "The initial state is steady sliding at V_*."
    values = []
    for name, value in initial.items():
        several = isinstance(value, list)
        names = [f"{name}_{n + 1}" for n in range(len(value))] if several else [name]
        pairs = zip(names, value if several else [value], strict=True)
        values += [f"{one}(0) = {initially}" for one, initially in pairs]
    return f"The initial values are {_enumerate(values)}."


def _segment(segment: dict[str, str]) -> str:
    text = segment["velocity"]
    if "normal_stress" in segment:
        text += f" with a normal stress of {segment['normal_stress']}"
    return text + (f" for {segment['duration']}" if "duration" in segment else "")


def _enumerate(items: list[str]) -> str:
    *first, last = items
    return f"{', '.join(first)} and {last}" if first else last


def _report(problem: dict[str, Any]) -> str:
    names = _enumerate([f"`{name}`" for name in problem["quantities"]])
    if problem["report"] == "series":
        times = problem["times"]
        return f"{names} at {len(times)} times from {times[0]:g} s to {times[-1]:g} s"
    if problem["report"] == "peaks":
        return f"{names} of the first {problem['count']} maxima of the slip rate"
    return names


def all_sections() -> str:
    """Return the sections of all problems."""
    files = sorted(PROBLEMS.glob("*.toml"))
    return "\n".join(
        problem_section(int(file.name[:2]), read_stated_problem(file)) for file in files
    )


if __name__ == "__main__":
    before = PAGE.read_text().partition(PROBLEMS_MARKER)[0]
    PAGE.write_text(before + PROBLEMS_MARKER + "\n" + all_sections())
