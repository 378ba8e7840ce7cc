"""The system's C compiler, and libraries kept in the cache of compiled kernels."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

from space_robot_msgs_py.compiled.cache import cache_directory
from space_robot_msgs_py.errors import InputError

from .folder import FLAGS

COMPILERS = ("cc", "gcc", "clang")


def find_compiler() -> str:
    """Return the C compiler: ``CC``, or the first of `COMPILERS` that is there.

    Raises:
        InputError: there is none.
    """
    wanted = [os.environ["CC"]] if os.environ.get("CC") else list(COMPILERS)
    for name in wanted:
        if shutil.which(name):
            return name
    raise InputError(
        f"no C compiler ({', '.join(wanted)}) was found: install gcc or clang, or set CC"
    )


def write_sources(folder: Path, sources: Mapping[PurePosixPath, str]) -> list[str]:
    """Write source files; return the paths of those to be compiled."""
    for path, text in sources.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return [str(folder / path) for path in sorted(sources) if path.suffix == ".c"]


def build_library(
    sources: Mapping[PurePosixPath, str], flags: Sequence[str] = FLAGS, compiler: str = ""
) -> Path:
    """Return a shared library of sources, from the cache if it is there.

    Raises:
        InputError: there is no compiler, or it fails.
    """
    compiler = compiler or find_compiler()
    command = [compiler, *flags, "-shared", "-fPIC"]
    version = subprocess.run([compiler, "--version"], capture_output=True, check=False).stdout
    digest = hashlib.sha256(version + repr(command).encode())
    for path, text in sorted(sources.items()):
        digest.update(f"{path}\0{text}\0".encode())
    library = cache_directory() / f"flight_{digest.hexdigest()[:24]}.so"
    if library.exists():
        return library
    with tempfile.TemporaryDirectory(prefix="space_robot_") as name:
        folder = Path(name)
        files = write_sources(folder, sources)
        built = folder / "library.so"
        includes = [f"-I{folder / 'include'}", f"-I{folder}"]
        run = subprocess.run(
            [*command, *includes, "-o", str(built), *files, "-lm"],
            capture_output=True,
            text=True,
            check=False,
        )
        if run.returncode:
            reason = next((line for line in run.stderr.splitlines() if "error" in line), run.stderr)
            raise InputError(f"{compiler} cannot compile the flight code: {reason.strip()}")
        shutil.move(built, temporary := library.with_suffix(f".{os.getpid()}"))
        os.replace(temporary, library)
    return library
