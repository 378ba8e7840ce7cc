"""Process that reads mesh files, with limits of memory and time.

    python -m space_robot.view.mesh_process MOST_FACES FOLDER < FILES

A file of a few megabytes may unpack to gigabytes, and the libraries for the formats check little.
FILES is a JSON list of paths. For file ``k`` the process writes ``FOLDER/k.npz``, or
``FOLDER/k.txt`` with the reason why it cannot be drawn. It may end before all files are written.
"""

from __future__ import annotations

import json
import resource
import signal
import sys
import zipfile
from pathlib import Path

import numpy as np

from .mesh import Mesh, simplify

MOST_BYTES = 2_000_000_000
"""Limit of the memory of the process."""
MOST_SECONDS = 60
"""Limit of the processor time per file."""
MOST_WAIT_S = 180
"""Limit of the wall-clock time per file; a file that refers to a pipe would never end."""
MOST_READ = 2_000_000
"""Limit of vertices, and of faces, of a file."""


TOO_MUCH = (
    f"reading it takes more than {MOST_BYTES / 1e9:g} GB of memory, {MOST_SECONDS} s of the "
    f"processor, or {MOST_WAIT_S} s"
)


class UnreadableMeshError(Exception):
    """A file cannot be drawn; the message has the reason."""


def read_mesh(file: str) -> Mesh:
    """Read a mesh file of any format supported by trimesh.

    Raises:
        UnreadableMeshError: the file cannot be drawn.
    """
    import trimesh

    if not Path(file).is_file():
        raise UnreadableMeshError("not a file" if Path(file).exists() else "no such file")
    _check_archive(file)
    try:
        read = trimesh.load_mesh(file)
        vertices, faces = np.asarray(read.vertices, dtype=np.float64), np.asarray(read.faces)
    except MemoryError:
        raise UnreadableMeshError(TOO_MUCH) from None
    except Exception as error:  # every format has its own types
        reason = str(error).strip().split("\n")[0] or type(error).__name__
        raise UnreadableMeshError(reason) from None
    for count, name in ((len(vertices), "vertices"), (len(faces), "faces")):
        if count > MOST_READ:
            raise UnreadableMeshError(f"{count} {name}, at most {MOST_READ} are allowed")
    mesh = Mesh(vertices, faces)
    check_drawable(mesh)
    return mesh


def check_drawable(mesh: Mesh) -> None:
    """Check that a mesh can be drawn.

    Raises:
        UnreadableMeshError: there are no faces, or vertices that are not finite.
    """
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise UnreadableMeshError("no faces with finite corners")


def _check_archive(file: str) -> None:
    """Check the unpacked size stated by an archive before unpacking.

    Raises:
        UnreadableMeshError: the size is too large.
    """
    if not zipfile.is_zipfile(file):
        return
    with zipfile.ZipFile(file) as archive:
        size = sum(info.file_size for info in archive.infolist())
    if size > MOST_BYTES:
        raise UnreadableMeshError(
            f"unpacks to {size / 1e9:.2g} GB, at most {MOST_BYTES / 1e9:g} GB are allowed"
        )


def limit_time() -> None:
    """Limit the processor and wall-clock time of this process from now on."""
    signal.alarm(MOST_WAIT_S)
    used = resource.getrusage(resource.RUSAGE_SELF)
    seconds = int(used.ru_utime + used.ru_stime) + 1 + MOST_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))


def main(most: int, folder: Path, files: list[str]) -> None:
    """Read mesh files and write one result per file into ``folder``."""
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    for number, file in enumerate(files):
        limit_time()
        try:
            whole = read_mesh(file)
            shown = simplify(whole, most)
            check_drawable(shown)
        except (UnreadableMeshError, MemoryError) as error:
            (folder / f"{number}.txt").write_text(str(error) or TOO_MUCH, "utf-8")
            continue
        np.savez(
            folder / f"{number}.npz",
            vertices=shown.vertices,
            faces=shown.faces,
            whole=len(whole.faces),
        )


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), json.load(sys.stdin))
