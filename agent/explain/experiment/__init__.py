"""What to drive next, so that what is tied now comes apart soonest."""
