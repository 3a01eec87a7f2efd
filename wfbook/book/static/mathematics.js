// Typesets what mathematics.py left as TeX, before the page is shown.
"use strict";

document.addEventListener("DOMContentLoaded", () => {
  for (const element of document.querySelectorAll(".math")) {
    const displayMode = "display" in element.dataset;
    katex.render(element.textContent, element, { displayMode, throwOnError: false, strict: "ignore" });
  }
});
