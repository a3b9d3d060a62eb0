"""The moving window: which stations of a line a step takes on, and how that follows the train."""
