"""``python -m controller.cli``: the command line where its script is not on the path."""

import sys

from controller.cli.main import main

sys.exit(main())
