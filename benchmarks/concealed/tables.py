"""Tables."""
def printed(found): print(len(found))
