"""Tables, messages and completion that the verbs share."""
