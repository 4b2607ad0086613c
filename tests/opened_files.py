"""The files that MuJoCo opens for a model, as it tells itself.

A virtual file system of libmujoco is asked for every file. This one passes on those of the disk, and keeps their names.
The bindings have the type ``MjVfs``, but no way to mount a provider of one's own.
"""

import ctypes
import os
from pathlib import Path
from typing import Any

from spherical_wrist.compat.libmujoco import library, warnings_kept_in_data


class Resource(ctypes.Structure):
    """Beginning of ``mjResource``."""

    _fields_ = (("name", ctypes.c_char_p), ("data", ctypes.c_void_p))


ON_RESOURCE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(Resource))
ON_READ = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(Resource), ctypes.POINTER(ctypes.c_void_p))
ON_CLOSE = ctypes.CFUNCTYPE(None, ctypes.POINTER(Resource))


class Provider(ctypes.Structure):
    """``mjpResourceProvider``; without a time of change, MuJoCo reads every file anew."""

    _fields_ = (
        ("prefix", ctypes.c_char_p),
        *(("open", ON_RESOURCE), ("read", ON_READ), ("close", ON_CLOSE), ("mount", ON_RESOURCE)),
        *((name, ctypes.c_void_p) for name in ("unmount", "modified", "write", "data")),
    )


@warnings_kept_in_data()
def opened_files(model: Path) -> tuple[set[Path], set[Path]]:
    """Read and compile a valid model; return the files that MuJoCo looked for, and those that it read."""
    asked, read, buffers = set[Path](), set[Path](), dict[bytes, Any]()

    def opened(resource: Any) -> int:
        path = Path(os.fsdecode(resource.contents.name))
        asked.add(path)
        return int(path.is_file())

    def contents(resource: Any, buffer: Any) -> int:
        path = Path(os.fsdecode(resource.contents.name))
        read.add(path)
        content = path.read_bytes()
        kept = buffers.setdefault(resource.contents.name, ctypes.create_string_buffer(content, len(content)))
        buffer[0] = ctypes.cast(kept, ctypes.c_void_p).value
        return len(content)

    provider = Provider(
        open=ON_RESOURCE(opened),
        read=ON_READ(contents),
        close=ON_CLOSE(lambda resource: None),
        mount=ON_RESOURCE(lambda resource: 0),
    )
    mujoco, pointer, text = ctypes.CDLL(str(library())), ctypes.c_void_p, ctypes.c_char_p
    mujoco.mj_mountVFS.argtypes = pointer, text, pointer
    mujoco.mj_parseXML.argtypes, mujoco.mj_parseXML.restype = (text, pointer, text, ctypes.c_int), pointer
    mujoco.mj_compile.argtypes, mujoco.mj_compile.restype = (pointer, pointer), pointer
    system, reason = pointer(), ctypes.create_string_buffer(1000)
    here = ctypes.byref(system)
    mujoco.mj_defaultVFS(here)
    for folder in (
        Path("/"),
        Path("/.."),
        *Path("/").iterdir(),
    ):  # MuJoCo looks for a provider at a file's folders, up to these
        mujoco.mj_mountVFS(here, os.fsencode(folder), ctypes.byref(provider))
    spec = mujoco.mj_parseXML(os.fsencode(model), here, reason, len(reason))
    assert spec, reason.value
    compiled = mujoco.mj_compile(spec, here)
    assert compiled
    mujoco.mj_deleteModel(pointer(compiled))
    mujoco.mj_deleteSpec(pointer(spec))
    mujoco.mj_deleteVFS(here)
    return asked, read
