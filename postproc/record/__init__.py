"""Recording a run: its channels, their buffers, and progress."""
