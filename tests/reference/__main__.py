"""``python -m reference`` in the folder ``tests``, or ``python tests/reference``."""

import sys
from pathlib import Path

if not __package__:
    sys.path[0] = str(Path(__file__).parent.parent)

from reference.compare import main

sys.exit(main())
