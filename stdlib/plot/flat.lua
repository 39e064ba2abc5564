-- plot, semilogy, semilogx, loglog, band: curves in the plane.

local arguments, curves, options = plotting.arguments, plotting.series, plotting.options

local twin = include "plot/twin"

-- Curves from columns and solutions, or graphs of functions; the labels of the axes, the limits of y.
local function read(by, given, chosen)
  if given.n == 2 and type(given[2]) == "table" then
    local graph = include "plot/graph"
    if graph.asked(given[1], given[2]) then
      local series, symbol, limits = graph.series(by, given[1], given[2])
      chosen.ylim = chosen.ylim or limits
      return series, { symbol, #series == 1 and series[1].labels[1] or nil }
    end
  end
  return curves.read_series(by, given, chosen)
end

local function plot_with(by, axes, ...)
  local first = ...  -- figures, tableaus, sweeps, data, tables of errors know how to draw themselves
  local kind = object_type(first)
  if kind == "figure" and select("#", ...) == 1 then return first end
  if kind and kind ~= "matrix" and kind ~= "solution" and named(kind .. ":plot") then
    return first:plot(select(2, ...))
  end
  local given, chosen = arguments.split_options(by, options.flat, ...)
  for key, value in pairs(axes) do
    if chosen[key] == nil then chosen[key] = value end
  end
  local series, names, bare = read(by, given, chosen)
  arguments.add_suffixes(series)
  arguments.spread_labels(by, series, chosen)
  curves.set_looks(by, series, chosen)
  local description = curves.copy_options({ by = by, series = series, xwhole = bare or nil }, chosen)
  if names and description.xlabel == nil then description.xlabel = names[1] end
  if names and description.ylabel == nil then description.ylabel = names[2] end
  description.y2lim = nil
  if chosen.right then twin(by, series, chosen, description) else description.y2label = nil end
  return figure(description)
end

doc { name = "plot", module = "plot", title = "Looking at things",
    sig = "plot(x, y [, x2, y2 …] [, options]) -> figure",
  text = "A figure of curves: plot(y), plot(x, y), plot(x, {y1, y2}); plot(sol, {x, y}) for any expressions "
    .. "along a solution, plot(sol) for its variables, plot(sol, x, y) for y against x, "
    .. "plot({sol1, sol2}, x) for several solutions; plot(sin(x), { -3, 3 }), plot({ f, g }, { 0, 1 }) for "
    .. "graphs of expressions with one symbol and of functions. Other results draw themselves: plot(d, …) is d:plot(…). "
    .. "A line along a solution follows it between the saved points and breaks where it "
    .. "jumps. At the prompt the figure is drawn when it is the value of the line; in a script by :show() "
    .. "and :save \"file.svg\".",
  example = "plot({0, 1, 2}, {0, 1, 4}, { title = \"Squares\", xlabel = \"n\" })",
    gives = "figure 'Squares': 1 series, 3 points",
  options = options.flat,
  function(...) return plot_with("plot", {}, ...) end }

doc { name = "solution:plot", module = "plot", sig = "sol:plot([what] [, options]) -> figure",
  text = "The same as plot(sol, what, options).",
  example = "x = var 'x'  return dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1, dt = 0.1, method = "
    .. "rk.rk4 }:plot()",
  options = options.flat,
  function(sol, what, ...)
    if what == nil then return plot_with("plot", {}, sol, ...) end
    return plot_with("plot", {}, sol, what, ...)
  end }

doc { name = "semilogy", module = "plot", sig = "semilogy(x, y [, options]) -> figure",
  text = "Like plot, with a logarithmic y axis. Values that are not positive are left out and counted in a note.",
  example = "semilogy({1, 2, 3, 4}, {1, 0.1, 1e-3, 1e-7})", gives = "figure: 1 series, 4 points",
  options = options.flat,
  function(...) return plot_with("semilogy", { ylog = true }, ...) end }

doc { name = "semilogx", module = "plot", sig = "semilogx(x, y [, options]) -> figure",
  text = "Like plot, with a logarithmic x axis.", example = "semilogx({1, 10, 100}, {1, 2, 3})",
  gives = "figure: 1 series, 3 points",
  options = options.flat,
  function(...) return plot_with("semilogx", { xlog = true }, ...) end }

doc { name = "loglog", module = "plot", sig = "loglog(x, y [, options]) -> figure",
  text = "Like plot, with two logarithmic axes: the slope of a straight line is the power, such as the "
    .. "order of a method.",
  example = "loglog({0.1, 0.05}, {1e-4, 6.25e-6})", gives = "figure: 1 series, 2 points",
  options = options.flat,
  function(...) return plot_with("loglog", { xlog = true, ylog = true }, ...) end }

doc { name = "band", module = "plot", sig = "band(x, low, high [, options]) -> figure",
  text = "The area between two curves, such as a confidence band. Options as in plot; plot more into it "
    .. "with overlay.",
  example = "band({0, 1, 2}, {0, 0, 1}, {1, 2, 2})", gives = "figure: 1 series, 3 points",
  options = options.flat,
  function(x, low, high, given)
    local _, checked = arguments.split_options("band", options.flat, {}, given or {})
    local series = { { x = curves.check_column("band", "x", x), y = curves.check_column("band", "high", high),
                       lower = curves.check_column("band", "low", low), style = "fill", count = 1 } }
    arguments.spread_labels("band", series, checked)
    checked.style = nil
    curves.set_looks("band", series, checked)
    return figure(curves.copy_options({ by = "band", series = series }, checked))
  end }
