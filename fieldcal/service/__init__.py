"""HTTP service that receives sessions and returns results: `fieldcal serve`.

`upload` checks and unpacks what is sent. `jobs` keeps uploads and the state of their
jobs. `work` makes the documents of one job in a process of its own (`own_process` where
the caller works in threads), and `queue` carries out the jobs in order. `records`
writes results for test stations. `openapi` describes the requests, and `api` answers
them. `run.page.access` controls the access.
"""
