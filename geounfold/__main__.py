"""``python -m geounfold``: the same as the ``geounfold`` command."""

import sys

from geounfold.cli import main

if __name__ == "__main__":
    sys.exit(main())
