"""Code generation by numba: a plain Python function in, a relocatable object out.

Numba offers no public way to emit objects: its ``pycc`` needs a C compiler and a linker.

Plain functions need no decorator. Numba asks for the type of every global name that a function uses; while this file
compiles, the type of a plain Python function is that of the function compiled. Numba itself thereby finds exactly the
functions that are needed, in module attributes and defaults too.

A function of an object is neither wrapped for Python nor optimised nor loaded on its own: it is linked into the one
that calls it, and only the whole is optimised and emitted. That is most of the time that numba takes.
"""

import atexit
import gc
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import mujoco
import numpy as np

from spherical_wrist.compat import MissingPartError, private
from spherical_wrist.errors import WristError, one_line

LIBRARY = "numba"

try:
    import numba
    from llvmlite import ir
    from numba.core import cgutils, compiler, typed_passes, types, untyped_passes
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.compiler_machinery import PassManager
    from numba.core.errors import NumbaExperimentalFeatureWarning
    from numba.core.registry import cpu_target
    from numba.core.typing.typeof import typeof_impl
    from numba.np.arrayobj import populate_array
except ImportError as error:
    if error.name is None or "segment" in str(error):  # there is one, but for instance memory for it is lacking
        raise
    raise MissingPartError(LIBRARY, str(error.name)) from None
except ValueError as error:  # raised for its environment variables
    raise WristError(f"numba cannot be loaded: {one_line(error)} (are its variables NUMBA_... set?)") from None

if numba.config.DISABLE_JIT:
    raise WristError("NUMBA_DISABLE_JIT is set, and numba compiles the closed loop: unset it")


@atexit.register
def _end_quickly() -> None:
    """Skip Python's garbage collection of numba's objects when the process ends, which takes half a second."""
    if "_duckdb" not in sys.modules:  # it complains of objects that nobody frees
        gc.freeze()


_target, _typing = cpu_target.target_context, cpu_target.typing_context
for _owner, _part in (
    (_target, "_internal_codegen"),
    (_typing, "_lookup_global"),
    (JITCPUCodegen, "_library_class"),
    (JITCPUCodegen, "set_env"),
):
    private(LIBRARY, _owner, _part)


UNUSED_PASSES = {
    untyped_passes.WithLifting,
    untyped_passes.InlineClosureLikes,
    untyped_passes.DeadBranchPrune,
    untyped_passes.MakeFunctionToJitFunction,
    untyped_passes.InlineInlinables,
    untyped_passes.LiteralUnroll,
    typed_passes.InlineOverloads,
    typed_passes.NopythonRewrites,
}
"""Passes for contexts, closures, loops over tuples of different types and array expressions."""


class _ScalarPasses(compiler.CompilerBase):  # type: ignore[misc]
    """Numba's passes but for those that find nothing in functions of plain loops over scalars: a tenth of the time."""

    def define_pipelines(self) -> list[Any]:
        """Return the only pipeline."""
        every = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        needed = PassManager("nopython")
        for each, description in every.passes:
            if each not in UNUSED_PASSES:
                needed.add_pass(each, description)
        needed.finalize()
        return [needed]


def _options(function: FunctionType, task: "Task") -> dict[str, Any]:
    """Return numba's options."""
    wrappers, foreign = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}, task.foreign(function)
    return {**wrappers, "error_model": "numpy", "boundscheck": foreign, "_nrt": foreign}


def _pipeline(function: FunctionType, task: "Task") -> Any:
    """Return the passes for a function: all for a user's, and for one with a loop that is unrolled."""
    return compiler.Compiler if task.foreign(function) or _unrolled(function, task) else _ScalarPasses


class Task(NamedTuple):
    """Settings of a compilation.

    Attributes:
        foreign: tells functions of a user. Their indices are checked, since out of range they would write into foreign
            memory, and they may allocate arrays, so that they count references.
        replaced: intrinsics, types of C functions, or functions of numba, by the Python function that they stand for.
    """

    foreign: Callable[[Any], bool]
    replaced: Mapping[Any, Any]


class ObjectCode(NamedTuple):
    """A compiled function.

    Attributes:
        symbol: name of the function in the object.
        returned: numba's type of its result.
        imports: external symbols that it refers to.
        code: the object file.
    """

    symbol: str
    returned: Any
    imports: tuple[str, ...]
    code: bytes


