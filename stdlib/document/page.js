// A page is complete without this. With it, a click enlarges a figure, the pointer reads values in it, a rectangle drawn
// in it is seen closer (Ctrl and the wheel, too; in an enlarged figure the wheel alone) until a double click, figures of
// one sequence share a place with a slider, and printing unfolds everything.
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

  // Values of pixels by ticks [pixel, value]: linear or logarithmic, or null where the ticks are of neither kind.
  function scale(ticks) {
    if (ticks.length < 2) return null;
    var low = ticks[0], high = ticks[ticks.length - 1];
    function fits(of, back, log) {
      var a = of(low[1]), b = of(high[1]), slope = (high[0] - low[0]) / (b - a);
      var good = ticks.every(function (tick) {
        return Math.abs(low[0] + (of(tick[1]) - a) * slope - tick[0]) <= 0.01 * Math.abs(high[0] - low[0]);
      });
      return good && a !== b && isFinite(a + b) ? {
        log: log,
        value: function (p) { return back(a + (p - low[0]) / slope); },
        pixel: function (v) { return low[0] + (of(v) - a) * slope; }
      } : null;
    }
    return fits(function (v) { return v; }, function (v) { return v; }, false) ||
      fits(Math.log10, function (v) { return Math.pow(10, v); }, true);
  }

  function numbers(text) { return (text || "").match(/-?[\d.]+(?:e-?\d+)?/g) || []; }
  function near(a, b) { return Math.abs(a - b) < 0.6; }
  function inside(box, x, y) { return x > box.x0 - 0.6 && x < box.x1 + 0.6 && y > box.y0 - 0.6 && y < box.y1 + 0.6; }

  // The marks of an axis: a tick is a short line beside the text that names its value.
  function marks(svg, box) {
    var found = { x: [], y: [], twin: false };
    svg.querySelectorAll("g[text-anchor]").forEach(function (label) {
      var line = label.previousElementSibling, value = number(label.textContent.trim());
      var ends = line && line.tagName === "path" && numbers(line.getAttribute("d")).map(Number);
      if (!ends || ends.length !== 4 || isNaN(value) || !inside(box, ends[0], ends[1])) return;
      var mark = { line: line, label: label, value: value };
      if (ends[0] === ends[2] && near(ends[1], box.y1)) found.x.push(Object.assign(mark, { at: ends[0] }));
      if (ends[1] === ends[3] && near(ends[0], box.x0)) found.y.push(Object.assign(mark, { at: ends[1] }));
      if (ends[1] === ends[3] && near(ends[0], box.x1)) found.twin = true;
    });
    return found;
  }

  function ticks(list) { return list.map(function (mark) { return [mark.at, mark.value]; }); }

  // The parts of a figure that have axes: the border with its scales, and what is seen of it.
  function panels(svg) {
    var list = [];
    svg.querySelectorAll("path").forEach(function (border) {
      var n = numbers(border.getAttribute("d")).map(Number);
      if (n.length < 6 || n[0] !== n[2] || n[3] !== n[5] || n[3] - n[1] < 40 || n[4] - n[2] < 40) return;
      var box = { x0: n[0], y0: n[1], x1: n[4], y1: n[3] }, found = marks(svg, box);
      if (list.some(function (other) { return near(other.box.x0, box.x0) && near(other.box.y0, box.y0); })) return;
      var x = scale(ticks(found.x)), y = scale(ticks(found.y));
      if (x && y) list.push({ box: box, x: x, y: y, marks: found, border: border, view: Object.assign({}, box) });
    });
    return list;
  }

  // Where a place of the figure as drawn is seen now, and back.
  function seen(panel, x, y) {
    var box = panel.box, view = panel.view;
    return [box.x0 + (x - view.x0) / (view.x1 - view.x0) * (box.x1 - box.x0),
      box.y0 + (y - view.y0) / (view.y1 - view.y0) * (box.y1 - box.y0)];
  }
  function drawn(panel, x, y) {
    var box = panel.box, view = panel.view;
    return [view.x0 + (x - box.x0) / (box.x1 - box.x0) * (view.x1 - view.x0),
      view.y0 + (y - box.y0) / (box.y1 - box.y0) * (view.y1 - view.y0)];
  }

  // What stands in a panel: lines, areas and marks with their places; samples of the legend are left alone.
  function pieces(svg, panel) {
    var list = [];
    svg.querySelectorAll("g[id*=gnuplot_plot_]").forEach(function (group) {
      var title = group.querySelector("title"), label = title ? title.textContent : "", legend = null;
      group.querySelectorAll("g[text-anchor]").forEach(function (text) {
        legend = Number(numbers(text.getAttribute("transform"))[1]) - 0.325 * Number(text.getAttribute("font-size"));
      });
      function sample(line) { return line.length <= 2 && line.every(function (p) { return near(p[1], legend); }); }
      function here(line) { return line.every(function (p) { return inside(panel.box, p[0], p[1]); }); }
      function add(element, kind, lines) {
        var own = lines.filter(function (line) { return line.length && here(line) && !(legend !== null && sample(line)); });
        var rest = lines.filter(function (line) { return own.indexOf(line) < 0; });
        if (own.length) list.push({ element: element, kind: kind, lines: own, rest: rest, label: label });
      }
      function pairs(text) {
        var n = numbers(text), points = [];
        for (var i = 0; i + 1 < n.length; i += 2) points.push([Number(n[i]), Number(n[i + 1])]);
        return points;
      }
      group.querySelectorAll("path").forEach(function (path) {
        var d = path.getAttribute("d") || "";
        if (/^[MLZz\s\d.,-]*$/.test(d)) add(path, "d", d.split("M").slice(1).map(pairs));
      });
      group.querySelectorAll("polygon").forEach(function (area) {
        add(area, "points", [pairs(area.getAttribute("points"))]);
      });
      group.querySelectorAll("use").forEach(function (mark) {
        add(mark, "transform", [pairs(mark.getAttribute("transform")).slice(0, 1)]);
      });
    });
    return list;
  }

  function nearest(list, x, y) {
    var best = null, least = 40 * 40;
    list.forEach(function (panel) {
      panel.pieces.forEach(function (piece) {
        piece.lines.forEach(function (line) {
          line.forEach(function (p) {
            var at = seen(panel, p[0], p[1]), d = (at[0] - x) * (at[0] - x) + (at[1] - y) * (at[1] - y);
            if (d < least && inside(panel.box, at[0], at[1])) { least = d; best = [panel, p[0], p[1], piece.label]; }
          });
        });
      });
    });
    return best;
  }

  // ── zoom of axes ────────────────────────────────────────────────────────────────────────────────────────

  var clips = 0;

  function element(name, attributes, parent) {
    var made = document.createElementNS("http://www.w3.org/2000/svg", name);
    Object.keys(attributes).forEach(function (key) { made.setAttribute(key, attributes[key]); });
    parent.append(made);
    return made;
  }

  // Round numbers between two values, about five; on a logarithmic axis powers of ten while there are two.
  function round(low, high, log) {
    var list = [], a = Math.min(low, high), b = Math.max(low, high), step, v;
    if (log && Math.log10(b / a) >= 2) {
      step = Math.ceil(Math.log10(b / a) / 6);
      for (v = Math.ceil(Math.log10(a) - 1e-9); v <= Math.log10(b) + 1e-9; v += step) list.push(Math.pow(10, v));
      return list;
    }
    var size = Math.pow(10, Math.floor(Math.log10((b - a) / 5)));
    step = [1, 2, 5, 10].map(function (k) { return k * size; }).find(function (k) { return (b - a) / k <= 6; });
    for (v = Math.ceil(a / step - 1e-9); v <= b / step + 1e-9; v++) list.push(Number((v * step).toPrecision(12)));
    return list;
  }

  // What belongs to the axes as drawn; hidden while others stand in their place.
  function axis_parts(svg, panel) {
    var box = panel.box, parts = [];
    panel.marks.x.concat(panel.marks.y).forEach(function (mark) { parts.push(mark.line, mark.label); });
    svg.querySelectorAll("path").forEach(function (path) {
      if (path === panel.border || parts.indexOf(path) >= 0 || path.closest("g[id*=gnuplot_plot_]")) return;
      var n = numbers(path.getAttribute("d")).map(Number);
      if (n.length < 4 || !inside(box, n[0], n[1])) return;
      var edge = near(n[0], box.x0) || near(n[1], box.y1) || near(n[1], box.y0);
      var short = Math.abs(n[2] - n[0]) + Math.abs(n[3] - n[1]) < 8;
      if (path.classList.contains("gridline") || edge && short) parts.push(path);
    });
    return parts;
  }

  function prepare(svg, panel) {
    var box = panel.box, id = "clip-" + (++clips);
    element("rect", { x: box.x0, y: box.y0, width: box.x1 - box.x0, height: box.y1 - box.y0 },
      element("clipPath", { id: id }, svg));
    panel.parts = axis_parts(svg, panel);
    panel.pieces.forEach(function (piece) {
      piece.original = piece.element.getAttribute(piece.kind);
      if (piece.kind !== "d" || !piece.rest.length) return;
      var legend = piece.element.cloneNode();              // its sample is a part of the line itself
      legend.setAttribute("d", line_text(piece.rest));
      piece.legend = legend;
    });
    panel.clip = "url(#" + id + ")";
    panel.axes = element("g", {}, svg);
  }

  function line_text(lines) {
    return lines.map(function (line) {
      return "M" + line.map(function (p) { return p[0].toFixed(2) + "," + p[1].toFixed(2); }).join(" L");
    }).join(" ");
  }

  function place(panel, piece, zoomed) {
    var to = piece.element, text = piece.original;
    var lines = zoomed && piece.lines.map(function (line) {
      return line.map(function (p) { return seen(panel, p[0], p[1]); });
    });
    if (zoomed && piece.kind === "d") text = line_text(lines);
    if (zoomed && piece.kind === "points") text = lines[0].join(" ");
    if (piece.kind === "transform") {                        // a mark
      var at = zoomed && lines[0][0];
      if (zoomed) text = text.replace(/translate\([^)]*\)/, "translate(" + at + ")");
      to.style.display = zoomed && !inside(panel.box, at[0], at[1]) ? "none" : "";
    } else if (zoomed) to.setAttribute("clip-path", panel.clip);
    else to.removeAttribute("clip-path");
    to.setAttribute(piece.kind, text);
    if (piece.legend && zoomed) to.before(piece.legend);
    else if (piece.legend) piece.legend.remove();
  }

  function draw_axis(panel, axis) {
    var box = panel.box, view = panel.view, along = axis === "x", sample = panel.marks[axis][0];
    var size = numbers(sample.label.getAttribute("transform")).map(Number);
    var low = panel[axis].value(view[axis + "0"]), high = panel[axis].value(view[axis + "1"]);
    round(low, high, panel[axis].log).forEach(function (value) {
      var at = panel[axis].pixel(value), p = seen(panel, along ? at : box.x0, along ? box.y0 : at)[along ? 0 : 1];
      if (p < box[axis + "0"] - 0.6 || p > box[axis + "1"] + 0.6) return;
      var grid = along ? "M" + p + "," + box.y0 + " V" + box.y1 : "M" + box.x0 + "," + p + " H" + box.x1;
      if (panel.parts.some(function (part) { return part.classList.contains("gridline"); })) {
        element("path", { d: grid, stroke: "#ddd", "stroke-width": 0.6 }, panel.axes);
      }
      element("path", { d: along ? "M" + p + "," + box.y1 + " v6.3" : "M" + box.x0 + "," + p + " h-6.3", stroke: "#666" },
        panel.axes);
      var label = sample.label.cloneNode();
      label.style.display = "";                              // the sample is hidden now
      label.setAttribute("transform", "translate(" + (along ? [p, size[1]] : [size[0], p + size[1] - sample.at]) + ")");
      element("text", {}, label).textContent = Number(value.toPrecision(8));
      panel.axes.append(label);
    });
  }

  function show(svg, panel) {
    var box = panel.box, view = panel.view;
    var zoomed = ["x0", "x1", "y0", "y1"].some(function (key) { return view[key] !== box[key]; });
    if (!panel.clip) prepare(svg, panel);
    panel.parts.forEach(function (part) { part.style.display = zoomed ? "none" : ""; });
    panel.pieces.forEach(function (piece) { place(panel, piece, zoomed); });
    panel.axes.replaceChildren();
    if (zoomed) ["x", "y"].forEach(function (axis) { draw_axis(panel, axis); });
    if (zoomed) svg.querySelector("rect").after(panel.axes);
    if (zoomed) svg.closest("figure").classList.add("zoomed");
  }

  // Panels below each other whose x axes are the same, as of a Bode diagram, are seen over the same range.
  function same_x(a, b) {
    return near(a.box.x0, b.box.x0) && near(a.box.x1, b.box.x1) && a.x.log === b.x.log &&
      Math.abs(a.x.pixel(b.x.value(a.box.x1)) - a.box.x1) < 1 && Math.abs(a.x.pixel(b.x.value(a.box.x0)) - a.box.x0) < 1;
  }

  // The view between two places; where two axes share the panel, only x changes.
  function zoom(svg, parts, panel, from, to) {
    var a = drawn(panel, from[0], from[1]), b = drawn(panel, to[0], to[1]), box = panel.box, view = panel.view;
    var next = { x0: Math.min(a[0], b[0]), x1: Math.max(a[0], b[0]), y0: Math.min(a[1], b[1]), y1: Math.max(a[1], b[1]) };
    ["x", "y"].forEach(function (axis) {
      var low = Math.max(next[axis + "0"], box[axis + "0"]), high = Math.min(next[axis + "1"], box[axis + "1"]);
      if (axis === "y" && panel.marks.twin || high - low < 1e-6 * (box[axis + "1"] - box[axis + "0"])) return;
      view[axis + "0"] = low;
      view[axis + "1"] = high;
    });
    parts.forEach(function (each) {
      if (each !== panel && !same_x(each, panel)) return;
      each.view.x0 = view.x0;
      each.view.x1 = view.x1;
      show(svg, each);
    });
  }

  function place_of(svg, event) {
    var at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [at.x, at.y];
  }

  function zoomable(figure, svg, parts) {
    var begin = null, rubber = null;
    function under(at) { return parts().find(function (panel) { return inside(panel.box, at[0], at[1]); }); }
    function clamped(panel, at) {
      return [Math.min(Math.max(at[0], panel.box.x0), panel.box.x1), Math.min(Math.max(at[1], panel.box.y0), panel.box.y1)];
    }
    svg.addEventListener("mousedown", function (event) { if (under(place_of(svg, event))) event.preventDefault(); });
    svg.addEventListener("pointerdown", function (event) {
      var at = place_of(svg, event), panel = event.button === 0 && event.pointerType !== "touch" && under(at);
      begin = panel ? { panel: panel, at: at } : null;
    });
    window.addEventListener("pointermove", function (event) {
      if (!begin) return;
      var at = clamped(begin.panel, place_of(svg, event)), x = at[0] - begin.at[0], y = at[1] - begin.at[1];
      if (!rubber && Math.abs(x) + Math.abs(y) < 8) return;
      rubber = rubber || element("rect", { "class": "rubber" }, svg);
      Object.entries({ x: Math.min(at[0], begin.at[0]), y: Math.min(at[1], begin.at[1]), width: Math.abs(x), height: Math.abs(y) })
        .forEach(function (pair) { rubber.setAttribute(pair[0], pair[1]); });
    });
    window.addEventListener("pointerup", function (event) {
      if (begin && rubber) {
        rubber.remove();
        zoom(svg, parts(), begin.panel, begin.at, clamped(begin.panel, place_of(svg, event)));
        figure.dataset.dragged = "yes";                    // the click that follows is a part of this
        setTimeout(function () { delete figure.dataset.dragged; }, 0);
      }
      begin = rubber = null;
    });
    svg.addEventListener("dblclick", function () {
      figure.classList.remove("zoomed");
      parts().forEach(function (panel) { restore(svg, panel); });
    });
    svg.addEventListener("wheel", function (event) {
      var at = place_of(svg, event), panel = under(at);
      if (!panel || !(event.ctrlKey || figure.classList.contains("large"))) return;
      event.preventDefault();
      var box = panel.box, k = event.deltaY < 0 ? 0.8 : 1.25;
      zoom(svg, parts(), panel, [at[0] + (box.x0 - at[0]) * k, at[1] + (box.y0 - at[1]) * k],
        [at[0] + (box.x1 - at[0]) * k, at[1] + (box.y1 - at[1]) * k]);
    }, { passive: false });
  }

  function restore(svg, panel) {
    Object.assign(panel.view, panel.box);
    if (panel.clip) show(svg, panel);
  }

  function readable(figure, svg, parts) {
    var reading = null;
    svg.addEventListener("pointermove", function (event) {
      if (!parts().length) return;
      var at = place_of(svg, event), panel = parts().find(function (each) { return inside(each.box, at[0], at[1]); });
      var hit = nearest(parts(), at[0], at[1]) || (panel && [panel].concat(drawn(panel, at[0], at[1]), ""));
      if (!hit) return;
      if (!reading) {
        reading = document.createElement("div");
        reading.className = "reading";
        figure.append(reading);
      }
      var name = hit[3] && !/^gnuplot_plot_/.test(hit[3]) ? hit[3] + ": " : "";
      reading.textContent = name + Number(hit[0].x.value(hit[1]).toPrecision(4)) + ", " +
        Number(hit[0].y.value(hit[2]).toPrecision(4));
      reading.hidden = false;
    });
    svg.addEventListener("pointerleave", function () { if (reading) reading.hidden = true; });
  }

  document.querySelectorAll("figure").forEach(function (figure) {
    var svg = figure.querySelector("svg"), found = null;
    if (!svg) return;
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) svg.pauseAnimations();
    function parts() {
      found = found || panels(svg).map(function (panel) { return Object.assign(panel, { pieces: pieces(svg, panel) }); });
      return found;
    }
    readable(figure, svg, parts);
    zoomable(figure, svg, parts);
    svg.addEventListener("click", function () {
      if (!figure.dataset.dragged && !figure.classList.contains("zoomed")) figure.classList.toggle("large");
    });
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
