"""``python -m pulsetrainer``."""

from pulsetrainer.cli.starting import main

main()
