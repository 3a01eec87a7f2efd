"""What a reader touches: one module of widgets a chapter, in the order of the chapters.

Every widget is a class whose controls and pictures are attributes: a test sets a control's value and looks
at what was drawn, without a browser.
"""

from wfbook.view.widgets.start import WheelsToggle

__all__ = ["WheelsToggle"]
