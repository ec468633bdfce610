"""Figures of FOGRA39, coated offset: the colours that the synthetic print is made of and tested with.

FOGRA39L characterisation data (Fogra, December 2006), as published in FOGRA39L.ti3: D50, 2 degrees, 45:0, no
polarisation filter, white backing; coated art paper of 115 g/m2, tone value increase A (CMY) and B (K).
"""

from __future__ import annotations

SOURCE = "FOGRA39L characterisation data (Fogra, 2006)"
ILLUMINANT, OBSERVER = "D50", "CIE 1931 2 Degree Standard Observer"

Figures = dict[tuple[int, int, int, int], tuple[float, float, float]]

SOLIDS: Figures = {
    (0, 0, 0, 0): (84.48, 87.62, 74.57),
    (100, 0, 0, 0): (15.02, 22.93, 52.85),
    (0, 100, 0, 0): (33.03, 16.79, 15.01),
    (100, 100, 0, 0): (5.67, 4.1, 15.67),
    (0, 0, 100, 0): (69.17, 74.16, 7.04),
    (100, 0, 100, 0): (8.16, 18.42, 6.74),
    (0, 100, 100, 0): (30.2, 16.02, 2.3),
    (100, 100, 100, 0): (3.66, 3.8, 3.13),
    (0, 0, 0, 100): (2.02, 2.1, 1.73),
    (100, 0, 0, 100): (0.91, 1.18, 1.79),
    (0, 100, 0, 100): (1.61, 1.18, 0.89),
    (100, 100, 0, 100): (0.99, 0.87, 1.08),
    (0, 0, 100, 100): (1.84, 2.04, 0.82),
    (100, 0, 100, 100): (0.89, 1.31, 0.85),
    (0, 100, 100, 100): (1.56, 1.31, 0.65),
    (100, 100, 100, 100): (0.93, 0.97, 0.69),
}
"""XYZ (Y = 100) of paper and all overprints of solid inks, by C, M, Y, K in per cent."""

TEST_PATCHES: Figures = {
    (40, 0, 0, 0): (49.39, 56.18, 67.19),
    (0, 40, 0, 0): (58.85, 50.57, 47.38),
    (0, 0, 40, 0): (76.49, 81.13, 38.69),
    (70, 70, 0, 0): (14.04, 11.79, 25.17),
    (70, 0, 70, 0): (20.19, 30.55, 15.15),
    (0, 40, 40, 0): (53.79, 46.98, 24.87),
    (40, 40, 40, 0): (30.21, 29.86, 22.62),
    (10, 40, 40, 0): (47.47, 42.51, 24.33),
    (40, 100, 0, 0): (18.46, 10.09, 15.3),
    (0, 0, 0, 40): (38.31, 39.73, 33.69),
    (0, 0, 0, 80): (9.0, 9.33, 7.83),
    (40, 70, 70, 20): (15.31, 12.21, 5.78),
    (20, 100, 70, 60): (6.77, 4.19, 1.84),
    (100, 40, 40, 20): (5.96, 8.98, 13.88),
    (70, 0, 70, 80): (3.06, 4.31, 2.53),
}
"""XYZ (Y = 100) of 15 patches of the Fogra Media Wedge, nine without black."""

TONE_VALUE_INCREASE = (0.117, 0.140, 0.148, 0.167)
"""Of C, M, Y, K at half tone: Murray-Davies on X, Y, Z, Y of the figures at 55, 55, 55 and 40 per cent."""
