"""Base of references: an attitude as an exactly differentiable function of time."""

from collections.abc import Hashable, Iterable, Mapping
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import Member


class Reference(Member):
    """A desired motion. Subclass it, annotate the parameters, write ``motion``.

    Attributes:
        subject: the parameter that the text after a colon stands for, as in ``recorded:FILE``; empty where there is
            no such short form.
    """

    kind: ClassVar[str] = "reference"
    subject: ClassVar[str] = ""

    @classmethod
    def advice(cls, name: str) -> str:
        """Return advice on a name that is unknown: a file of a motion needs its kind before it."""
        short = [member for member, kind in cls.members.items() if issubclass(kind, Reference) and kind.subject]
        if short and (Path(name).suffix or Path(name).is_file()):
            return f"a motion in a file is given as {' or '.join(f'{each}:{name}' for each in short)}"
        return super().advice(name)

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """Return attitude, body rate [rad/s] and body acceleration [rad/s²] at ``time`` [s], (n,), as MOTION."""
        raise NotImplementedError("a reference needs a method motion(self, time)")

    def drawn(self, random: np.random.Generator) -> "Reference":
        """Return this reference with everything random in it drawn; itself if nothing is."""
        return self

    def state(self) -> Hashable:
        """Return the state that the motion depends on besides its parameters, such as when its file was changed."""
        return None

    def end(self) -> float:
        """Return the time [s] after which the motion only rests; infinity where it goes on."""
        return inf

    def whole(self) -> float:
        """Return the time [s] that the whole motion takes; infinity where it has no end."""
        return inf

    def about(self) -> str:
        """Return a description of the motion in one line; empty for formulas."""
        return ""

    def warnings(self, duration: float) -> Iterable[str]:
        """Return a sentence for each doubt about the motion; empty if there is none.

        It is asked once a run. A sentence has the figure, what it means, and the setting that helps, without a full
        stop; see :mod:`spherical_wrist.measure.warnings`.

        Args:
            duration: of the run [s].
        """
        return ()

    def sizing(self) -> Self:
        """Return the motion that sizes relative disturbances: this one, or without peaks that are no motion."""
        return self

    @classmethod
    def resolve(cls, given: Any, default: str) -> Any:
        """See :meth:`.Member.resolve`; a name may be ``NAME:TEXT``, where the reference has such a short form.

        Raises:
            UnknownNameError: the name is not in the family; the message has the nearest valid one.
            ParameterError: a parameter is not valid, or stands both in the name and beside it.
        """
        table = {"name": given} if isinstance(given, str) else given
        name = table.get("name") if isinstance(table, Mapping) else None
        if isinstance(name, str) and (found := _short_form(cls, name)):
            member, text = found
            beside = table.get(member.subject)
            if beside is not None and str(beside) != text:
                raise ParameterError(
                    f"reference {name!r} and {member.subject} = {str(beside)!r}: two of them; give one"
                )
            given = {**table, "name": member.name, member.subject: text}
        return super().resolve(given, default)

    @classmethod
    def member(cls, name: Any) -> type[Member]:
        """See :meth:`.Member.member`; a name may be ``NAME:TEXT``, where the reference has such a short form.

        Raises:
            UnknownNameError: there is none; the message has the nearest valid one.
        """
        found = _short_form(cls, name) if isinstance(name, str) else None
        return found[0] if found else super().member(name)


def _short_form(family: type[Reference], name: str) -> tuple[type[Reference], str] | None:
    """Return the reference and the text that ``NAME:TEXT`` stands for; None where it does not."""
    known, colon, text = name.partition(":")
    member = family.members.get(known)
    if not colon or member is None or not issubclass(member, Reference) or not member.subject:
        return None
    return member, text


def motion_of(attitude: Array, rate: Array, acceleration: Array) -> npt.NDArray[Any]:
    """Pack quaternions (n, 4) and their derivatives, each (n, 3), into an array of MOTION (n,)."""
    from spherical_wrist.dynamics import MOTION  # MuJoCo, which names and parameters do without

    packed = np.empty(len(rate), MOTION)
    packed["attitude"] = attitude
    packed["rate"] = rate
    packed["acceleration"] = acceleration
    return packed
