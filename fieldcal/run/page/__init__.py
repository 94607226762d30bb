"""The run on a phone or tablet: what the console shows, for whoever stands at the box.

`watched` is an operator that shows another one's run here as well, `board` holds what
there is to see, `buttons` says who may press them, `access` lets in who has the token,
`server` serves the page. Nothing of it comes from elsewhere: it works offline.
"""
