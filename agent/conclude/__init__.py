"""From files to answers: recordings joined with estimators, monitor and explanation. No bus."""
