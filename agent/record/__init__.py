"""Recordings: stream, finish, recover, read and write. Files live here, physics does not."""
