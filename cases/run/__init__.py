"""Running a case: its folder and who may write there, what it records, how it is stopped."""
