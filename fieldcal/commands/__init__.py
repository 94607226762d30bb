"""One command of the command line a file: options in, words and exit codes out.

To add one, write commands/<name>.py with ``add_arguments`` and ``run``, and a line in
`fieldcal.cli`. Nothing is calculated here, and only here anything is printed.
"""
