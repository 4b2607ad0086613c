"""The command ``wrist`` as ``python -m spherical_wrist``."""

from spherical_wrist.cli import main

if __name__ == "__main__":
    main()
