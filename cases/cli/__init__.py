"""The command line: a file for each verb or group of verbs."""
