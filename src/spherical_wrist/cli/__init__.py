"""Command line ``wrist``. It contains no physics and no mathematics, and imports the rest of the package when used."""

import signal


def main() -> None:
    """Run ``wrist``. Exit codes: 0 completed, 1 diverged or failed, 2 wrong input, 128 + n stopped by signal n."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # which ends it without a word, until it hears signals itself
    from spherical_wrist.cli.entry import run

    run()
