"""The folder of results: who may write there, what is there, how much room."""
