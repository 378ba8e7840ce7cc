"""A mutant tried in a copy of the source tree: the tree at hand is not touched."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import kernel_cache
from areas import ROOT
from mutants import Mutant

LIMIT_S = 1800.0
"""Time for the tests of one mutant; one that makes them hang is noticed."""
NO_TESTS = 5
"""Exit code of pytest if there is none."""
CACHE = "from space_robot_msgs_py.compiled.cache import cache_directory as c; print(c())"


class Outcome(NamedTuple):
    """What the tests said."""

    verdict: str
    """killed, timeout, survived."""
    by: str
    """The test that failed first; empty where not even the tests could be collected."""
    seconds: float


class Copy:
    """The tracked and the new files of the tree, in a folder with its own compiled kernels."""

    def __init__(self, folder: Path) -> None:
        self._tree, self._kernels, self._saved = (folder / n for n in ("tree", "kernels", "saved"))
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False
        self._passing: set[str] = set()
        self.failing: list[str] = []
        """Tests that fail without any mutant; they are left out."""
        listing = ["git", "ls-files", "-co", "--exclude-standard"]
        for name in subprocess.check_output(listing, cwd=ROOT, text=True).splitlines():
            if (ROOT / name).is_file():
                target = self._tree / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, target)
        here = subprocess.check_output([sys.executable, "-c", CACHE], cwd=ROOT, text=True)
        self._known = self._cache()
        kernel_cache.seed(self._known, self._tree, Path(here.strip()))

    def trial(self, mutant: Mutant, tests: Sequence[str], marks: str) -> Outcome:
        """Run the tests on a mutant."""
        while True:
            outcome = self._mutated(mutant, tests, marks)
            if outcome.verdict != "killed" or outcome.by in self._passing:
                return outcome
            if self._test([outcome.by or tests[0]], marks).verdict == "survived":
                self._passing.add(outcome.by)
                return outcome
            if not outcome.by:
                raise RuntimeError(f"{tests[0]} cannot be collected without any mutant")
            self.failing.append(outcome.by)

    def _mutated(self, mutant: Mutant, tests: Sequence[str], marks: str) -> Outcome:
        module = self._tree / mutant.module
        shutil.copy2(module, self._saved)
        cache = self._known
        try:
            module.write_text(mutant.text(), encoding="utf-8")
            with suppress(subprocess.CalledProcessError):
                cache = self._cache()
            if cache != self._known:
                kernel_cache.reuse(self._known, self._tree, cache, mutant.module)
            return self._test(tests, marks)
        finally:
            os.replace(self._saved, module)  # with its time, by which Numba knows its kernels
            if cache != self._known:
                shutil.rmtree(cache)

    def stop(self) -> None:
        """End the tests that run, and begin no others."""
        self._stopped = True
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _environment(self) -> dict[str, str]:
        own = {"PYTHONPATH": self._tree, "NUMBA_CACHE_DIR": self._kernels}
        return {**os.environ, **{k: str(v) for k, v in own.items()}, "PYTHONDONTWRITEBYTECODE": "1"}

    def _cache(self) -> Path:
        """Return the folder of the kernels of the tree as it is now."""
        command, environment = [sys.executable, "-c", CACHE], self._environment()
        output = subprocess.check_output(command, cwd=self._tree, env=environment, text=True)
        return Path(output.strip())

    def _test(self, tests: Sequence[str], marks: str) -> Outcome:
        """Run pytest until the first failure."""
        begun = time.monotonic()
        options = ["-x", "-q", "-p", "no:cacheprovider", "--tb=no", "-m", marks]
        options += [f"--deselect={name}" for name in self.failing]
        process = self._process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=self._tree,
            env=self._environment(),
            text=True,
            start_new_session=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
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
        if process.returncode in (0, NO_TESTS):
            return Outcome("survived", "", seconds)
        failed = re.findall(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", output, re.MULTILINE)
        return Outcome("killed", failed[0] if failed else "", seconds)
