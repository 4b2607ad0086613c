"""Columns of a recorded motion: which of a file's columns are its time and its attitude.

The order of a quaternion's numbers is taken from the names of its columns, from a known format, or from the person who
gives ``reference.columns``. It is never guessed from the numbers.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, NamedTuple, get_args

from spherical_wrist.errors import UnknownNameError
from spherical_wrist.reference.recorded_rows import RowError

TimeUnit = Literal["s", "ms", "us", "ns"]
Kind = Literal[
    "quaternion", "rotation matrix", "rotation vector [rad]", "rotation vector [deg]", "roll, pitch, yaw [rad]",
    "roll, pitch, yaw [deg]",
]  # fmt: skip

MATRIX = tuple(f"r{row}{column}" for row in "123" for column in "123")
ROLES: Mapping[Kind, tuple[str, ...]] = {
    "quaternion": ("w", "x", "y", "z"),
    "rotation matrix": MATRIX,
    "rotation vector [rad]": ("rx", "ry", "rz"),
    "rotation vector [deg]": ("rx_deg", "ry_deg", "rz_deg"),
    "roll, pitch, yaw [rad]": ("roll", "pitch", "yaw"),
    "roll, pitch, yaw [deg]": ("roll_deg", "pitch_deg", "yaw_deg"),
}
"""Parts of an attitude in the order in which they are read, by kind. A quaternion's w is its scalar.

Roll, pitch and yaw are those of ROS and of aircraft: R = Rz(yaw) Ry(pitch) Rx(roll), body → world.
"""
TIME = "time"
SECONDS, NANOSECONDS = "sec", "nanosec"
"""Roles of a stamp in two columns, as in ROS messages: whole seconds, and the nanoseconds since."""

TIMES = ("header.stamp", "time", "t", "timestamp", "stamp", "times")
"""Names of the time, the first one that is there; of a message's own stamp before the time at which it arrived."""
UNIT_WORDS: Mapping[str, TimeUnit] = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "µs", "μs", "usec", "usecs", "micros", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"), "ns"),
}
STAMP = re.compile(r"(.*?)((?:^|(?<=[._/ ]))(?:n|nano)?)(?:secs?|seconds?)")
"""Name of a part of a stamp in two columns: what it is of, and whether it has the nanoseconds."""
LETTERS = (("w", "x", "y", "z"), ("r", "i", "j", "k"))
"""Last letters of the names of a quaternion's columns, scalar first."""
TUM = ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
KITTI_WIDTH = 12
LONGEST_NAME = 200
"""Most characters of a name in which a unit is looked for."""
EXAMPLE = "time=NAME, w=NAME, x=NAME, y=NAME, z=NAME"


class Columns(NamedTuple):
    """Columns of a file that are read.

    Attributes:
        time: number of the column of times, from 0; None where there is none.
        attitude: numbers of the columns of the attitude, in the order of ``ROLES``.
        kind: of the attitude.
        unit: of the times, where the names or the format say it.
        said: what was recognised, in words.
        nanoseconds: number of the column of nanoseconds, where that of times has whole seconds; otherwise None.
    """

    time: int | None
    attitude: tuple[int, ...]
    kind: Kind
    unit: TimeUnit | None
    said: str
    nanoseconds: int | None = None


def columns_of(names: Sequence[str]) -> Columns:
    """Return the columns of time and attitude by their names, in any case and with or without units.

    Raises:
        RowError: there are none, or more than one could be meant.
    """
    plain, units = zip(*map(_plain, names), strict=True) if names else ((), ())
    kind, attitude = _attitude(plain, names)
    pair = _pair(names)
    time, nanoseconds = (_time(plain), None) if pair is None else pair
    for number in attitude if time is None or nanoseconds is not None else (time, *attitude):
        if plain.count(plain[number]) > 1:
            raise RowError(f"it has more than one column {plain[number]!r}; give reference.columns, with their numbers")
    if set(TUM) <= set(plain) and time is not None:
        return Columns(time, attitude, kind, units[time] or "s", "TUM trajectory, quaternion in the order x, y, z, w")
    if {"q_rs_w", "p_rs_r_x"} <= set(plain) and time is not None:
        return Columns(time, attitude, kind, units[time] or "ns", "EuRoC ground truth, quaternion from q_RS_w … q_RS_z")
    unit = units[time] if time is not None and nanoseconds is None else None
    shown = [names[number].strip().strip("\"'") for number in attitude]
    span = ", ".join(shown) if len(shown) < 5 else f"{shown[0]} … {shown[-1]}"
    order = " w, x, y, z" if kind == "quaternion" else ""
    return Columns(time, attitude, kind, unit, f"{kind}{order} from {span}", nanoseconds)


