"""The store: sessions of all devices in SQL, and the change of parameters in time.

A result is compared with the earlier ones of its device; they do not enter any
estimate. Only this package reads and writes the database, in transactions of
`database`.
"""
