"""What a page costs: counted arithmetic and memory traffic, and what that means on a common laptop."""

from __future__ import annotations

from typing import Any

from iccbrdf.viewer.display import Display
from iccbrdf.viewer.page import Print

WIDTH, HEIGHT = 1920, 1080
OPERATIONS_A_SECOND = 4e11
"""Of the graphics in a laptop's processor: about a third of the 1.2e12 or more that makers of such chips
state, since few additions meet a multiplication that they could be fused with."""
BYTES_A_SECOND = 3e10
"""Of its memory: half of what two channels of DDR4-3200 can do."""


def cost(shown: Print, display: Display) -> dict[str, Any]:
    """Operations of a pixel by effects left out and by operator, and the estimate for a frame.

    Operations count in additions (`Program.operations`); every pixel of the frame shows one of the image.
    """
    programs = shown.programs
    pixel = programs.whole.operations + display.operations
    pixels = WIDTH * HEIGHT
    arithmetic = pixels * pixel / OPERATIONS_A_SECOND
    memory = pixels * (2 * len(shown.layers) + 4) / BYTES_A_SECOND
    # The two overlap only in part; a frame takes no longer than both.
    milliseconds = 1000 * (arithmetic + memory)
    return {
        "operations_a_pixel": programs.whole.operations,
        "operations_of_the_display": display.operations,
        "operations_without": {
            ", ".join(without): programs.programs[index].operations
            for without, index in programs.of.items()
            if without
        },
        "nodes_a_pixel": dict(sorted(programs.whole.nodes.items())),
        "laptop_1080p": {
            "width": WIDTH,
            "height": HEIGHT,
            "operations_a_frame": pixels * pixel,
            "assumed_operations_a_second": OPERATIONS_A_SECOND,
            "assumed_bytes_a_second": BYTES_A_SECOND,
            "milliseconds": round(milliseconds, 2),
            "frames_a_second": round(1000 / milliseconds),
        },
    }
