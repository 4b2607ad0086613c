"""What numba has no function for, in LLVM's terms. Numba itself is handed in: it is imported elsewhere."""

from collections.abc import Callable
from typing import Any

from spherical_wrist.simulation import addresses


def intrinsics(numba: Any, law: Any, loop: Any) -> dict[Callable[..., Any], Any]:
    """What stands in compiled code for the functions of ``addresses`` that have no Python.

    Args:
        numba: the module.
        law: signature of a law's step.
        loop: signature of the loop.
    """
    types, cgutils = numba.core.types, numba.core.cgutils

    @numba.extending.intrinsic  # type: ignore[untyped-decorator]
    def memory(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], cgutils.voidptr_t)

        return types.voidptr(types.intp), generate

    def function_at(kind: Any) -> Any:
        @numba.extending.intrinsic  # type: ignore[untyped-decorator]
        def at(typing_context: Any, address: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                function = cgutils.create_struct_proxy(kind)(context, builder)
                function.jit_addr = builder.inttoptr(arguments[0], cgutils.voidptr_t)
                return function._getvalue()

            return kind(types.intp), generate

        return at

    functions = {
        addresses.law_at: function_at(types.FunctionType(law)),
        addresses.loop_at: function_at(types.FunctionType(loop)),
    }
    return {addresses.memory: memory, addresses.carray: numba.carray, **functions}
