"""``python -m minsnap`` is the command ``minsnap``."""

from minsnap.cli import main

if __name__ == "__main__":
    main()
