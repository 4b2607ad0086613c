"""What code is compiled for."""


def processor() -> str:
    """LLVM's name of this machine's processor: another one may round in other places."""
    from llvmlite.binding import get_host_cpu_name

    return str(get_host_cpu_name())
