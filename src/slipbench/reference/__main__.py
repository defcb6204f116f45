"""Write the reference of the files: `python -m slipbench.reference docs/reference`."""

import sys
from pathlib import Path

from slipbench.reference.pages import write

write(Path(sys.argv[1]))
