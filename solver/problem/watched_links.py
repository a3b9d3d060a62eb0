"""Names of links that a run records: stops above steady arms, and gauges at the ends of wires."""

# Component of the stops above steady arms, one for each of these.
UPLIFT_STOPS = "arm_stops"
# Values of a gauge, in the order of its tables.
TENSION, TRAVEL, WEIGHT = "wire_end_tension", "wire_end_travel", "tensioner_weight"
LOW_STOP, HIGH_STOP = "tensioner_low_stop", "tensioner_high_stop"
GAUGES = (TENSION, TRAVEL, WEIGHT, LOW_STOP, HIGH_STOP)
