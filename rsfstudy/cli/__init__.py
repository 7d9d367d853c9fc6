"""The command line: how it is spelt, what its commands do, and what they print."""
