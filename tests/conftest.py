"""What all tests need of the process that runs them."""

import signal

# A shell that runs something in the background has it ignore interrupts, and with it all that it starts;
# but tests interrupt commands, as a user would.
signal.signal(signal.SIGINT, signal.default_int_handler)
