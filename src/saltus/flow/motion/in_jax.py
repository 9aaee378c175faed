"""Motions as functions of JAX, with exact derivatives in both modes. JAX is imported when such a function is first called."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from saltus.checks import Numbers, check_names, check_number, instants
from saltus.errors import ParameterError, shown
from saltus.flow.motion.motion import Motion
from saltus.flow.motion.sensitivities import sensitivities
from saltus.flow.motion.simulate import MotionRequest, simulate
from saltus.systems import System, check_path, check_system


def to_jax(
    system: System,
    *,
    periods: float | None = None,
    duration: float | None = None,
    times: Numbers | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    side: int | None = None,
    stop_at: Iterable[str] = (),
) -> Callable[[Mapping[str, Any], Any], Any]:
    """The state at the end of a motion, or its states at given times, as a function of JAX of parameters and of the start.

    The function takes numbers of the system by their dotted paths and the state at the start, coordinates and then velocities,

        x = function({"model.damping": 0.1, "impact.e": 0.9}, [0.3, 0.0]),

    and gives the state at the end, (2 n,), or those at m `times`, (m, 2 n). Its derivatives are those of `sensitivities`,
    through all impacts: dx = (dx/dx_0) dx_0 + (dx/dc) dc, and the transpose of this. It may stand in `jax.jit`, `grad`, `jvp`,
    `jacfwd` and `jacrev`; in `vmap` the motions are followed one after the other. Second derivatives are refused. Where a motion
    has no derivative, it is nan.

    JAX must compute with 64 bits, `jax.config.update("jax_enable_x64", True)`. A motion that is refused, or that ends before one
    of the `times`, raises JAX's `JaxRuntimeError` with the sentence of ours in its text.

    Parameters
    ----------
    system
        What moves; numbers that the function is not given are those of this system.
    periods, duration
        The length of the motion, for its state at the end; after a number of `periods` the end moves with the load's frequency.
    times
        In place of a length, the dimensionless times of the states; these are fixed.
    tol, time, side, stop_at
        As for `simulate`.

    Returns
    -------
    Callable[[Mapping[str, Any], Any], Any]
        The function, which needs JAX.

    Raises
    ------
    ParameterError
        An argument has no meaning. The function raises it where JAX is not installed or computes with 32 bits, where a path
        leads to no number, and where the start is of another shape.

    Examples
    --------
    >>> end = saltus.to_jax(system, periods=2)
    >>> gradient = jax.grad(lambda values: end(values, [0.3, 0.0])[0])({"model.damping": 0.1})  # doctest: +SKIP
    """
    check_system(system, "to_jax", several_contacts=True)
    check_number("time", time)
    if times is not None:
        if periods is not None or duration is not None:
            raise ParameterError("times say how long the motion is; give no periods or duration beside them", "times")
        asked = instants(times)
        if not np.isfinite(asked).all() or not (asked >= time).all():
            raise ParameterError(f"times must be finite and not before the start, {time:g}", "times")
        duration = float(np.max(asked, initial=time)) - time
    request: dict[str, Any] = {"periods": periods, "duration": duration, "tol": tol, "time": time, "side": side}
    request |= {"stop_at": check_names("stop_at", stop_at, "margins"), "dense": times is not None}
    somewhere = dict.fromkeys(system.model.coordinates, 0.0)
    MotionRequest(system=system, coordinates=somewhere, velocity=0.0, **request)
    return _StatesFunction(system, times, request).states


@dataclass(frozen=True, eq=False)
class _StatesFunction:
    """What is asked of a motion: all but the numbers of which it is a function."""

    system: System
    times: Any
    request: dict[str, Any]

    def states(self, values: Mapping[str, Any], start: Any) -> Any:
        """The states of the motion from `start`, (2 n,), of the system with `values` by their dotted paths."""
        jnp = _jax().numpy
        if jnp.result_type(float) != np.float64:
            raise ParameterError('JAX computes with 32 bits here; first say jax.config.update("jax_enable_x64", True)')
        if not isinstance(values, Mapping):
            raise ParameterError(
                f"values must be numbers by dotted paths, {{'model.damping': 0.1}}, got {shown(values)}", "values"
            )
        for path in values:
            check_path(self.system, path, "values")
        paths, size, state = tuple(sorted(values)), 2 * len(self.system.model.coordinates), jnp.asarray(start, dtype=float)
        if state.shape != (size,):
            raise ParameterError(f"start must be {size} numbers, coordinates and then velocities, got {state.shape}", "start")
        return self._differentiable(paths, jnp.array([values[path] for path in paths], dtype=float), state)

    @cached_property
    def _differentiable(self) -> Any:
        """The states as a function of paths, numbers and start, with its rule for derivatives, which JAX transposes."""
        jax: Any = _jax()

        def outside(function: Any, shapes: Any) -> Callable[..., Any]:
            """A function of this class as JAX calls it, with the shapes of what it gives."""

            def call(paths: tuple[str, ...], numbers: Any, start: Any) -> Any:
                given = jax.tree.map(lambda shape: jax.ShapeDtypeStruct(shape, float), shapes(numbers, start), is_leaf=_is_shape)
                return jax.pure_callback(
                    lambda *x: function(paths, *map(np.asarray, x)), given, numbers, start, vmap_method="sequential"
                )

            return call

        def rule(paths: tuple[str, ...], given: Any, moved: Any) -> tuple[Any, Any]:
            states, columns = with_columns(paths, *given)
            parts = (columns[..., given[1].size :], columns[..., : given[1].size])
            moves = [part @ by for part, by in zip(parts, moved, strict=True) if not isinstance(by, Unmoved)]
            return states, sum(moves, jax.numpy.zeros_like(states))

        def refuse(*_: Any) -> None:
            raise ParameterError("the states of a motion have first derivatives in JAX, and no second ones")

        many, Unmoved = np.shape(self.times) if self.times is not None else (), jax.custom_derivatives.SymbolicZero
        plain = jax.custom_jvp(outside(self._states, lambda _, x: (*many, x.size)), nondiff_argnums=(0,))
        both = outside(self._with_columns, lambda c, x: ((*many, x.size), (*many, x.size, x.size + c.size)))
        with_columns = jax.custom_jvp(both, nondiff_argnums=(0,))
        plain.defjvp(rule, symbolic_zeros=True)  # columns that are nan do not spoil the others
        with_columns.defjvp(refuse)
        return plain

    def _states(self, paths: tuple[str, ...], numbers: np.ndarray, start: np.ndarray) -> np.ndarray:
        return self._read(simulate(**self._arguments(paths, numbers, start)))

    def _with_columns(self, paths: tuple[str, ...], numbers: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The states with their derivatives to the start and to the numbers."""
        found = sensitivities(parameters=paths, **self._arguments(paths, numbers, start))
        columns = np.hstack([found.state, found.parameters]) if self.times is None else found.at(self.times)
        return self._read(found.motion), columns

    def _arguments(self, paths: tuple[str, ...], numbers: np.ndarray, start: np.ndarray) -> dict[str, Any]:
        position, velocity = np.split(start, 2)
        coordinates = dict(zip(self.system.model.coordinates, position.tolist(), strict=True))
        system = self.system.with_(dict(zip(paths, numbers.tolist(), strict=True)))
        return {"system": system, "velocity": tuple(velocity.tolist()), **self.request, **coordinates}

    def _read(self, motion: Motion) -> np.ndarray:
        """The state at the end, or those at the times."""
        if self.times is None:
            return motion.final_state
        states = np.concatenate(motion._states(instants(self.times))[:2]).T
        return states.reshape(*np.shape(self.times), -1)


def _is_shape(given: Any) -> bool:
    return all(isinstance(each, int) for each in given)


def _jax() -> Any:
    try:
        import jax
    except ImportError:
        raise ParameterError('to_jax needs JAX: pip install "saltus[jax]"') from None
    return jax
