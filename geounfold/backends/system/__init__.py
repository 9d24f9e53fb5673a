"""What differs between Linux, macOS and Windows: the only folder that names a system.

Functions look for what the system offers (``os.fork``, ``resource``, ``signal.SIGHUP``) rather than
for its name, so that the tests can take one thing away at a time. tests/whole/test_one_room.py
refuses the forbidden names everywhere else.
"""
