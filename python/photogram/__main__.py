"""`python -m photogram`, the command of this interpreter."""

import sys

from photogram.cli import main

sys.exit(main())
