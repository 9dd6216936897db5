"""kill -9 at random moments: whatever is on disk opens, no accepted step is lost, and the run ends
as if never killed.

``pytest tests/test_kill.py --kills 50`` kills more often.
"""

import random
import time
from pathlib import Path

from tests import forked
from tests.output.run_files import accepted_steps, same_run
from tests.test_cli import SCENE

OPTIONS = ["--set", "joint.relative_element_size=0.3", "--set", "load.steps=15"]


class Run:
    """An ``archord solve`` in a process of its own; ``printed`` is the last step that it
    reported."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.out = folder / "out"
        self.err = folder / "err"
        for file in (self.out, self.err):
            file.write_text("")
        self.process = forked.start(["solve", *arguments], folder, self.out, self.err)
        while self.process.is_alive() and not self.out.stat().st_size:
            time.sleep(0.002)
        self.begun = time.monotonic()

    def end(self, after: float | None = None) -> int:
        """Wait until it ends, or for ``after`` seconds and kill it; the exit code."""
        self.process.join(after)
        self.process.kill()
        self.process.join()
        code = self.process.exitcode
        if code not in (0, -9):
            raise AssertionError(self.err.read_text())
        return code

    @property
    def printed(self) -> int:
        lines = self.out.read_text().rpartition("\n")[0].splitlines()
        first = [line.split()[0] for line in lines if line.strip() and "steps in" not in line]
        return max((int(word) for word in first if word.isdigit()), default=0)


def test_a_run_survives_any_number_of_kills(tmp_path, request):
    """Killed at random and restarted until the kills are used up; finished runs are compared, and
    the next begins."""
    kills = request.config.getoption("--kills")
    chance = random.Random(1)
    whole = Run(tmp_path, SCENE, *OPTIONS, "-o", "whole")
    assert whole.end() == 0
    seconds = time.monotonic() - whole.begun
    assert accepted_steps(tmp_path / "whole") == whole.printed == 15
    finished = steps = 0
    caught_at: list[int] = []
    while len(caught_at) < kills or steps:
        folder = tmp_path / f"run{finished}"
        run = Run(
            tmp_path,
            SCENE,
            *OPTIONS,
            "-o",
            folder.name,
            *(["--restart"] if folder.exists() else []),
        )
        code = run.end(chance.uniform(0, 0.7 * seconds) if len(caught_at) < kills else None)
        before = steps
        steps = accepted_steps(folder) if folder.exists() else 0
        assert steps >= max(before, run.printed)
        if code != 0:
            caught_at.append(steps)
            continue
        assert steps == 15
        same_run(tmp_path / "whole", folder, 1e-12)
        finished = finished + 1
        steps = 0
    assert finished > 0
    assert (
        len(set(caught_at)) > min(kills, 10) / 3
    )  # at steps all over the path, on a busy machine at fewer of them
