"""``python -m sphereflow``: the same as the command ``sphereflow``."""

from sphereflow.cli import main

if __name__ == "__main__":
    main()
