"""What the docs' figures come from: ``python -m tests.benchmarks.NAME``.

They keep their linear algebra to one thread, as the commands do (decision 0027): with NumPy's own
choice a search for ripple took four to nine times the processor time on two cores.
"""

from agent.cli.terminal.threads import keep_to_one_thread

keep_to_one_thread()
