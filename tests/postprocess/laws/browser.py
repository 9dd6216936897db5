"""A headless Chromium, driven through pipes by its DevTools protocol."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any, Self

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe")


def found() -> str | None:
    """The path of a Chromium on this machine."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One page of a Chromium: ``faults`` are the errors that its console has had."""

    def __init__(self, folder: Path, width: int = 1200, height: int = 900, scheme: str = "light"):
        commands, self.out = os.pipe()
        self.back, answers = os.pipe()
        redirect = f'exec "$@" 3<&{commands} 4>&{answers}'
        program = ["bash", "-c", redirect, "bash", found() or "", *FLAGS]
        self.process = subprocess.Popen(
            [*program, f"--user-data-dir={folder}"],
            pass_fds=(commands, answers),
            stderr=subprocess.DEVNULL,
        )
        os.close(commands)
        os.close(answers)
        self.faults: list[str] = []
        self.rest = b""
        self.count = 0
        self.session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1}
        self.call("Emulation.setDeviceMetricsOverride", **size, mobile=width < 500)
        feature = {"name": "prefers-color-scheme", "value": scheme}
        self.call("Emulation.setEmulatedMedia", features=[feature])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self.out)
        os.close(self.back)

    def call(self, method: str, **given: Any) -> dict[str, Any]:
        """The result of a method of the protocol."""
        self.count += 1
        asked = {"id": self.count, "method": method, "params": given}
        if self.session:
            asked["sessionId"] = self.session
        os.write(self.out, json.dumps(asked).encode() + b"\0")
        while True:
            said = self._next()
            if said.get("id") == self.count:
                assert "error" not in said, said
                return said["result"]

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self.rest:
            read = os.read(self.back, 1 << 20)
            assert read, "Chromium has ended"
            self.rest += read
        text, _, self.rest = self.rest.partition(b"\0")
        said = json.loads(text)
        method = said.get("method")
        if method == "Runtime.exceptionThrown":
            self.faults.append(json.dumps(said["params"]))
        if method == "Log.entryAdded" and said["params"]["entry"]["level"] == "error":
            self.faults.append(json.dumps(said["params"]))
        return said

    def run(self, script: str) -> Any:
        """The value of an expression of JavaScript, awaited."""
        given = {"returnByValue": True, "awaitPromise": True}
        found = self.call("Runtime.evaluate", expression=script, **given)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def press(self, key: str) -> None:
        """Press and release a key."""
        codes = {"Tab": 9, "ArrowRight": 39, "ArrowLeft": 37}
        given = {"key": key, "code": key, "windowsVirtualKeyCode": codes[key]}
        self.call("Input.dispatchKeyEvent", type="keyDown", **given)
        self.call("Input.dispatchKeyEvent", type="keyUp", **given)

    def picture(self, file: Path) -> None:
        """A picture of the whole page."""
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(shot["data"]))
