"""Reference solutions with error bars; results of any program and this installation beside them."""
