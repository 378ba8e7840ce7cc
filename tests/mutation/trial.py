"""A mutant tried in a copy of the source tree: the tree at hand is not touched."""

from __future__ import annotations

import os
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


class Outcome(NamedTuple):
    """What the tests said."""

    verdict: str
    """killed, timeout, survived."""
    by: str
    """The test that failed first."""
    seconds: float


class Copy:
    """The tracked and the new files of the tree, in a folder with its own cache of kernels."""

    def __init__(self, folder: Path) -> None:
        self._tree, self._kernels = folder / "tree", folder / "kernels"
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False
        listed = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard"],
            cwd=ROOT, check=True, text=True, capture_output=True,
        ).stdout.splitlines()  # fmt: skip
        for name in listed:
            if (ROOT / name).is_file():
                target = self._tree / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, target)

    def baseline(self, tests: Sequence[str]) -> Outcome:
        """The tests on the code as it is, kernels compiled anew.

        Raises:
            RuntimeError: they fail.
        """
        outcome = self._test(tests, limit_s=3600.0)
        if outcome.verdict != "survived":
            raise RuntimeError(f"without any mutant: {outcome}")
        return outcome

    def trial(self, mutant: Mutant, tests: Sequence[str], limit_s: float) -> Outcome:
        """What the tests say of a mutant."""
        module, kept = self._tree / mutant.module, set(self._caches())
        original = module.read_bytes()
        try:
            module.write_text(mutant.text(), encoding="utf-8")
            return self._test(tests, limit_s)
        finally:
            module.write_bytes(original)
            for folder in set(self._caches()) - kept:
                shutil.rmtree(folder)

    def stop(self) -> None:
        """End the tests that run, and begin no others."""
        self._stopped = True
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _caches(self) -> Iterable[Path]:
        return self._kernels.iterdir() if self._kernels.exists() else ()

    def _test(self, tests: Sequence[str], limit_s: float) -> Outcome:
        """Run pytest until the first failure."""
        environment = {
            **os.environ,
            "PYTHONPATH": str(self._tree),
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_CACHE_DIR": str(self._kernels),
        }
        begun = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", "--tb=no",
             "-m", "not ros and not slow", *tests],
            cwd=self._tree, env=environment, text=True, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        self._process = process
        try:
            output, _ = process.communicate(timeout=limit_s)
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
        failed = [line for line in output.splitlines() if line.startswith(("FAILED", "ERROR"))]
        return Outcome("killed", failed[0].split(" - ")[0] if failed else output[-200:], seconds)
