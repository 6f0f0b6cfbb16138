"""``python -m pulsetrainer``."""

from pulsetrainer.cli.app import main

main()
