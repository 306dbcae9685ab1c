"""``python -m srbval``."""

import sys

from srbval.cli import main

sys.exit(main())
