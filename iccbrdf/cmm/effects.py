"""Effects that are left out of a compiled chain: what stands in for the channels that bring them about."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from iccbrdf.cmm.steps import Route
from iccbrdf.errors import UsageError, nearest

FULL, AUTO = "full", "auto"
"""All effects on every pixel; all effects, each where a tile calls for it."""

SUBSTITUTES: Mapping[str, Mapping[str, str | float] | None] = {
    "specular": {"ks.X": 0.0, "ks.Y": 0.0, "ks.Z": 0.0},
    "fresnel": None,
    "shadowing": None,
    "chromatic-specular": {"ks.X": "ks.Y", "ks.Z": "ks.Y"},
    "chromatic-roughness": {"m.X": "m.Y", "m.Z": "m.Y"},
    "relief": {"n.x": 0.0, "n.y": 0.0, "n.z": 1.0},
    "below-horizon": None,
    "highlight-range": None,
    "slope": None,
    "interpolation": None,
}
"""By effect, the value or the other channel that a multiplex channel takes where the effect is left out.

None: the effect is no matter of channels, but part of a program.
"""


@dataclass(frozen=True)
class Choice:
    """Which effects run."""

    left_out: tuple[str, ...] = ()
    named: tuple[str, ...] = ()
    """Those of them that were named, and are not just others than those wanted."""
    adaptive: bool = False
    """Whether each tile runs only what it calls for."""


def choice(effects: str | Collection[str], without: Collection[str]) -> Choice:
    """
    The effects to leave out.

    Parameters
    ----------
    effects
        "full", "auto", or the effects of channels to have; the others of them are left out.
    without
        Effects to leave out.

    Raises
    ------
    UsageError
        A name is unknown, or its effect is part of a program.
    """
    left_out = tuple(dict.fromkeys(map(_known, without)))
    if isinstance(effects, str):
        if effects not in (FULL, AUTO):
            raise UsageError(f"effects {effects!r} is unknown: {nearest(effects, (FULL, AUTO))}")
        return Choice(left_out, left_out, effects == AUTO)
    kept = [_known(name) for name in effects]
    others = [name for name, channels in SUBSTITUTES.items() if channels and name not in kept]
    return Choice(tuple(dict.fromkeys([*others, *left_out])), left_out, True)


def _known(name: str) -> str:
    found = name.replace("_", "-")
    if found not in SUBSTITUTES:
        raise UsageError(f"there is no effect {name!r}: {nearest(found, SUBSTITUTES)}")
    if SUBSTITUTES[found] is None:
        switchable = ", ".join(effect for effect, channels in SUBSTITUTES.items() if channels)
        raise UsageError(
            f"the effect {found} is part of a profile's program and cannot be switched here, as {switchable} "
            f"can; build profiles without it: iccbrdf build --without {found}"
        )
    return found


def substitution(names: Sequence[str], left_out: Collection[str]) -> Route | None:
    """The step that leaves out effects where a profile takes the multiplex channels `names`, if any."""
    # Without gloss there is no gloss of another colour: the least specific effect goes last and wins.
    instead: dict[str, str | float] = {}
    for effect in sorted(left_out, key=lambda effect: effect == "specular"):
        instead |= {
            name: value
            for name, value in (SUBSTITUTES[effect] or {}).items()
            if name in names and (not isinstance(value, str) or value in names)
        }
    if not instead:
        return None
    chosen = [instead.get(name, name) for name in names]
    return Route(
        tuple(names.index(value) if isinstance(value, str) else None for value in chosen),
        tuple(0.0 if isinstance(value, str) else value for value in chosen),
    )


def check(chosen: Choice, spaces: Sequence[Sequence[str]]) -> None:
    """Whether what is to be left out can be, where profiles take the multiplex channels `spaces`.

    Raises UsageError where none has a channel of an effect that was named; or where gloss is one channel,
    ks, which in some models says how much is diffuse, too.
    """
    for effect in chosen.left_out:
        channels = SUBSTITUTES[effect] or {}
        if any(name in channels for names in spaces for name in names):
            continue
        if effect in chosen.named or (effect == "specular" and any("ks" in names for names in spaces)):
            raise UsageError(
                f"the effect {effect} cannot be left out here, as no profile takes a multiplex channel "
                f"{', '.join(channels)}; build profiles without it: iccbrdf build --without {effect}"
            )