def emit(function: FunctionType, arguments: tuple[Any, ...], task: Task) -> ObjectCode:
    """Compile a function and all functions that it names.

    Args:
        function: plain Python function.
        arguments: numba's types of its arguments.
        task: settings.

    Raises:
        TypeError: the function refers to an object of this process.
        Exception: numba cannot compile it.
    """
    with _compiling(task) as codegen, warnings.catch_warnings():
        # a state that begins like another law's has its fields at the same places, and shares its helpers
        warnings.filterwarnings("ignore", "Record.*subtype", NumbaExperimentalFeatureWarning)
        flags = compiler.Flags()
        cpu_target.options.parse_as_flags(flags, {"nopython": True, **_options(function, task)})
        flags.no_compile = True
        whole = codegen.create_library(function.__qualname__)
        whole.enable_object_caching()
        done = compiler.compile_extra(
            *(_typing, _target, function, arguments, None, flags, {}),
            library=whole,
            pipeline_class=_pipeline(function, task),
        )
        whole.link()
        module, symbol = whole._final_module, done.fndesc.llvm_func_name
        for each in module.functions:
            if not each.is_declaration and each.name != symbol:
                each.linkage = "internal"  # what is inlined everywhere is then left out
        options = llvm.create_pipeline_tuning_options(speed_level=3)
        builder = llvm.create_pass_builder(codegen._tm, options)
        passes = builder.getModulePassManager()
        passes.add_refprune_pass()
        passes.run(module, builder)
        unused = llvm.create_new_module_pass_manager()
        unused.add_global_dead_code_eliminate_pass()
        unused.add_strip_dead_prototype_pass()
        unused.run(module, builder)
        module.verify()
        if any(each.name.startswith("numba.dynamic.globals") for each in module.global_variables):
            raise TypeError("it refers to an object of this process, which machine code that is kept cannot")
        imports = tuple(
            each.name
            for each in (*module.functions, *module.global_variables)
            if each.is_declaration and not each.name.startswith("llvm.")
        )
        return ObjectCode(symbol, done.signature.return_type, imports, codegen._tm.emit_object(module))


def compiled_files() -> set[Path]:
    """Return the source files of all functions compiled so far in this process."""
    return {Path(function.__code__.co_filename) for function in _compiled}


def provide_runtime() -> None:
    """Make numba's own C functions known to the loader, for laws that allocate arrays or format messages."""
    from numba.core.runtime import rtsys

    rtsys.initialize(_target)
    numba.njit(lambda: np.zeros(1).size)()  # whatever else numba sets up at its first compilation


# --- functions that have no Python


class Address(types.Callable):  # type: ignore[misc]
    """The address of compiled code, called like a function; numba's own kind also looks for Python functions."""

    def __init__(self, name: str, signature: Any) -> None:
        self.signature = signature
        super().__init__(name)

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Return the signature."""
        return self.signature.replace(recvr=self)

    def get_call_signatures(self) -> Any:
        """Return the only signature."""
        return [self.signature], False

    def get_impl_key(self, sig: Any) -> Any:
        """Return the key of the code that makes the call."""
        return type(self)


numba.extending.register_model(Address)(
    lambda manager, kind: numba.extending.models.PrimitiveModel(manager, kind, ir.IntType(64))
)


@numba.extending.lower_builtin(Address, types.VarArg(types.Any))  # type: ignore[untyped-decorator]
def _call_address(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0].signature
    code = context.call_conv.get_function_type(kind.return_type, kind.args).as_pointer()
    function = builder.inttoptr(arguments[0], code)
    status, result = context.call_conv.call_function(builder, function, kind.return_type, kind.args, arguments[1:])
    with cgutils.if_unlikely(builder, status.is_error):
        context.call_conv.return_status_propagate(builder, status)
    return result


def function_at(kind: Address) -> Any:
    """Return an intrinsic that takes an integer for the address of compiled code of a kind."""

    @numba.extending.intrinsic  # type: ignore[untyped-decorator]
    def at(typing_context: Any, address: Any) -> Any:
        return kind(types.intp), lambda context, builder, signature, arguments: arguments[0]

    return at


def array_at(kind: Any) -> Any:
    """Return an intrinsic that takes an entry with address, rows and columns for an array of a type."""

    @numba.extending.intrinsic  # type: ignore[untyped-decorator]
    def at(typing_context: Any, entry: Any) -> Any:
        return kind(entry), _generate_array

    return at


@numba.extending.intrinsic  # type: ignore[untyped-decorator]
def records_at(typing_context: Any, entry: Any, element: Any) -> Any:
    """Take an entry with address, rows and columns for an array of records."""
    return types.Array(element.dtype, 1, "C")(entry, element), _generate_array


def _generate_array(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, entry, word = signature.return_type, signature.args[0], context.get_value_type(types.intp)
    address, rows, columns = (
        builder.load(cgutils.get_record_member(builder, arguments[0], entry.offset(name), word))
        for name in ("address", "rows", "columns")
    )
    size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    shape, strides = [rows], [size]
    if kind.ndim == 2:
        shape, strides = [rows, columns], [builder.mul(columns, size), size]
    elif kind.layout != "C":
        strides = [builder.mul(columns, size)]
    array = context.make_array(kind)(context, builder)
    data = builder.inttoptr(address, array.data.type)
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
    return array._getvalue()


@numba.extending.intrinsic  # type: ignore[untyped-decorator]
def address_of(typing_context: Any, array: Any) -> Any:
    """Return the address of the numbers of an array."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.ptrtoint(data, context.get_value_type(types.intp))

    return types.intp(array), generate


