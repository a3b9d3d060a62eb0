"""What verbs share on a terminal: messages, tables, completion."""
