"""The command line ``wrist``. It holds no physics and no mathematics, and imports the rest only when it is used."""

import sys

from spherical_wrist.errors import WristError

INVALID, SIGINT_CODE = 2, 130


def main() -> None:
    """Runs ``wrist``. Exit codes: 0 completed, 1 diverged, 2 wrong input, 128 + n stopped by signal n."""
    from typer.exceptions import Abort, TyperException

    from spherical_wrist.cli import (  # noqa: F401 their commands join those of app
        campaign_commands,
        guide_commands,
        report_commands,
        study_commands,
        tuning_commands,
    )
    from spherical_wrist.cli.app import app

    try:
        code = app(standalone_mode=False)
    except WristError as error:
        _complain(str(error))
    except TyperException as error:
        # typer's own words for a wrong option, in our one line
        text = error.format_message() if hasattr(error, "format_message") else str(error)
        _complain(f"{text.strip()} (see wrist --help)")
    except (Abort, KeyboardInterrupt):
        sys.exit(SIGINT_CODE)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    sys.exit(code if isinstance(code, int) else 0)


def _complain(text: str) -> None:
    print(f"wrist: error: {' '.join(text.split())}", file=sys.stderr)
    sys.exit(INVALID)