# --- the types of plain functions

_task: Task | None = None
"""Set while this file compiles, under numba's own lock; at other times numba behaves as without this file."""

_compiled: dict[FunctionType, Any] = {}
_default_type = typeof_impl.dispatch(object)


def _type_of_function(function: Any, context: Any) -> Any:
    if _task is not None and _typing._lookup_global(function) is None:
        if function in _task.replaced:
            found = _task.replaced[function]
            return found if isinstance(found, types.Type) else _typing.resolve_value_type(found)
        if isinstance(function, FunctionType):
            if function not in _compiled:
                options = {**_options(function, _task), "pipeline_class": _pipeline(function, _task)}
                _compiled[function] = numba.njit(**options)(_unrolling(function, _task))
            return types.Dispatcher(_compiled[function])
    return _default_type(function, context)


def _unrolled(function: FunctionType, task: Task) -> dict[str, Any]:
    """Return numba's own ``literal_unroll`` by the global names of its stand-in in a function."""
    return {
        name: numba.literal_unroll
        for name in function.__code__.co_names
        if isinstance(named := function.__globals__.get(name), FunctionType)
        and task.replaced.get(named) is numba.literal_unroll
    }


def _unrolling(function: FunctionType, task: Task) -> FunctionType:
    """Return a function that names numba's own ``literal_unroll`` in place of the stand-in.

    Numba looks for that object before it asks for types.
    """
    found = _unrolled(function, task)
    if not found:
        return function
    scope = {**function.__globals__, **found}
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    copy.__qualname__ = function.__qualname__
    return copy


for _kind in (FunctionType, type(mujoco.mj_step)):
    typeof_impl.register(_kind, _type_of_function)


# --- code generation


class _Fragment(JITCodeLibrary):  # type: ignore[misc]
    """A function on its way into an object: neither optimised nor loaded, and linked once, with all that it needs."""

    def finalize(self) -> None:
        """Leave everything else to the function that is compiled for."""
        self._finalized = True

    def link(self) -> None:
        """Link all functions that this one calls, and those that they call."""
        found, waiting = {self}, [self]
        while waiting:
            for each in waiting.pop()._linking_libraries:
                if each not in found:
                    found.add(each)
                    waiting.append(each)
                    self._final_module.link_in(each._final_module, preserve=True)

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0


class _Codegen(JITCPUCodegen):  # type: ignore[misc]
    _library_class = _Fragment

    def set_env(self, env_name: str, env: Any) -> None:
        """Leave out the data for Python exceptions: callers only see that a function failed."""


_codegen = cache(lambda: _Codegen("spherical_wrist"))


@contextmanager
def _compiling(task: Task) -> Iterator[Any]:
    """Let numba compile for an object, in this thread only."""
    global _task  # noqa: PLW0603
    with global_compiler_lock:
        before, collecting = (_target._internal_codegen, _task), gc.isenabled()
        codegen = _target._internal_codegen = _codegen()
        _task = task
        gc.disable()  # looking for garbage among what numba makes is a tenth of the time
        try:
            _typing.refresh()
            _target.refresh()
            yield codegen
        finally:
            _target._internal_codegen, _task = before
            if collecting:
                gc.enable()
