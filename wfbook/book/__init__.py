"""The whole book as web pages that open offline: ``python -m wfbook book``.

Chapters are executed, their widgets become pictures of their last state (:mod:`.still`), their replays files
of their own, and Sphinx makes pages of them with mathematics, search, and links from "eq. 8" to equation 8.
"""
