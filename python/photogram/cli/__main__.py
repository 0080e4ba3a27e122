"""`python -m photogram.cli`."""

from photogram.cli import main

main()
