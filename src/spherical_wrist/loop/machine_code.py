"""Machine code kept as relocatable objects: load one and call its function from Python.

LLVM's loader is all that this needs: numba stays out of a process that finds its objects in the cache.
"""

import ctypes
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np

from spherical_wrist.compat.libmujoco import library

DESTRUCTOR = "NRT_MemInfo_call_dtor"


class MachineCode(NamedTuple):
    """A compiled function as an object file.

    Attributes:
        symbol: name of the function in the object.
        words: number of 64-bit integers that it returns.
        imports: external symbols that it calls.
        code: the object file.
    """

    symbol: str
    words: int
    imports: tuple[str, ...]
    code: bytes


class CompiledError(Exception):
    """Compiled code ended with an exception; only running the same step in plain Python tells which."""


class Compiled:
    """A compiled function.

    The C function behind it returns a status, 0 for success, and takes only pointers and integers: where to write the
    result, where to write an exception, then the arguments. An array is passed as numba's array structure (two null
    owners, size, item size, address, shape, strides), a law as the address of its step, a tuple as its elements.
    Calling it releases Python's lock.

    Attributes:
        address: address of the C function.
    """

    def __init__(self, address: int, words: int) -> None:
        self.address, self._words = address, words

    def __call__(self, *arguments: Any) -> Any:
        """Call the function with addresses of records, integers, contiguous arrays, laws and tuples of these.

        Returns:
            None, an integer, or a tuple of integers.

        Raises:
            CompiledError: the code raised.
        """
        return self.bound(*arguments)()

    def bound(self, *arguments: Any) -> Callable[[], Any]:
        """Return a call with these arguments, for one thread at a time: it costs less where they stay the same."""
        words = [ctypes.c_int64(word) for argument in arguments for word in _words(argument)]
        result, error = (ctypes.c_int64 * max(self._words, 1))(), ctypes.c_void_p()
        function = _prototype(len(words))(self.address)
        every = (ctypes.c_void_p(ctypes.addressof(result)), ctypes.c_void_p(ctypes.addressof(error)), *words)

        def call(_: Any = (arguments, result, error)) -> Any:  # which live as long as this does
            if function(*every) != 0:
                raise CompiledError("an exception in compiled code")
            return None if self._words == 0 else result[0] if self._words == 1 else tuple(result)

        return call


def load(code: MachineCode) -> Compiled | None:
    """Load machine code into the process; None if something that it calls is missing."""
    _prepare()
    if not all(map(llvm.address_of_symbol, code.imports)):
        return None
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code.code))
    engine.finalize_object()
    _engines.append(engine)
    address = engine.get_function_address(code.symbol)
    return Compiled(address, code.words) if address else None


_engines: list[Any] = []
"""The engines own the memory of the code."""


@cache
def processor() -> str:
    """Return LLVM's name of this machine's processor; another one may round in other places."""
    return str(llvm.get_host_cpu_name())


@cache
def processor_features() -> str:
    """Return the instruction sets of this machine's processor."""
    return str(llvm.get_host_cpu_features().flatten())


@cache
def _prepare() -> None:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    llvm.load_library_permanently(str(library()))
    if not llvm.address_of_symbol(DESTRUCTOR):
        # numba counts references to the owner of an array; ours have none, so that none is ever released
        llvm.add_symbol(DESTRUCTOR, ctypes.cast(ctypes.CDLL(None).abort, ctypes.c_void_p).value)


@cache
def _prototype(words: int) -> Callable[[int], Callable[..., int]]:
    return ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int64] * words)


def _words(argument: Any) -> Iterator[int]:
    if isinstance(argument, np.ndarray):
        # only the counters of MuJoCo's warnings, of int32, are declared with a stride
        if not argument.flags.c_contiguous and argument.dtype != np.int32:
            raise ValueError(f"compiled code takes contiguous arrays, not one with strides {argument.strides}")
        yield from (0, 0, argument.size, argument.itemsize, argument.ctypes.data, *argument.shape, *argument.strides)
    elif isinstance(argument, tuple):
        for each in argument:
            yield from _words(each)
    elif isinstance(argument, Compiled):
        yield argument.address
    elif isinstance(argument, np.void):
        yield argument.__array_interface__["data"][0]  # an element of an array of records
    else:
        yield argument
