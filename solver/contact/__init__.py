"""Where heads touch the wire, what droppers pull, and what the line answers to both."""
