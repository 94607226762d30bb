"""Page of a run for phone and tablet, with the same content as the console.

`page_operator` shows the run of another operator on the page as well, `board` has the
content, `buttons` decides which client may press them, `access` checks tokens, and
`server` serves the page. No file comes from another host, so it works offline.
"""
