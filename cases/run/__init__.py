"""Running a case: the folder of its results, who may write there, and how a run is stopped."""
