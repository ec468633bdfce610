"""Pages of the viewer in a headless browser."""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

# The software rasteriser, so that every machine computes the same.
FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]


@contextmanager
def headless_browser() -> Iterator[Any]:
    """Debian's Chromium, driven by Playwright; the test is skipped where one of them is missing."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright to drive a browser")
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
    if chromium is None:
        pytest.skip("no browser: Debian's package chromium is missing")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        yield browser
        browser.close()


@dataclass
class Opened:
    """A page that is open."""

    tab: Any
    faults: list[str] = field(default_factory=list)
    """What the console says, errors, and requests beyond the file itself."""

    def run(self, script: str, argument: Any = None) -> Any:
        """The value of a JavaScript expression, or of a function of `argument`."""
        return self.tab.evaluate(script, argument)

    def array(self, call: str, dtype: str, argument: Any = None) -> np.ndarray:
        """What a call of the page's renderer gives, an array."""
        script = (
            f"(a) => {{ const bytes = new Uint8Array({call}.buffer); let text = '';"
            "for (let i = 0; i < bytes.length; i += 32768)"
            " text += String.fromCharCode(...bytes.subarray(i, i + 32768));"
            "return btoa(text); }"
        )
        return np.frombuffer(base64.b64decode(self.run(script, argument)), dtype)

    def measure(
        self, env: dict[str, float], width: int, height: int, without: tuple[str, ...] = ()
    ) -> np.ndarray:
        """XYZ under D50 of the page's image, before the display."""
        call = "proof.renderer.measure(proof.program(...a.without), a.env, 0, 0, a.width, a.height)"
        argument = {"env": env, "width": width, "height": height, "without": list(without)}
        return self.array(call, "<f4", argument).reshape(height, width, 4)[..., :3]

    def levels(
        self, env: dict[str, float], width: int, height: int, *, soft: bool = False
    ) -> np.ndarray:
        """Levels of the display in 0..255."""
        call = "proof.renderer.levels(proof.program(), a.env, 1, a.soft, 0, 0, a.width, a.height)"
        argument = {"env": env, "width": width, "height": height, "soft": soft}
        return self.array(call, "u1", argument).reshape(height, width, 4)[::-1, :, :3]


def open_page(browser: Any, path: Path, **options: Any) -> Opened:
    """Open a page and wait until its print is there."""
    tab = browser.new_page(**{"viewport": {"width": 900, "height": 600}, **options})
    opened = Opened(tab)
    tab.on("console", lambda message: opened.faults.append(f"{message.type}: {message.text}"))
    tab.on("pageerror", lambda error: opened.faults.append(f"error: {error}"))
    tab.on("crash", lambda _: opened.faults.append("crash"))
    tab.on("request", lambda request: None if _is_local(request.url) else opened.faults.append(request.url))
    tab.goto(path.as_uri())
    tab.evaluate("proof.ready.then(() => true, () => false)")
    return opened


def _is_local(url: str) -> bool:
    return url.startswith(("file:", "data:", "blob:"))
