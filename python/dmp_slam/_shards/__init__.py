"""Parts of a score, done by workers: files brought to them, commands run on them, and what they write brought back.

Nothing here knows who hands out the parts.
"""
