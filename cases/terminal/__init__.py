"""Tables, messages and errors that the verbs show, and their exit codes."""
