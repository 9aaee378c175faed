"""Motions as functions of JAX and of PyTorch, with exact derivatives in both modes. These are
imported when such a function is first called."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from saltus.checks import Numbers, check_names, check_number, instants
from saltus.errors import ParameterError, shown
from saltus.flow.lanes.ensemble import simulate_many
from saltus.flow.motion.events import Stop
from saltus.flow.motion.motion import Motion, state_names
from saltus.flow.motion.sensitivities import sensitivities
from saltus.flow.motion.simulate import MotionRequest, simulate
from saltus.systems import System, check_path, check_system

NO_SECOND = "the states of a motion have first derivatives, and no second ones"


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
    """The state at the end of a motion, or its states at given times, as a function of JAX of
    parameters and of the start.

    The function takes numbers of the system by their dotted paths and the state at the start,
    coordinates and then velocities,

        x = function({"model.damping": 0.1, "impact.e": 0.9}, [0.3, 0.0]),

    and gives the state at the end, (2 n,), or those at m `times`, (m, 2 n). Its derivatives are
    those of `sensitivities`, through all impacts: dx = (dx/dx_0) dx_0 + (dx/dc) dc, and the
    transpose of this. It may stand in `jax.jit`, `grad`, `jvp`, `jacfwd` and `jacrev`. In `vmap`
    the motions are followed together by `simulate_many`, but one after the other for states at
    `times`, and for derivatives of systems whose contacts keep sums of coordinates. Second
    derivatives are refused. Where a motion has no derivative, it is nan.

    JAX must compute with 64 bits, `jax.config.update("jax_enable_x64", True)`. A motion that is
    refused, or that ends before one of the `times`, raises JAX's `JaxRuntimeError` with the
    sentence of ours in its text.

    Parameters
    ----------
    system
        What moves; numbers that the function is not given are those of this system.
    periods, duration
        The length of the motion, for its state at the end; after a number of `periods` the end
        moves with the load's frequency.
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
        An argument has no meaning. The function raises it where JAX is not installed or computes
        with 32 bits, where a path leads to no number, and where the start is of another shape.

    Examples
    --------
    >>> end = saltus.to_jax(system, periods=2)
    >>> gradient = jax.grad(lambda values: end(values, [0.3, 0.0])[0])({"model.damping": 0.1})  # doctest: +SKIP
    """
    request = {"periods": periods, "duration": duration, "tol": tol, "time": time, "side": side}
    return _StatesFunction.of("to_jax", system, times, request, stop_at).in_jax


def to_torch(
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
    """The state at the end of a motion, or its states at given times, as a function of PyTorch of
    parameters and of the start.

    The function takes numbers of the system by their dotted paths and the state at the start,
    coordinates and then velocities,

        x = function({"model.damping": damping, "impact.e": 0.9}, torch.tensor([0.3, 0.0])),

    and gives the state at the end, (2 n,), or those at m `times`, (m, 2 n), in 64 bits and in the
    processor's memory. Numbers and start may have axes of many motions before their own, which are
    broadcast; these are followed together by `simulate_many`, as in `torch.vmap`, but one after the
    other for states at `times`, and for derivatives of systems whose contacts keep sums of
    coordinates.

    Its derivatives are those of `sensitivities`, through all impacts, in both modes of PyTorch; for
    them the motion is followed once more. Second derivatives are refused. Where a motion has no
    derivative, it is nan.

    Parameters
    ----------
    system
        What moves; numbers that the function is not given are those of this system.
    periods, duration
        The length of the motion, for its state at the end; after a number of `periods` the end
        moves with the load's frequency.
    times
        In place of a length, the dimensionless times of the states; these are fixed.
    tol, time, side, stop_at
        As for `simulate`.

    Returns
    -------
    Callable[[Mapping[str, Any], Any], Any]
        The function, which needs PyTorch.

    Raises
    ------
    ParameterError
        An argument has no meaning. PyTorch is not installed, a path leads to no number, the start
        is of another shape, or a motion is refused or ends before one of the `times`.

    Examples
    --------
    >>> end = saltus.to_torch(system, periods=2)
    >>> damping = torch.tensor(0.1, requires_grad=True)  # doctest: +SKIP
    >>> end({"model.damping": damping}, torch.tensor([0.3, 0.0]))[0].backward()  # doctest: +SKIP
    """
    request = {"periods": periods, "duration": duration, "tol": tol, "time": time, "side": side}
    return _StatesFunction.of("to_torch", system, times, request, stop_at).in_torch


@dataclass(frozen=True, eq=False)
class _StatesFunction:
    """What is asked of a motion: all but the numbers of which it is a function."""

    system: System
    times: Any
    request: dict[str, Any]

    @classmethod
    def of(
        cls, name: str, system: System, times: Any, request: dict[str, Any], stop_at: Any
    ) -> _StatesFunction:
        """The arguments of the public function of this name, checked."""
        check_system(system, name, several_contacts=True)
        check_number("time", time := request["time"])
        if times is not None:
            if request["periods"] is not None or request["duration"] is not None:
                raise ParameterError(
                    "times give the length of the motion; leave out periods and duration",
                    "times",
                )
            asked = instants(times)
            if not np.isfinite(asked).all() or not (asked >= time).all():
                raise ParameterError(
                    f"times must be finite and not before the start, {time:g}", "times"
                )
            request["duration"] = float(np.max(asked, initial=time)) - time
        request["stop_at"] = check_names("stop_at", stop_at, "margins")
        somewhere = dict.fromkeys(system.model.coordinates, 0.0)
        MotionRequest(
            system=system, coordinates=somewhere, velocity=0.0, dense=times is not None, **request
        )
        return cls(system, times, request)

    @property
    def many(self) -> tuple[int, ...]:
        """The shape of the times of the states."""
        return () if self.times is None else np.shape(self.times)

    def _paths(self, values: Any) -> tuple[str, ...]:
        """The paths of the values, in a fixed order, checked."""
        if not isinstance(values, Mapping):
            raise ParameterError(
                "values must be numbers by dotted paths, {'model.damping': 0.1}, got "
                f"{shown(values)}",
                "values",
            )
        for path in values:
            check_path(self.system, path, "values")
        return tuple(sorted(values))

    def _check_start(self, shape: tuple[int, ...]) -> None:
        """Refuse a start of another shape, that of one motion."""
        if shape != (size := 2 * len(self.system.model.coordinates),):
            raise ParameterError(
                f"start must be {size} numbers, coordinates and then velocities, got {shape}",
                "start",
            )

    # --- in JAX --------------------------------------------------------------

    def in_jax(self, values: Mapping[str, Any], start: Any) -> Any:
        """The states of the motion from `start`, (2 n,), of the system with `values` by their
        dotted paths.
        """
        jnp = _jax().numpy
        if jnp.result_type(float) != np.float64:
            raise ParameterError(
                'JAX computes with 32 bits here; first call jax.config.update("jax_enable_x64", '
                "True)"
            )
        paths = self._paths(values)
        state = jnp.asarray(start, dtype=float)
        self._check_start(state.shape)
        return self._of_jax(paths, jnp.array([values[path] for path in paths], dtype=float), state)

    @cached_property
    def _of_jax(self) -> Any:
        """The states as a function of paths, numbers and start, with its rule for derivatives,
        which JAX transposes.
        """
        jax: Any = _jax()

        def outside(function: Any, shapes: Any) -> Callable[..., Any]:
            """A function of this class as JAX calls it, with the shapes of what it gives."""

            def call(paths: tuple[str, ...], numbers: Any, start: Any) -> Any:
                given = jax.tree.map(
                    lambda shape: jax.ShapeDtypeStruct(shape, float),
                    shapes(numbers, start),
                    is_leaf=_is_shape,
                )
                return jax.pure_callback(
                    lambda *x: function(paths, *map(np.asarray, x)),
                    given,
                    numbers,
                    start,
                    vmap_method="broadcast_all",
                )

            return call

        def rule(paths: tuple[str, ...], given: Any, moved: Any) -> tuple[Any, Any]:
            states, columns = with_columns(paths, *given)
            parts = (columns[..., given[1].size :], columns[..., : given[1].size])
            moves = [
                part @ by
                for part, by in zip(parts, moved, strict=True)
                if not isinstance(by, Unmoved)
            ]
            return states, sum(moves, jax.numpy.zeros_like(states))

        def refuse(*_: Any) -> None:
            raise ParameterError(NO_SECOND)

        many = self.many
        Unmoved = jax.custom_derivatives.SymbolicZero
        plain = jax.custom_jvp(
            outside(self._states, lambda _, x: (*many, x.size)), nondiff_argnums=(0,)
        )
        both = outside(
            self._with_columns, lambda c, x: ((*many, x.size), (*many, x.size, x.size + c.size))
        )
        with_columns = jax.custom_jvp(both, nondiff_argnums=(0,))
        plain.defjvp(rule, symbolic_zeros=True)  # columns that are nan do not spoil the others
        with_columns.defjvp(refuse)
        return plain

    # --- in PyTorch ----------------------------------------------------------

    def in_torch(self, values: Mapping[str, Any], start: Any) -> Any:
        """The states of the motions from `start`, (..., 2 n), of the system with `values`, (...),
        by their dotted paths.
        """
        torch = _torch()
        paths = self._paths(values)
        state = torch.as_tensor(start, dtype=torch.float64, device="cpu")
        self._check_start(tuple(state.shape[-1:]))
        given = [torch.as_tensor(values[path], dtype=torch.float64, device="cpu") for path in paths]
        many = torch.broadcast_shapes(state.shape[:-1], *(number.shape for number in given))
        numbers = (
            torch.stack([number.expand(many) for number in given], -1)
            if given
            else torch.zeros((*many, 0)).double()
        )
        return self._of_torch.apply(paths, numbers, state.expand(*many, -1))

    @cached_property
    def _of_torch(self) -> Any:
        """The states as a function of paths, numbers and start, with its derivatives in both
        modes.
        """
        torch = _torch()
        whole = self

        def outside(function: Any, paths: tuple[str, ...], *given: Any) -> Any:
            return torch.from_numpy(np.array(function(paths, *(x.detach().numpy() for x in given))))

        def product(ctx: Any) -> Any:
            """The derivatives of all states, as the rows of a matrix for each motion: to the start,
            then to the numbers.
            """
            found = Columns.apply(ctx.paths, *ctx.saved_tensors)
            return found.reshape(*ctx.saved_tensors[1].shape[:-1], -1, found.shape[-1])

        class Function(torch.autograd.Function):  # type: ignore[misc, name-defined]
            @classmethod
            def vmap(cls, info: Any, in_dims: Any, paths: Any, *given: Any) -> Any:
                placed = zip(given, in_dims[1:], strict=True)
                given = tuple(
                    x.expand(info.batch_size, *x.shape) if d is None else x.movedim(d, 0)
                    for x, d in placed
                )
                return cls.apply(paths, *given), 0

        class Columns(Function):
            @staticmethod
            def forward(*given: Any) -> Any:
                return outside(lambda *all_of: whole._with_columns(*all_of)[1], *given)

            @staticmethod
            def setup_context(ctx: Any, *_: Any) -> None:
                pass

            @staticmethod
            def backward(ctx: Any, *_: Any) -> Any:
                raise ParameterError(NO_SECOND)

            jvp = backward

        class States(Function):
            @staticmethod
            def forward(*given: Any) -> Any:
                return outside(whole._states, *given)

            @staticmethod
            def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
                ctx.paths, *given = inputs
                ctx.set_materialize_grads(False)  # columns that are nan do not spoil the others
                ctx.save_for_backward(*given)
                ctx.save_for_forward(*given)

            @staticmethod
            def backward(ctx: Any, across: Any) -> Any:
                size = ctx.saved_tensors[1].shape[-1]
                row = (
                    across.reshape(*ctx.saved_tensors[1].shape[:-1], 1, -1) @ product(ctx)
                ).squeeze(-2)
                return None, row[..., size:], row[..., :size]

            @staticmethod
            def jvp(ctx: Any, _: Any, *moved: Any) -> Any:
                columns = product(ctx)
                size = ctx.saved_tensors[1].shape[-1]
                parts = zip((columns[..., size:], columns[..., :size]), moved, strict=True)
                moves = [
                    (part @ by.unsqueeze(-1)).squeeze(-1) for part, by in parts if by is not None
                ]
                return sum(moves).reshape(*ctx.saved_tensors[1].shape[:-1], *whole.many, size)

        return States

    # --- outside of both -----------------------------------------------------

    def _states(self, *given: Any) -> np.ndarray:
        """The states, for paths, numbers and start; of many motions, if these have axes before
        their own.
        """
        return self._found(False, *given)[0]

    def _with_columns(self, *given: Any) -> tuple[np.ndarray, ...]:
        """The states with their derivatives to the start and to the numbers."""
        return self._found(True, *given)

    def _found(
        self, columns: bool, paths: tuple[str, ...], numbers: np.ndarray, start: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        if not (many := start.shape[:-1]):
            return self._of_one(columns, paths, numbers, start)
        numbers, start = (x.reshape(math.prod(many), x.shape[-1]) for x in (numbers, start))
        # lanes have no derivatives of such motions to parameters
        sums = self.system.in_gap_coordinates is not self.system
        if self.times is None and not (columns and sums):
            found = self._in_lanes(columns, paths, numbers, start)
        else:
            each = [self._of_one(columns, paths, *row) for row in zip(numbers, start, strict=True)]
            found = tuple(map(np.array, zip(*each, strict=True)))
        return tuple(part.reshape(*many, *part.shape[1:]) for part in found)

    def _of_one(
        self, columns: bool, paths: tuple[str, ...], numbers: np.ndarray, start: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        asked = self._arguments(start) | {"dense": self.times is not None}
        asked["system"] = self.system.with_(dict(zip(paths, numbers.tolist(), strict=True)))
        if not columns:
            return (self._read(simulate(**asked)),)
        found = sensitivities(parameters=paths, **asked)
        by = (
            np.hstack([found.state, found.parameters])
            if self.times is None
            else found.at(self.times)
        )
        return self._read(found.motion), by

    def _in_lanes(
        self, columns: bool, paths: tuple[str, ...], numbers: np.ndarray, start: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The ends of many motions; one that cannot go on is followed alone, which says why."""
        more: dict[str, Any] = {
            "parameters": dict(zip(paths, numbers.T, strict=True)),
            "sensitivities": paths if columns else None,
        }
        found = simulate_many(self.system, sample=(), **self._arguments(start.T), **more)
        stops = [str(found.stop.attrs["flag_meanings"]).split()[i] for i in found.stop.values]
        for i, stop in enumerate(stops):
            if stop not in (Stop.HORIZON, Stop.REST, Stop.LIMIT, Stop.SINGULAR):
                self._of_one(False, paths, numbers[i], start[i])
        states = np.column_stack(
            [found[name].values for name in state_names(self.system.model.coordinates)]
        )
        return (states, found.derivative.values) if columns else (states,)

    def _arguments(self, start: np.ndarray) -> dict[str, Any]:
        """What is asked of a motion from a start, (2 n,), or of many, (2 n, m)."""
        model = self.system.model
        halves = np.split(start, 2)
        position, velocity = (half.tolist() if half.ndim == 1 else [*half] for half in halves)
        moving = velocity[: len(model.moving)]
        given = {"velocity": moving[0] if len(moving) == 1 else tuple(moving)}
        return self.request | dict(zip(model.coordinates, position, strict=True)) | given

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
        raise ParameterError('to_jax needs JAX: pip install ".[jax]"') from None
    return jax


def _torch() -> Any:
    try:
        import torch
    except ImportError:
        raise ParameterError('to_torch needs PyTorch: pip install ".[torch]"') from None
    return torch
