"""Parts of a score on workers: copies files to them, runs commands there, and copies the output back.

Independent of the scheduler.
"""
