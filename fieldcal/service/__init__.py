"""Sessions in, results out, over HTTP: `fieldcal serve`.

`upload` takes in what somebody sends and trusts nothing of it, `jobs` keeps what was
sent and how far it is, `work` makes the documents of one job in a process of its own,
`queue` does one after the other, `records` writes them for test stations, `openapi`
says what can be asked, and `api` answers. Who is let in is `run.page.access`'s matter.
"""
