"""The contract of a model with one contact, which the motion crosses or bounces from: a hybrid automaton."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems.model import Model


class OneContactModel(Model):
    """An oscillator of one coordinate whose motion crosses a contact, or is turned back by a wall. Besides what a `Model` has
    (`coordinates`, `channels`, optional parts) give it:

    1. `acceleration` on each side: it may use `side`, which is fixed along an arc, in place of a branch on the state (the sign of
       the coordinate is ambiguous at contact);
    2. `sides`, the numbers of its smooth modes: (+1, -1), the default, for a motion that crosses the contact, or (+1,) for a wall
       that turns it back. A contact that some numbers of a model take away has () then;
    3. `gap`, positive inside a mode: its first zero, reached from above, ends the mode; and `contact`, the coordinate at which
       the gaps of all sides are zero. By default they are side * theta and 0. While the system rests there the accelerations at
       contact decide when it leaves;
    4. `reset`, the next side and the velocity after an impact, given the impact law; a wall must define it. By default the motion
       passes through the contact;
    5. optionally `inelastic_factor`, for impact laws that need it.

    Rest, release, infinitely many impacts and grazing follow from the accelerations at contact.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Rocker(saltus.OneContactModel):
    ...     coordinates = ("angle",)
    ...     def acceleration(self, t, angle, velocity, side, load):
    ...         return -side * 1.0
    >>> rocker = saltus.simulate(saltus.System(model=Rocker()), angle=0.5, duration=10.0)
    >>> float(rocker.impacts.time[0])  # the fall from 0.5
    1.0
    """

    __slots__ = ()

    @property
    def sides(self) -> tuple[int, ...]:
        """The numbers of the smooth modes."""
        return (1, -1)

    def gap(self, theta: Any, side: Any) -> Any:
        """The gap, which is positive inside the mode `side` and zero at contact.

        Parameters
        ----------
        theta
            The coordinate q; a tuple where there are several.
        side
            The mode, one of `sides`.
        """
        return side * theta

    def reaches(self, coordinate: str, values: Any) -> Any:
        """Whether the coordinate can have these values: where the gap of a side is not negative.

        Parameters
        ----------
        coordinate
            Its name.
        values
            The values, an array.
        """
        return np.max([np.asarray(self.gap(values, side)) for side in self.sides] or [np.zeros(np.shape(values))], axis=0) >= 0.0

    def inward(self, side: int) -> float:
        """+1 or -1: the direction of the coordinate from the contact into a mode.

        Parameters
        ----------
        side
            The mode, one of `sides`.
        """
        into = float(self.gap(self.contact + 1.0, side)) - float(self.gap(self.contact, side))
        return 1.0 if into > 0.0 else -1.0

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> tuple[Any, Any]:
        """The side on which the motion goes on, and its velocity there, after an impact that ends the mode `side`.

        Both velocities are rates of the coordinate, positive towards larger coordinates, and not speeds of approach. Here the
        motion passes through the contact and the sign of the velocity stays; a model with a wall turns the sign itself.

        Parameters
        ----------
        t
            The dimensionless time tau.
        velocity
            The rate of the coordinate before the impact.
        side
            The mode that the impact ends.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        impact
            The impact law, whose `velocity_after` gives the velocity after the impact without a change of sign.
        """
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)

    def inelastic_factor(self, side: Any) -> Any:
        """The velocity factor of a frictionless, perfectly inelastic impact that ends the mode `side`.

        Parameters
        ----------
        side
            The mode that the impact ends.
        """
        raise ParameterError(
            f"{type(self).__name__} defines no inelastic_factor, so InelasticImpact() cannot be used with it", "impact"
        )


def check_one_contact(model: OneContactModel | type[OneContactModel]) -> None:
    """Refuse sides that no contact has, several coordinates, and a wall without a reset that turns the motion round.

    A class whose sides depend on its numbers is not refused, as its sides are not known yet.
    """
    name, sides = getattr(model, "__name__", type(model).__name__), model.sides
    if isinstance(sides, property):
        return
    if sides not in ((1, -1), (1,), ()):
        raise ParameterError(
            f"{name}.sides must be (1, -1) for a motion that passes the contact, (1,) for a wall or () for none, got {sides!r}",
            "model",
        )
    if sides and len(model.coordinates) != 1:
        raise ParameterError(
            f"{name} has one contact and the coordinates {', '.join(model.coordinates)}, which must be one; a model of several "
            "coordinates is a saltus.Model if it has no contact, or a saltus.ContactModel",
            "model",
        )
    if sides == (1,) and getattr(model.reset, "__func__", model.reset) is OneContactModel.reset:
        raise ParameterError(
            f"{name} has one side, so an impact must turn the motion round: define reset(self, t, velocity, side, load, impact), "
            "such as return side, -impact.velocity_after(self, t, velocity, side, side, load)",
            "model",
        )
