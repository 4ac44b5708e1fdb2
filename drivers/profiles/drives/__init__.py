"""Drives as data: what each can and lacks, every value with where it is known from."""