def columns_by_width(width: int, *, spaced: bool) -> Columns:
    """Return the columns of a file without names.

    Args:
        width: number of columns.
        spaced: whether they are separated by spaces.

    Raises:
        RowError: no known format has so many.
    """
    if width == len(TUM) and spaced:
        found = columns_of(TUM)
        return found._replace(said=f"{found.said} (no names, eight columns: TUM)")
    if width == KITTI_WIDTH:
        return Columns(
            None, (0, 1, 2, 4, 5, 6, 8, 9, 10), "rotation matrix", None, "KITTI poses, twelve numbers of a 3 × 4 matrix"
        )
    raise RowError(
        f"its {width} columns have no names: say which is which by number, as in reference.columns = "
        "'time=1, w=2, x=3, y=4, z=5' (w is the scalar: often the first of the four, in TUM and ROS the last)"
    )


def chosen_columns(text: str, names: Sequence[str]) -> Columns:
    """Return the columns that ``reference.columns`` names, by name or by number from 1.

    Raises:
        RowError: the file has no such column, or more than one.
    """
    pairs = _pairs(text)
    kind = _kind_of(pairs)
    plain = [_plain(name) for name in names]
    numbers = {role: _number(wanted, names, [name for name, _ in plain]) for role, wanted in pairs.items()}
    if len(set(numbers.values())) < len(numbers):
        raise RowError(f"reference.columns = {text!r} names a column twice")
    attitude = tuple(numbers[role] for role in ROLES[kind])
    time = numbers.get(TIME, numbers.get(SECONDS))
    listed = ", ".join(f"{role}={wanted}" for role, wanted in pairs.items())
    unit = plain[numbers[TIME]][1] if TIME in numbers else None
    return Columns(time, attitude, kind, unit, f"{kind} from {listed}", numbers.get(NANOSECONDS))


def read_columns(given: object) -> object:
    """Return ``reference.columns`` in its one form, ``role=column, …``, from that or from a table of roles.

    Raises:
        ValueError: it does not name an attitude's columns.
    """
    if given is None:
        return None
    pairs = {str(key): str(value) for key, value in given.items()} if isinstance(given, Mapping) else _pairs(str(given))
    _kind_of(pairs)
    return ", ".join(f"{role}={column}" for role, column in pairs.items())


def _pairs(text: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for part in text.split(","):
        role, equals, column = (each.strip() for each in part.partition("="))
        if not (role and equals and column) or role in found:
            raise ValueError(f"{EXAMPLE} is needed, each role once")
        found[role] = column
    return found


def _kind_of(pairs: Iterable[str]) -> Kind:
    given, stamp = set(pairs), {SECONDS, NANOSECONDS}
    if given & stamp and (not stamp <= given or TIME in given):
        raise ValueError(f"a stamp is time, or {SECONDS} and {NANOSECONDS} together")
    roles = given - {TIME} - stamp
    for kind, needed in ROLES.items():
        if roles == set(needed):
            return kind
    known = {TIME, *stamp, *(role for needed in ROLES.values() for role in needed)}
    for role in roles - known:
        raise ValueError(str(UnknownNameError("role of a column", role, known)))
    raise ValueError(
        "time (or sec and nanosec) and the parts of one attitude are needed: w, x, y, z (w is the scalar), or r11, r12 "
        "… r33, or a rotation vector rx, ry, rz in rad, or rx_deg, ry_deg, rz_deg, or roll, pitch, yaw in rad, or "
        "roll_deg, pitch_deg, yaw_deg"
    )


def _number(wanted: str, names: Sequence[str], plain: Sequence[str]) -> int:
    exact = [number for number, name in enumerate(names) if name.strip().strip("\"'") == wanted]
    found = exact or [number for number, name in enumerate(plain) if name == _plain(wanted)[0]]
    if len(found) == 1:
        return found[0]
    if not found and wanted.isdecimal() and 1 <= int(wanted) <= len(names):
        return int(wanted) - 1
    has = f"{len(names)} columns without names" if not any(names) else listed(names)
    raise RowError(f"reference.columns: it has {'more than one' if found else 'no'} column {wanted!r}; it has {has}")


def _plain(name: str) -> tuple[str, TimeUnit | None]:
    """Return a name in lower case without unit, quotes and comment sign, and its unit of time if it has one."""
    name = name.strip().strip("\"'").lstrip("#%").strip().lower()
    if len(name) > LONGEST_NAME:
        return name, None
    found = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]", name) or re.fullmatch(r"(.*?)[_ ]+([a-zµμ]+)", name)
    if found is None:
        return name, None
    bare, word = found.groups()
    if word in UNIT_WORDS and _last(bare) in TIMES:
        return bare, UNIT_WORDS[word]
    return (bare if name.endswith(("]", ")")) else name), None


