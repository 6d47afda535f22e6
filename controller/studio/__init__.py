"""The studio: an author's Python file as bars that are dragged; the text stays the only truth.

A gesture on the page becomes an edit (``edits``) of one span of the file's bytes (``source``), kept
by a project with undo (``project``); another process runs what the file then says and checks it
(``running``); ``session`` joins them and serves the page.
"""
