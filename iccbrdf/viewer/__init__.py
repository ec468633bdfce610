"""The print as a page: one HTML file in which its light can be moved.

Follow one program: MID and MVIS -> one graph (`chain`) -> GLSL for the picture and JavaScript for what holds
for a whole frame and for the read-out (`programs`, `glsl`, `javascript`).  Follow one pixel: channels in 16
bits (`image`) -> XYZ in the fragment shader (`shader.glsl`) -> the display (`display`).
"""

from iccbrdf.viewer.display import Display, make_display
from iccbrdf.viewer.folder import ProofFolder, read_folder
from iccbrdf.viewer.page import MAX_PIXELS, Print, Start, make_page, read_print

__all__ = [
    "MAX_PIXELS",
    "Display",
    "Print",
    "ProofFolder",
    "Start",
    "make_display",
    "make_page",
    "read_folder",
    "read_print",
]
