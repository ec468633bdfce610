"""What one profile contributes to a chain: which of its tags runs, between which spaces."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from iccbrdf.cmm.encodings import as_display
from iccbrdf.cmm.luts import TYPES, as_elements
from iccbrdf.cmm.named import named_step
from iccbrdf.cmm.ramps import NAMED
from iccbrdf.cmm.resolve import Resolver, holds_spectra
from iccbrdf.cmm.shapers import SHAPERS, shaper
from iccbrdf.cmm.spaces import Space, device_space, mcs_space, pcs_space, spectral_space
from iccbrdf.cmm.steps import Process
from iccbrdf.errors import ProfileError, ProfileWarning, UnsupportedError, nearest
from iccbrdf.icc import MultiProcess, Profile

INTENTS = ("perceptual", "relative", "saturation", "absolute")

# Which of the tags ...0 to ...3 stands for an intent, in the order of preference.  Relative and absolute
# stand for each other by way of the media white (ICC.2, 8.x); ...0 stands for any; the rest deviates from
# the specification and is warned about.
_PREFERENCE = {0: (0, 1, 3, 2), 1: (1, 3, 0, 2), 2: (2, 0, 1, 3), 3: (3, 1, 0, 2)}
_BY_THE_BOOK = {0: (0,), 1: (1, 3, 0), 2: (2, 0), 3: (3, 1, 0)}

_CANNOT_RUN = ("M2S", "D2B", "B2D", *(f"{kind}{way}" for kind in "bd" for way in ("AB", "BA", "DB", "BD")),
               "bMB", "bMS", "bcp", "bsp")  # fmt: skip
"""Tags that may hold a profile's only transform: for spectra, or for directions as further channels."""


@dataclass(frozen=True)
class Stage:
    """One profile's part in the chain."""

    profile: Profile
    intent: str
    tag: str
    process: MultiProcess
    source: Space
    destination: Space
    stated: Profile
    """Whose viewing conditions and media white hold: its own, unless the caller names another profile."""
    viewing: Profile
    """Whose viewing conditions the connection space is under, and spectra are seen under: those stated.

    Spectra before spectral elements bind these late: both profiles of such a pair are seen under the first
    one's conditions, and nothing is converted between them.
    """
    named: Process | None = None
    """What runs instead of elements, of which `process` has none then: named colours."""

    @property
    def where(self) -> str:
        """The tag's place, for messages."""
        return f"{self.profile.source}: tag {self.tag}"

    @property
    def relates(self) -> Literal["relative", "absolute"] | None:
        """Whether the tag's colours are relative to the media white; None where that is not told.

        Only the colorimetric tags, ...1 and ...3, tell.  A ...0 or ...2 that stands in for one of them is
        used as it is, as the reference implementation does at the end of a chain; but before version 5, what
        is not absolute is relative.  Tags between two ranges take colours of either kind.
        """
        if self.tag.startswith("H2S"):
            return None
        if self.tag[-1] == "3":
            return "absolute"
        classic = self.profile.header.version[0] < 5 or self.tag in (*SHAPERS, *NAMED)
        return "relative" if classic or self.tag[-1] == "1" else None

    @property
    def without_black(self) -> bool:
        """Whether the black of the perceptual intent is 0, and not what version 4 has agreed on."""
        header = self.profile.header
        return (
            self.intent == "perceptual"
            and header.device_class != "abst"
            and (header.version[0] < 4 or self.tag in (*SHAPERS, *NAMED))
        )

    @property
    def is_spectral(self) -> bool:
        """Whether the tag has elements that viewing conditions turn into others."""
        return any(map(holds_spectra, self.process.elements))

    def step(self, interpolation: str) -> Process:
        """The tag as a step that is safe to run."""
        return self.named or Process.checked(self.process, self.where, Resolver(self.viewing, interpolation))


def stages(
    chain: Sequence[Profile],
    intent: str | Sequence[str],
    *,
    spectral: bool = True,
    stated: Mapping[int, Profile] | None = None,
) -> list[Stage]:
    """The stages of a chain of profiles; which tag runs depends on the intent and on the neighbours.

    intent: one for all, or one a profile.  spectral: whether transforms to a spectral connection space go
    before those to a colorimetric one.  stated: by position in the chain, profiles whose viewing conditions
    stand in for those of the profile there.
    """
    intents = [intent] * len(chain) if isinstance(intent, str) else intent
    chain = [as_display(profile) if profile.header.device_class == "cenc" else profile for profile in chain]
    found: list[Stage] = []
    for i, profile in enumerate(chain):
        if found and not profile.header.extended_range:
            found += _to_usual_range(found[-1])
        source = found[-1].destination if found else None
        following = chain[i + 1].header.device_class if i + 1 < len(chain) else ""
        stage = _stage(profile, source, following, intents[i], spectral)
        if stated and i in stated:
            stage = replace(stage, stated=stated[i], viewing=stated[i])
        if found and source is not None and stage.is_spectral:
            before = found[-1]
            if source.kind == "spectral" or (source.kind == "pcs" and before.is_spectral):
                stage = replace(stage, viewing=before.viewing)
        found.append(stage)
    return found


