// A page is complete without this: a click enlarges a figure, printing unfolds everything.
(function () {
  "use strict";
  document.querySelectorAll("figure").forEach(function (figure) {
    var svg = figure.querySelector("svg");
    if (!svg) return;
    svg.addEventListener("click", function () { figure.classList.toggle("large"); });
  });
  document.addEventListener("keydown", function (event) {
    if (event.key !== "Escape") return;
    document.querySelectorAll("figure.large").forEach(function (figure) { figure.classList.remove("large"); });
  });
  var folded = [];
  window.addEventListener("beforeprint", function () {
    folded = Array.from(document.querySelectorAll("details:not([open])"));
    folded.forEach(function (details) { details.open = true; });
  });
  window.addEventListener("afterprint", function () {
    folded.forEach(function (details) { details.open = false; });
  });
})();
