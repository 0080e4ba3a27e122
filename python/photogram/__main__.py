"""`python -m photogram`, the command of this interpreter."""

from photogram.cli import main

main()
