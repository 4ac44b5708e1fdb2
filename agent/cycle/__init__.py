"""One cycle on one axis: preflight, gate, interlock, sequence, teardown. No bus library."""
