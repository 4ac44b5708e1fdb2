"""The flexible joint: masses behind springs, found from motor-side signals. No file, no plot."""
