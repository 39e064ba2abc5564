// A page is complete without this. With it, a click enlarges a figure, the pointer reads values in it, figures of one
// sequence share a place with a slider, and printing unfolds everything.
(function () {
  "use strict";

  // ── reading values ──────────────────────────────────────────────────────────────────────────────────────

  var raised = "⁰¹²³⁴⁵⁶⁷⁸⁹";

  // "0.5", "-2", "10⁻³"; NaN for what is no number.
  function number(text) {
    var power = text.replace(/−/g, "-").match(/^(-?)10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)$/);
    if (!power) return text.trim() === "" ? NaN : Number(text.replace(/−/g, "-"));
    var exponent = power[2].replace(/⁻/g, "-").replace(/[⁰¹²³⁴⁵⁶⁷⁸⁹]/g, function (c) { return raised.indexOf(c); });
    return (power[1] ? -1 : 1) * Math.pow(10, Number(exponent));
  }

  // From pixels to values, by ticks [pixel, value]: linear or logarithmic, or null where the ticks are of neither kind.
  function scale(ticks) {
    if (ticks.length < 2) return null;
    var low = ticks[0], high = ticks[ticks.length - 1];
    function fits(of, back) {
      var a = of(low[1]), b = of(high[1]);
      var at = function (p) { return a + (p - low[0]) / (high[0] - low[0]) * (b - a); };
      var good = ticks.every(function (tick) { return Math.abs(at(tick[0]) - of(tick[1])) <= 0.01 * Math.abs(b - a); });
      return good && a !== b && isFinite(a + b) ? function (p) { return back(at(p)); } : null;
    }
    return fits(function (v) { return v; }, function (v) { return v; }) ||
      fits(Math.log10, function (v) { return Math.pow(10, v); });
  }

  // A tick is a short line beside the text that names its value.
  function axes(svg) {
    var x = [], y = [];
    svg.querySelectorAll("g[text-anchor]").forEach(function (group) {
      var line = group.previousElementSibling, value = number(group.textContent.trim());
      var ends = line && line.tagName === "path" && (line.getAttribute("d") || "").match(/-?[\d.]+/g);
      if (!ends || ends.length !== 4 || isNaN(value)) return;
      ends = ends.map(Number);
      if (ends[1] === ends[3]) y.push([ends[1], value]);
      if (ends[0] === ends[2]) x.push([ends[0], value]);
    });
    var scales = [scale(x), scale(y)];
    return scales[0] && scales[1] ? scales : null;
  }

  function vertices(svg) {
    var list = [];
    svg.querySelectorAll("g[id*=gnuplot_plot_]").forEach(function (group) {
      var title = group.querySelector("title"), label = title ? title.textContent : "";
      group.querySelectorAll("path").forEach(function (path) {
        var numbers = (path.getAttribute("d") || "").match(/-?[\d.]+/g) || [];
        for (var i = 0; i + 1 < numbers.length; i += 2) list.push([Number(numbers[i]), Number(numbers[i + 1]), label]);
      });
    });
    return list;
  }

  function nearest(points, x, y) {
    var best = null, least = 40 * 40;
    points.forEach(function (p) {
      var d = (p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y);
      if (d < least) { least = d; best = p; }
    });
    return best;
  }

  function readable(figure, svg) {
    var scales = null, points = null, reading = null;
    svg.addEventListener("pointermove", function (event) {
      if (points === null) { scales = axes(svg); points = vertices(svg); }
      if (!scales) return;
      var at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      var hit = nearest(points, at.x, at.y) || [at.x, at.y, ""];
      if (!reading) {
        reading = document.createElement("div");
        reading.className = "reading";
        figure.append(reading);
      }
      var name = hit[2] ? hit[2] + ": " : "";
      reading.textContent = name + Number(scales[0](hit[0]).toPrecision(4)) + ", " +
        Number(scales[1](hit[1]).toPrecision(4));
      reading.hidden = false;
    });
    svg.addEventListener("pointerleave", function () { if (reading) reading.hidden = true; });
  }

  document.querySelectorAll("figure").forEach(function (figure) {
    var svg = figure.querySelector("svg");
    if (!svg) return;
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) svg.pauseAnimations();
    readable(figure, svg);
    svg.addEventListener("click", function () { figure.classList.toggle("large"); });
  });
  document.addEventListener("keydown", function (event) {
    if (event.key !== "Escape") return;
    document.querySelectorAll("figure.large").forEach(function (figure) { figure.classList.remove("large"); });
  });

  // ── sequences ───────────────────────────────────────────────────────────────────────────────────────────

  document.querySelectorAll(".frames").forEach(function (frames) {
    var list = Array.from(frames.querySelectorAll(".frame"));
    var label = document.createElement("label"), slider = document.createElement("input");
    var words = document.createElement("span");
    slider.type = "range";
    slider.min = 0;
    slider.max = list.length - 1;
    slider.value = 0;
    function show() {
      list.forEach(function (frame, i) { frame.hidden = i !== Number(slider.value); });
      words.textContent = list[slider.value].dataset.label;
    }
    slider.addEventListener("input", show);
    label.append(words, slider);
    frames.prepend(label);
    frames.classList.add("sliding");
    show();
  });

  // ── paper ───────────────────────────────────────────────────────────────────────────────────────────────

  var folded = [];
  window.addEventListener("beforeprint", function () {
    folded = Array.from(document.querySelectorAll("details:not([open])"));
    folded.forEach(function (details) { details.open = true; });
  });
  window.addEventListener("afterprint", function () {
    folded.forEach(function (details) { details.open = false; });
  });
})();
