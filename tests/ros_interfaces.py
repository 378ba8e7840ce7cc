"""ROS packages of interfaces that are on no index, built from their definitions.

ROS's own generators make the code, as in any workspace; gcc compiles it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

DEFINITIONS = Path(__file__).parent / "interfaces"
GENERATORS = """
import sys
from pathlib import Path

from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

package, share, out, *files = sys.argv[1:]
kinds = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]
for name, generator in {
    "rosidl_generator_c": GenerateC("c"),
    "rosidl_typesupport_fastrtps_c": GenerateFastRTPSCTypesupport("fastrtps_c"),
    "rosidl_typesupport_introspection_c": GenerateIntrospectionCTypesupport("introspection_c"),
    "rosidl_typesupport_c": GenerateCTypesupport("c", typesupport_implementations=kinds),
    ".": GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]),
}.items():
    generator.generate(package, files, [share], output_path=Path(out, name, package))
"""
LIBRARIES = (
    "rosidl_generator_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_introspection_c",
    "rosidl_typesupport_c",
)
"""A shared library each, as in a workspace: the last one finds the others by their names."""


def has_compilers() -> bool:
    """Return whether a package can be built here."""
    return shutil.which("gcc") is not None and shutil.which("g++") is not None


def build(package: str, depends: Sequence[str], folder: Path) -> None:
    """Build a package of `DEFINITIONS` into ``folder``, from where Python imports it."""
    prefix, source = Path(sys.prefix), DEFINITIONS / package
    files = [
        f"{source}:{file.relative_to(source)}" for file in sorted(source.rglob("*")) if file.suffix
    ]
    words = [sys.executable, "-c", GENERATORS, package, str(prefix / "share"), str(folder), *files]
    run(words, {**os.environ, "AMENT_PREFIX_PATH": str(prefix)})
    includes = [*(folder / name for name in LIBRARIES), *(prefix / "include").iterdir()]
    includes += [prefix / "include", sysconfig.get_path("include"), np.get_include()]
    options = ["-O0", "-fPIC", "-w", *(f"-I{path}" for path in includes)]
    links = [f"-L{prefix / 'lib'}", f"-Wl,-rpath,{prefix / 'lib'}", f"-Wl,-rpath,{folder}"]
    links += ["-Wl,--no-as-needed", "-lrosidl_runtime_c", "-lrosidl_typesupport_c", "-lfastcdr"]
    links += ["-lrosidl_typesupport_fastrtps_c", "-lrosidl_typesupport_introspection_c"]
    links += [
        str(prefix / "lib" / f"lib{name}__{kind}.so")
        for name in (*depends, "action_msgs", "service_msgs", "unique_identifier_msgs")
        for kind in (*LIBRARIES, "rosidl_generator_py")
    ]
    for name in LIBRARIES:
        library = folder / f"lib{package}__{name}.so"
        link(library, folder / name, options, [f"-Wl,-soname,{library.name}", *links])
        links.append(str(library))
    module = f"{package}_s__rosidl_typesupport_c{sysconfig.get_config_var('EXT_SUFFIX')}"
    link(folder / package / module, folder / package, options, links)


def link(library: Path, folder: Path, options: Sequence[str], links: Sequence[str]) -> None:
    """Build a shared library of all sources of a folder."""
    sources = sorted(file for file in folder.rglob("*") if file.suffix in (".c", ".cpp"))
    with ThreadPoolExecutor(2) as pool:
        objects = list(pool.map(lambda file: compiled(file, options), sources))
    run(["g++", "-shared", "-o", str(library), *map(str, objects), *links])


def compiled(source: Path, options: Sequence[str]) -> Path:
    """Compile a file; return the object's."""
    result = source.with_name(f"{source.name}.o")
    compiler = ["g++", "-std=c++17"] if source.suffix == ".cpp" else ["gcc"]
    run([*compiler, *options, "-c", str(source), "-o", str(result)])
    return result


def run(words: Sequence[str], environment: dict[str, str] | None = None) -> None:
    """Run a command that must succeed."""
    done = subprocess.run(words, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
