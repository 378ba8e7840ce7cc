"""Reads mesh files in a process of its own: memory and time of that process are limited.

    python -m space_robot.view.mesh_process MOST_FACES FOLDER < FILES

A file of a few megabytes may unpack to gigabytes, and the libraries that read the many formats
check little. FILES is a JSON list of paths. For file ``k`` the process writes ``FOLDER/k.npz``, or
``FOLDER/k.txt`` with the reason why it cannot be drawn. It may end before it has written all.
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
"""Memory of the process."""
MOST_SECONDS = 60
"""Processor time for each file."""
MOST_WAIT_S = 180
"""Time for each file by the wall clock: one that refers to a pipe is never read to its end."""
MOST_READ = 2_000_000
"""Vertices, and faces, of a file."""


TOO_MUCH = (
    f"reading it takes more than {MOST_BYTES / 1e9:g} GB of memory, {MOST_SECONDS} s of the "
    f"processor, or {MOST_WAIT_S} s"
)


class UnreadableMeshError(Exception):
    """A file cannot be drawn; the message says why."""


def read_mesh(file: str) -> Mesh:
    """Read a mesh file of any format that trimesh reads.

    Raises:
        UnreadableMeshError: it cannot be drawn.
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
    except Exception as error:  # as many types as there are formats
        reason = str(error).strip().split("\n")[0] or type(error).__name__
        raise UnreadableMeshError(reason) from None
    for count, name in ((len(vertices), "vertices"), (len(faces), "faces")):
        if count > MOST_READ:
            raise UnreadableMeshError(f"{count} {name}, at most {MOST_READ} are allowed")
    mesh = Mesh(vertices, faces)
    check_drawable(mesh)
    return mesh


def check_drawable(mesh: Mesh) -> None:
    """Check that there is something to draw.

    Raises:
        UnreadableMeshError: there are no faces, or vertices that are not finite.
    """
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise UnreadableMeshError("no faces with finite corners")


def _check_archive(file: str) -> None:
    """Check the size that an archive states before anything is unpacked.

    Raises:
        UnreadableMeshError: it is too large.
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
    """Let this process end if it takes longer than allowed from now on."""
    signal.alarm(MOST_WAIT_S)
    used = resource.getrusage(resource.RUSAGE_SELF)
    seconds = int(used.ru_utime + used.ru_stime) + 1 + MOST_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))


def main(most: int, folder: Path, files: list[str]) -> None:
    """Write one file for each mesh into ``folder``."""
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