def _last(name: str) -> str:
    """Return the last part of a dotted name; of a header's stamp, the last two."""
    parts = re.split(r"[./]", name)
    return ".".join(parts[-2:]) if parts[-2:] == ["header", "stamp"] else parts[-1]


def _time(plain: Sequence[str]) -> int | None:
    for time in TIMES:
        for found in ([name == time for name in plain], [_last(name) == time for name in plain]):
            if any(found):
                return found.index(True)
    return None


def _pair(names: Sequence[str]) -> tuple[int, int] | None:
    """Return the columns of whole seconds and of nanoseconds of one stamp, a message's own first; None without."""
    parts: dict[tuple[str, bool], int] = {}
    for number, name in enumerate(names):
        bare = name.strip().strip("\"'").lstrip("#%").strip().lower()
        if len(bare) <= LONGEST_NAME and (found := STAMP.fullmatch(bare)):
            parts.setdefault((found[1], bool(found[2])), number)
    pairs = {stem: (parts[stem, False], parts[stem, True]) for stem, nano in parts if nano and (stem, False) in parts}
    if not pairs:
        return None
    return pairs[min(pairs, key=lambda stem: ("header" not in stem, "stamp" not in stem, pairs[stem]))]


def _attitude(plain: Sequence[str], names: Sequence[str]) -> tuple[Kind, tuple[int, ...]]:
    groups = {
        name[:-1]: tuple(f"{name[:-1]}{letter}" for letter in letters)
        for letters in LETTERS
        for name in plain
        if name.endswith(letters[0]) and (letters is LETTERS[0] or name.startswith("q"))
    }
    whole = {stem: group for stem, group in groups.items() if set(group) <= set(plain)}
    for stem in ("q", ""):
        if stem in whole:
            whole = {stem: whole[stem]}
    kind: Kind = "quaternion"
    if not whole:
        kind = "rotation matrix"
        for first in (1, 0):
            order = [f"{row}{column}" for row in range(first, first + 3) for column in range(first, first + 3)]
            stems = {name[:-2] for name in plain if name.endswith(order[0])}
            matrices = {stem: tuple(f"{stem}{place}" for place in order) for stem in stems}
            whole |= {stem: group for stem, group in matrices.items() if set(group) <= set(plain)}
    if len(whole) > 1:
        several = ", ".join(repr(group[0]) for group in whole.values())
        raise RowError(f"it has several attitudes ({several} …): choose one with reference.columns = '{EXAMPLE}'")
    if not whole:
        numbered = next((name[:-1] for name in plain if f"{name[:-1]}3" in plain and name.endswith("1")), None)
        hint = ""
        if numbered is not None:
            hint = f"; {numbered}1 … do not say which one is the scalar w"
        elif {"roll", "pitch", "yaw"} <= {_last(name).split("_")[0] for name in plain}:
            hint = "; say of roll, pitch and yaw that they are in rad, roll=NAME …, or in degrees, roll_deg=NAME …"
        raise RowError(
            "columns of time (time, t or timestamp) and attitude (qw, qx, qy, qz, or w, x, y, z, or r11, r12 … r33) "
            f"are needed; it has {listed(names)}{hint}: name them with reference.columns = '{EXAMPLE}'"
        )
    (group,) = whole.values()
    return kind, tuple(plain.index(name) for name in group)


def listed(names: Iterable[str]) -> str:
    """Return the first names in a list."""
    named = [repr(name.strip().strip("\"'")) for name in names if name.strip()]
    return ", ".join(named[:12]) + (f" and {len(named) - 12} more" if len(named) > 12 else "") or "none"


UNITS: tuple[TimeUnit, ...] = get_args(TimeUnit)
