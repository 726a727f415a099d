"""``python tools/reference VENDOR ...``"""

import sys
from pathlib import Path

if not __package__:
    sys.path[0] = str(Path(__file__).parent.parent)

from reference.compare import main

sys.exit(main())
