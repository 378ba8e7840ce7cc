"""A mutant tried in a copy of the source tree: the tree at hand is not touched."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from areas import ROOT
from mutants import Mutant

LIMIT_S = 400.0
"""Time for the tests of one mutant; one that makes them hang is noticed."""


class Outcome(NamedTuple):
    """What the tests said."""

    verdict: str
    """killed, timeout, survived."""
    by: str
    """The test that failed first; empty where not even the tests could be collected."""
    seconds: float


class Copy:
    """The tracked and the new files of the tree, in a folder with its own cache of kernels."""

    def __init__(self, folder: Path) -> None:
        self._tree, self._kernels = folder / "tree", folder / "kernels"
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False
        self._passing: set[str] = set()
        listed = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard"],
            cwd=ROOT,
            check=True,
            text=True,
            capture_output=True,
        ).stdout.splitlines()
        for name in listed:
            if (ROOT / name).is_file():
                target = self._tree / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, target)

    def trial(self, mutant: Mutant, tests: Sequence[str], marks: str) -> Outcome:
        """Run the tests on a mutant.

        Raises:
            RuntimeError: the test that fails also fails without the mutant.
        """
        module, kept = self._tree / mutant.module, set(self._caches())
        original = module.read_bytes()
        try:
            module.write_text(mutant.text(), encoding="utf-8")
            outcome = self._test(tests, marks)
        finally:
            module.write_bytes(original)
            for folder in set(self._caches()) - kept:
                shutil.rmtree(folder)
        if outcome.verdict == "killed" and outcome.by not in self._passing:
            without = self._test([outcome.by or tests[0]], marks)
            if without.verdict != "survived":
                raise RuntimeError(f"without any mutant: {without}")
            self._passing.add(outcome.by)
        return outcome

    def stop(self) -> None:
        """End the tests that run, and begin no others."""
        self._stopped = True
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _caches(self) -> Iterable[Path]:
        return self._kernels.iterdir() if self._kernels.exists() else ()

    def _test(self, tests: Sequence[str], marks: str) -> Outcome:
        """Run pytest until the first failure."""
        environment = {
            **os.environ,
            "PYTHONPATH": str(self._tree),
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_CACHE_DIR": str(self._kernels),
        }
        begun = time.monotonic()
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "pytest",
                "-x",
                "-p",
                "no:cacheprovider",
                "--tb=no",
                "-m",
                marks,
                *tests,
            ],
            cwd=self._tree,
            env=environment,
            text=True,
            start_new_session=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self._process = process
        try:
            output, _ = process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            return Outcome("timeout", "", time.monotonic() - begun)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            self._process = None
        if self._stopped:
            raise RuntimeError("stopped")
        seconds = time.monotonic() - begun
        if process.returncode == 0:
            return Outcome("survived", "", seconds)
        failed = re.findall(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", output, re.MULTILINE)
        return Outcome("killed", failed[0] if failed else "", seconds)
