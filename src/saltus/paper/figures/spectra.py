"""What Figs. 9 to 13 share: the systems under loads (i) to (iii), and a panel: a study with the angles that its picture needs."""

from __future__ import annotations

import math
from typing import Any

from saltus.paper.figures import motions

WINDOW = (
    (-4.0, 4.0),
    (-4.0, 4.0),
)  # of the states from which motions are searched: large ones attract little of what starts nearer to rest
BETA0, DAMPING, VERTICAL = 80.0, 0.1, -0.5  # degrees, C, Vbar
FREQUENCY, AMPLITUDE = "load.frequency", "load.horizontal.amplitude"


def under_force(frequency: float = 1.0, amplitude: float = 1.0) -> Any:
    """The paper's system under load (i), `loadpatha`."""
    from saltus.systems import Harmonic, Load

    return _system(Load(frequency=frequency, horizontal=Harmonic(amplitude=amplitude), vertical=VERTICAL))


def on_ground(frequency: float = 1.0, amplitude: float = 1.0) -> Any:
    """The paper's system under load (ii), `loadpathaa`."""
    from saltus.systems import Harmonic, Load

    return _system(Load(frequency=frequency, ground_horizontal=Harmonic(amplitude=amplitude), vertical=VERTICAL))


def under_both(frequency: float = 1.0, amplitude: float = 1.0, swing: float = 0.25) -> Any:
    """The paper's system under load (iii), `loadpathb`; `swing` is Vhat."""
    from saltus.systems import Harmonic, Load

    vertical = Harmonic(mean=VERTICAL, amplitude=swing, phase=math.pi / 2)
    return _system(Load(frequency=frequency, horizontal=Harmonic(amplitude=amplitude), vertical=vertical))


def _system(load: Any) -> Any:
    from saltus.systems import Metainterface, System

    return System(model=Metainterface(beta0=math.radians(BETA0), damping=DAMPING), load=load)


def spectrum(system: Any, bounds: tuple[float, float], **options: Any) -> Any:
    """The response spectrum of a system over its frequency as a panel, in units of theta_st or theta_eq, with knots and jumps."""
    from saltus.studies import response_spectrum

    tree = panel(response_spectrum(system, FREQUENCY, bounds, **({"window": WINDOW} | options)), scale=static_scale(system))
    return with_groups(tree, {"knots": motions.knots(tree), "jumps": motions.jumps(tree)})


def diagram(system: Any, bounds: tuple[float, float], **options: Any) -> Any:
    """The bifurcation diagram of a system over the amplitude of the horizontal load as a panel, in radians."""
    from saltus.studies import bifurcation_diagram

    return panel(bifurcation_diagram(system, AMPLITUDE, bounds, **({"window": WINDOW} | options)), scale=1.0)


def static_scale(system: Any) -> float:
    """theta_st under a horizontal force, theta_eq under a ground motion, rad."""
    from saltus.theory import equivalent_angle, static_angle

    beta0 = system.model.beta0
    if "load.ground_horizontal.amplitude" in system.parameters:
        return float(equivalent_angle(beta0, system.get("load.ground_horizontal.amplitude")))
    return static_angle(beta0, system.get(AMPLITUDE), VERTICAL)


def panel(tree: Any, scale: float) -> Any:
    """A study's tree with the scale of its rotations, both limits of the mechanism and Hcr among its attributes, all in rad."""
    from saltus.theory import critical_horizontal

    beta0 = math.radians(BETA0)
    angles = {"scale": scale, "line": math.pi - beta0, "farthest": 2 * (math.pi - beta0)}
    tree.attrs = {**tree.attrs, **angles, "critical": float(critical_horizontal(beta0, VERTICAL))}
    return tree


def with_groups(tree: Any, groups: dict[str, Any]) -> Any:
    """A tree with further Datasets as its children."""
    import xarray as xr

    return tree.assign({name: xr.DataTree(data) for name, data in groups.items()})


def together(panels: dict[str, Any], what: str) -> Any:
    """The panels of a figure as one DataTree, a group each; every variable has units, every group says what it is."""
    import xarray as xr

    import saltus

    parts = {"/": xr.Dataset(attrs={"what": what, "saltus_version": saltus.__version__})}
    for name, tree in panels.items():
        for node in tree.subtree:
            data = node.to_dataset(inherit=False)
            said = {"what": node.name if node is not tree else what, "saltus_version": saltus.__version__}
            data.attrs = said | data.attrs
            for variable in data.variables.values():
                variable.attrs.setdefault("units", "1")
            parts[f"{name}/{node.relative_to(tree)}".removesuffix("/.")] = data
    return xr.DataTree.from_dict(parts)