def _stage(profile: Profile, before: Space | None, following: str, asked: str, spectral: bool) -> Stage:
    """The transform that `profile` contributes between the space before it and the profile after it."""
    device_class, intent = profile.header.device_class, INTENTS.index(asked)
    if device_class == "nmcl":
        tag = next((tag for tag in NAMED if tag in profile), NAMED[0])
        step, source, destination = named_step(profile, before, spectral=spectral)
        process = MultiProcess(len(source.names), len(source.names), ())
        return Stage(profile, asked, tag, process, source, destination, profile, profile, step)
    to_mcs = profile.header.mcs and "A2M0" in profile and following in ("mvis", "mlnk")
    if device_class == "mid " or to_mcs:
        tag, source, destination = "A2M0", device_space(profile), mcs_space(profile)
    elif device_class == "mvis":
        tag, destination = _connection(profile, "M2S", ("M2B",), intent, spectral)
        source = mcs_space(profile)
    elif device_class == "mlnk":
        tag, source, destination = "M2A0", mcs_space(profile), device_space(profile)
    elif device_class == "link":
        tag, source, destination = "A2B0", device_space(profile), device_space(profile, field="pcs")
    elif device_class == "abst":
        spectra = spectral if before is None else before.kind == "spectral"
        tag, source = _connection(profile, "D2B", ("D2B", "A2B"), intent, spectra)
        destination = source
    elif before is not None and before.kind in ("pcs", "spectral"):
        tag, source = _connection(profile, "B2D", ("B2D", "B2A"), intent, before.kind == "spectral")
        destination = device_space(profile)
    else:
        tag, destination = _connection(profile, "D2B", ("D2B", "A2B"), intent, spectral)
        source = device_space(profile)
    process = _multi_process(profile, tag, source, destination)
    return Stage(profile, asked, tag, process, source, destination, profile, profile)


def _to_usual_range(stage: Stage) -> list[Stage]:
    """What brings colours of an extended range to the usual one, where the stage's profile has such a tag."""
    profile, space = stage.profile, stage.destination
    if not profile.header.extended_range or space.kind != "pcs":
        return []
    for tag in dict.fromkeys((f"H2S{INTENTS.index(stage.intent)}", "H2S0", "H2S1")):
        if tag in profile:
            process = _multi_process(profile, tag, space, space)
            return [replace(stage, tag=tag, process=process, source=space)]
    return []


def _connection(
    profile: Profile, spectra: str, colours: tuple[str, ...], intent: int, spectral: bool
) -> tuple[str, Space]:
    """The tag to run and the connection space on its other side.

    With a spectral connection space, tags of the family `spectra` hold for that one; they go first where
    `spectral` allows, and where the profile has no colorimetric space.
    """
    if not profile.header.spectral_pcs:
        return _by_intent(profile, colours, intent), pcs_space(profile)
    if any(f"{spectra}{n}" in profile for n in range(4)) and (spectral or not profile.header.pcs):
        return _by_intent(profile, (spectra,), intent), spectral_space(profile)
    return _by_intent(profile, tuple(c for c in colours if c != spectra), intent), pcs_space(profile)


def _by_intent(profile: Profile, families: tuple[str, ...], intent: int) -> str:
    for n in _PREFERENCE[intent]:
        for family in families:
            tag = f"{family}{n}"
            if tag not in profile:
                continue
            if n not in _BY_THE_BOOK[intent]:
                warnings.warn(
                    f"{profile.source}: no tag for the {INTENTS[intent]} intent; {tag} stands in",
                    ProfileWarning,
                    stacklevel=6,
                )
            return tag
    for tag in SHAPERS:
        if tag in profile:
            return tag
    wanted = " or ".join(f"{family}0..3" for family in families)
    for tag in profile:
        if tag.startswith(_CANNOT_RUN):
            raise UnsupportedError(f"{profile.source}: found tag {tag}, which cannot run; expected {wanted}")
    raise ProfileError(f"{profile.source}: none of the tags {wanted} is there")


def _multi_process(profile: Profile, tag: str, source: Space, destination: Space) -> MultiProcess:
    if tag in SHAPERS:
        return shaper(profile, tag, source, destination)
    value = profile.get(tag)
    if value is None:
        raise ProfileError(f"{profile.source}: tag {tag} is missing: {nearest(tag, profile)}")
    if isinstance(value, TYPES):
        process = as_elements(value, source, destination, f"{profile.source}: tag {tag}")
    elif isinstance(value, MultiProcess):
        process = value
    else:
        raise UnsupportedError(
            f"{profile.source}: tag {tag} is of type {value.signature!r}; "
            "only processing elements and look-up tables can run"
        )
    for side, space, found in (("in", source, process.inputs), ("out", destination, process.outputs)):
        if found != len(space.names):
            raise ProfileError(
                f"{profile.source}: tag {tag} has {found} channels {side}, "
                f"expected {len(space.names)} by the header ({space.text})"
            )
    return process
