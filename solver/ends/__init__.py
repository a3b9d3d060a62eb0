"""Line beyond an end: half lines of a periodic line, and their forces in steps."""
