"""`python -m torquerig` is `torquerig`."""

import sys

from torquerig.cli import main

sys.exit(main())
