"""The store: sessions of all devices in SQL, and how parameters change in time.

History judges whether a result fits the earlier ones of its device; it never enters an
estimate. Only this room reads and writes the database, through
`database`, whose transactions are whole or not at all.
"""
