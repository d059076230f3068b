"""What all tests have in common."""

import signal

# A shell without job control has what it starts in the background ignore Ctrl-C, and so do its children: tests that
# interrupt programs would wait for nothing.
signal.signal(signal.SIGINT, signal.default_int_handler)
