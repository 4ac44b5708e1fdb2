"""`python -m agent.cli` is `stribeck`."""

from agent.cli import main

main()
