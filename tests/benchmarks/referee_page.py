"""Generator of the problem descriptions on the referee page.

Run ``python tests/benchmarks/referee_page.py`` to update the page.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from second_referee_way import PROBLEMS, read_stated_problem

PAGE = Path(__file__).parents[2] / "studies" / "pages" / "reference" / "referee.md"
PROBLEMS_MARKER = "<!-- problems: written by tests/benchmarks/referee_page.py -->\n"
_LOG = r"a \ln\frac{V}{V_*}"
_MU = r"\mu = \frac{\tau}{\sigma} &= "
_RATIO = r"\frac{\theta V}{D_c}"
_SLIP_LAW = rf"-{_RATIO} \ln{_RATIO}"
_STRESS = r"\frac{\alpha}{b} \frac{\theta}{\sigma} \frac{d\sigma}{dt}"
_TAU_RATE = r"\frac{d\tau}{dt} &= k (V_0 - V)"
#: LaTeX form of the equations of the problem files.
PAGE_EQUATIONS = {
    "mu = tau/sigma = mu_* + a ln(V/V_*) + b ln(theta V_*/D_c)": (
        rf"{_MU}\mu_* + {_LOG} + b \ln\frac{{\theta V_*}}{{D_c}}"
    ),
    "mu = tau/sigma = mu_* + a ln(V/V_*) + b ln(theta V_*/(2 D_c))": (
        rf"{_MU}\mu_* + {_LOG} + b \ln\frac{{\theta V_*}}{{2 D_c}}"
    ),
    "mu = tau/sigma = mu_* + a ln(V/V_*) + b ln(theta_1 V_*/D_c) + b_2 ln(theta_2 V_*/D_c_2)": (
        rf"{_MU}\mu_* + {_LOG} + b \ln\frac{{\theta_1 V_*}}{{D_c}}"
        r" + b_2 \ln\frac{\theta_2 V_*}{D_{c,2}}"
    ),
    "mu = tau/sigma = mu_* + a ln(V/V_*) + b ln(theta/theta_*)": (
        rf"{_MU}\mu_* + {_LOG} + b \ln\frac{{\theta}}{{\theta_*}}"
    ),
    "mu = tau/sigma = a arcsinh{V/(2 V_*) exp[(mu_* + b ln(theta V_*/D_c))/a]}": (
        rf"{_MU}a \, \mathrm{{arcsinh}}\left\{{\frac{{V}}{{2 V_*}}"
        r" \exp\left[\frac{\mu_* + b \ln(\theta V_*/D_c)}{a}\right]\right\}"
    ),
    "mu = mu_* + a ln(V/V_*) + b ln(theta V_*/D_c)": (
        rf"\mu &= \mu_* + {_LOG} + b \ln\frac{{\theta V_*}}{{D_c}}"
    ),
    "mu = tau/(sigma - p) = mu_* + a ln(V/V_*) + b ln(theta V_*/D_c)": (
        rf"\mu = \frac{{\tau}}{{\sigma - p}} &= \mu_* + {_LOG} + b \ln\frac{{\theta V_*}}{{D_c}}"
    ),
    "dtau/dt = k (V_0 - V)": _TAU_RATE,
    "tau = sigma mu + eta V,   dtau/dt = k (V_0 - V)": (
        rf"\tau &= \sigma \mu + \eta V, \qquad {_TAU_RATE.replace('&', '')}"
    ),
    "m dV/dt = tau - sigma mu,   dtau/dt = k (V_0 - V),   m = k (T/2 pi)^2,   T = period": (
        rf"m \frac{{dV}}{{dt}} &= \tau - \sigma \mu, \qquad {_TAU_RATE.replace('&', '')}, \qquad"
        r" m = k \left(\frac{T}{2 \pi}\right)^2"
    ),
    "d(slip)/dt = V": r"\frac{d\delta}{dt} &= V",
    "dtheta/dt = 1 - theta V/D_c": rf"\frac{{d\theta}}{{dt}} &= 1 - {_RATIO}",
    "dtheta/dt = -(theta V/D_c) ln(theta V/D_c)": rf"\frac{{d\theta}}{{dt}} &= {_SLIP_LAW}",
    "dtheta/dt = 1 - [theta V/(2 D_c)]^2": (
        r"\frac{d\theta}{dt} &= 1 - \left(\frac{\theta V}{2 D_c}\right)^2"
    ),
    "dtheta_1/dt = 1 - theta_1 V/D_c": (r"\frac{d\theta_1}{dt} &= 1 - \frac{\theta_1 V}{D_c}"),
    "dtheta_2/dt = 1 - theta_2 V/D_c_2": (
        r"\frac{d\theta_2}{dt} &= 1 - \frac{\theta_2 V}{D_{c,2}}"
    ),
    "dtheta_1/dt = -(theta_1 V/D_c) ln(theta_1 V/D_c)": (
        r"\frac{d\theta_1}{dt} &= -\frac{\theta_1 V}{D_c} \ln\frac{\theta_1 V}{D_c}"
    ),
    "dtheta_2/dt = -(theta_2 V/D_c_2) ln(theta_2 V/D_c_2)": (
        r"\frac{d\theta_2}{dt} &= -\frac{\theta_2 V}{D_{c,2}} \ln\frac{\theta_2 V}{D_{c,2}}"
    ),
    "dtheta/dt = (theta V/D_c) [(theta V/D_c)^(-e) - 1]/e,   e = law_exponent": (
        rf"\frac{{d\theta}}{{dt}} &= {_RATIO} \,"
        rf" \frac{{1}}{{e}} \left[\left({_RATIO}\right)^{{-e}} - 1\right]"
    ),
    "dtheta/dt = exp(-V/V_c) - (theta V/D_c) ln(theta V/D_c)": (
        rf"\frac{{d\theta}}{{dt}} &= e^{{-V/V_c}} {_SLIP_LAW}"
    ),
    "dtheta/dt = 1 - theta V/D_c - (c/b) (theta/sigma) dtau/dt,   c = stress_dependence": (
        rf"\frac{{d\theta}}{{dt}} &= 1 - {_RATIO}"
        r" - \frac{c}{b} \frac{\theta}{\sigma} \frac{d\tau}{dt}"
    ),
    "dtheta/dt = 1 - theta V/D_c - (alpha/b) (theta/sigma) dsigma/dt": (
        rf"\frac{{d\theta}}{{dt}} &= 1 - {_RATIO} - {_STRESS}"
    ),
    "dtheta/dt = -(theta V/D_c) ln(theta V/D_c) - (alpha/b) (theta/sigma) dsigma/dt": (
        rf"\frac{{d\theta}}{{dt}} &= {_SLIP_LAW} - {_STRESS}"
    ),
    "sigma = sigma_* [1 + A sin(2 pi t/T)],   A = oscillation_amplitude/sigma_*,"
    "   T = oscillation_period,   sigma_* = normal_stress": (
        r"\sigma &= \sigma_* + A \sin\frac{2 \pi t}{T}"
    ),
    "sigma = sigma_* + (tau - mu_* sigma_*) cot(phi),   sigma_* = normal_stress, phi in degrees": (
        r"\sigma &= \sigma_* + (\tau - \mu_* \sigma_*) \cot\phi"
    ),
    "dphi/dt = -(V/D_c) [phi - E ln(V/V_*)],   E = dilatancy": (
        r"\frac{d\varphi}{dt} &= -\frac{V}{D_c} \left(\varphi - E \ln\frac{V}{V_*}\right)"
    ),
    "dp/dt = -C p - dphi/dt,   C = drainage": (r"\frac{dp}{dt} &= -C p - \frac{d\varphi}{dt}"),
}
#: Sentences on the page about the symbols that a line of the problem files defines.
PAGE_SYMBOLS = {
    "e = law_exponent": "The parameter `law_exponent` is $e$.",
    "c = stress_dependence": "The parameter `stress_dependence` is $c$.",
    "T = period": "The parameter `period` is $T$.",
    "A = oscillation_amplitude": (
        "The parameter `oscillation_amplitude` is $A$, the parameter `oscillation_period` is $T$, "
        "and the parameter `normal_stress` is $\\sigma_*$."
    ),
    "phi in degrees": (
        "The parameter `normal_stress` is $\\sigma_*$, and the angle $\\phi$ is in degrees."
    ),
    "E = dilatancy": "The parameter `dilatancy` is $E$.",
    "C = drainage": "The parameter `drainage` is $C$.",
}
#: Wording of the conventions on the page, by their wording in the problem files. Problem files
#: never change, so the page rephrases their sentences.
PAGE_WORDING = {
    "Friction is spring stress over normal stress.": (
        "The quantity `friction` is the spring stress divided by the normal stress."
    ),
    "Friction is that of the fault, mu, and not tau/sigma of the spring.": (
        r"The quantity `friction` is the friction coefficient $\mu$ of the fault, and not the "
        r"ratio $\tau/\sigma$ of the spring."
    ),
    "Friction is mu, and not tau/sigma of the spring.": (
        r"The quantity `friction` is the friction coefficient $\mu$, and not the ratio "
        r"$\tau/\sigma$ of the spring."
    ),
    "Friction is shear stress over effective normal stress.": (
        "The quantity `friction` is the shear stress divided by the effective normal stress."
    ),
    "theta is in s.": r"The unit of the state variable $\theta$ is the second.",
    "theta_1 and theta_2 are in s.": (
        r"The unit of the state variables $\theta_1$ and $\theta_2$ is the second."
    ),
    "theta is in s; no mass, no damping.": (
        r"The unit of the state variable $\theta$ is the second. The motion is quasi-static, "
        "without inertia and radiation damping."
    ),
    "The motion is quasi-static: no mass, no damping.": (
        "The motion is quasi-static, without inertia and radiation damping."
    ),
    "There is no mass.": "The slider has no inertia.",
    "There is no damping.": "There is no radiation damping.",
    "It slides steadily at V_* before the first velocity of the load point.": (
        "The slider slides steadily at $V_*$ before $t = 0$."
    ),
    "In steady sliding it is 2 D_c/V, and the logarithm has 2 D_c too: without that friction "
    "would be higher by b ln 2.": (
        r"In steady sliding, $\theta = 2 D_c/V$. The logarithm in the friction coefficient also "
        r"contains $2 D_c$. With $D_c$ instead, the friction coefficient would be higher by "
        r"$b \ln 2$."
    ),
    "The load point is held from 10 s to 1010 s.": (
        "The load point does not move between 10 s and 1010 s."
    ),
    "The second state strengthens.": (
        "The second state variable has a velocity-strengthening effect, because $b_2$ is negative."
    ),
    "e = 1 is the slowness law, e to 0 the slip law.": (
        "For $e = 1$, the law is the slowness law. As $e$ approaches 0, the law approaches the "
        "slip law."
    ),
    "theta_* is that of steady sliding at V_*, where mu is mu_*: theta_* = (D_c/V_*) exp(u) with "
    "u exp(u) = exp(-V_*/V_c), and not D_c/V_*.": (
        r"In steady sliding at $V_*$, $\theta = \theta_*$ and $\mu = \mu_*$. The value of "
        r"$\theta_*$ is $(D_c/V_*) e^u$ with $u e^u = e^{-V_*/V_c}$, and not $D_c/V_*$."
    ),
    "Friction at V_* and theta = D_c/V_*, with which it begins, is a arcsinh[exp(mu_*/a)/2] and "
    "not mu_*: here the logarithm and arcsinh differ in the third digit.": (
        r"The motion starts with $V = V_*$ and $\theta = D_c/V_*$. The initial friction "
        r"coefficient is $a \, \mathrm{arcsinh}(e^{\mu_*/a}/2)$, and not $\mu_*$. In this problem, "
        "the results of the logarithm and of arcsinh differ in the third digit."
    ),
    "eta = G/(2 c_s) is radiation_damping: codes that take G/c_s have twice as much.": (
        r"The parameter `radiation_damping` is $\eta = G/(2 c_s)$. The damping is twice as large "
        "in codes that use $G/c_s$."
    ),
    "eta = G/(2 c_s) is radiation_damping.": (
        r"The parameter `radiation_damping` is $\eta = G/(2 c_s)$."
    ),
    "eta = G/(2 c_s) is radiation_damping, and V_0 load_velocity.": (
        r"The parameter `radiation_damping` is $\eta = G/(2 c_s)$, and the parameter "
        "`load_velocity` is $V_0$."
    ),
    "It begins with the slip rate and theta stated, and not in steady sliding; tau follows from "
    "them.": (
        r"The motion starts with the given slip rate and $\theta$, and not in steady sliding. The "
        r"initial value of $\tau$ follows from the slip rate and $\theta$."
    ),
    "It begins with the slip rate and thetas stated.": (
        r"The motion starts with the given slip rate and the given values of $\theta_1$ and "
        r"$\theta_2$."
    ),
    "It slides steadily at V_* until the load point steps to its velocity at t = 0; slip rate "
    "does not jump then.": (
        "The slider slides steadily at $V_*$ until the load point velocity changes suddenly at "
        "$t = 0$. The slip rate is continuous at $t = 0$."
    ),
    "Normal stress rises suddenly at 10 s, and theta falls with it by the factor "
    "(sigma_before/sigma_after)^(alpha/b); tau does not change then.": (
        r"The normal stress increases suddenly at 10 s from $\sigma_1$ to $\sigma_2$. At the same "
        r"time, $\theta$ is multiplied by $(\sigma_1/\sigma_2)^{\alpha/b}$, and $\tau$ does not "
        "change."
    ),
    "It slides steadily at V_* before t = 0, and the load point goes on so.": (
        "The slider slides steadily at $V_*$ before $t = 0$. The load point continues to move at "
        "$V_*$ after $t = 0$."
    ),
    "p is pore pressure above that of the surroundings, and phi porosity above that of steady "
    "sliding at V_* over compressibility, in Pa.": (
        "The variable $p$ is the difference between the pore pressure and the pressure of the "
        r"surroundings. The variable $\varphi$ is the change of porosity relative to steady "
        "sliding at $V_*$, divided by the compressibility. Its unit is Pa."
    ),
    "The stiffness below which steady sliding at V_* is unstable.": (
        "The quantity `critical_stiffness` is the stiffness below which steady sliding at $V_*$ is "
        "unstable."
    ),
    "Small departures from steady sliding at V_* grow as exp(p t): growth_rate is the real, "
    "angular_frequency the imaginary part of p.": (
        "Small perturbations of steady sliding at $V_*$ grow as $e^{p t}$. The quantity "
        "`growth_rate` is the real part of $p$, and `angular_frequency` is the imaginary part."
    ),
    "critical_stiffness is the one at which they neither grow nor decay.": (
        "The quantity `critical_stiffness` is the stiffness at which small perturbations neither "
        "grow nor decay."
    ),
    "It slides steadily at V_* until the load point steps to V_0.": (
        "The slider slides steadily at $V_*$ until the load point velocity changes suddenly to "
        "$V_0$."
    ),
    "critical_velocity is the smallest V_0 for which slip rate reaches V_unstable.": (
        "The quantity `critical_velocity` is the smallest $V_0$ for which the slip rate reaches "
        "`V_unstable`."
    ),
    "It slides steadily at V_* until the load point moves suddenly by a displacement, and then "
    "rests (V_0 = 0).": (
        "The slider slides steadily at $V_*$ until the load point moves suddenly by a "
        "displacement. After this step, the load point does not move ($V_0 = 0$)."
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
        *format_equations(problem["equations"]),
        "",
        describe_conventions(problem["equations"], problem["conventions"]),
        "",
        *_table(problem["parameters"]),
        "",
        f"- {_initial_state(problem.get('initial'))}",
    ]
    if "loading" in problem:
        segments = ", and then ".join(map(_segment, problem["loading"]))
        lines.append(f"- The load point velocity $V_0$ is {segments}.")
    return "\n".join([*lines, f"- Report {_report(problem)}.", ""])


def format_equations(equations: str) -> list[str]:
    """Return the lines of a displayed formula with the equations of a problem."""
    lines = [PAGE_EQUATIONS[line] for line in equations.strip().splitlines()]
    rows = [rf"{line} \\" for line in lines[:-1]] + lines[-1:]
    return ["$$", r"\begin{aligned}", *rows, r"\end{aligned}", "$$"]


def describe_conventions(equations: str, conventions: str) -> str:
    """Return the symbols and conventions of a problem file in the wording of the page."""
    text = " ".join(conventions.split())
    for in_file, on_page in PAGE_WORDING.items():
        text = text.replace(in_file, on_page)
    symbols = [sentence for name, sentence in PAGE_SYMBOLS.items() if f" {name}" in equations]
    return " ".join([*symbols, text])


def _table(parameters: dict[str, Any]) -> list[str]:
    """Return the lines of a table with one column per parameter."""
    cells = [[f"`{name}`" for name in parameters], ["---"] * len(parameters)]
    cells.append([str(value) for value in parameters.values()])
    return [f"| {' | '.join(row)} |" for row in cells]


def _initial_state(initial: dict[str, Any] | None) -> str:
    if not initial:
        return "The initial state is steady sliding at $V_*$."
    values = []
    for name, value in initial.items():
        several = isinstance(value, list)
        names = [f"{name}_{n + 1}" for n in range(len(value))] if several else [name]
        pairs = zip(names, value if several else [value], strict=True)
        values += [f"`{variable}` = {initial_value}" for variable, initial_value in pairs]
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
