-- Pictures of data, validations and parameter sets.


local figures = include "plot/options"
local of_output = joined_options({ option("output", "integer or string", "which output, by number or name") },
  figures.flat)

local function by_output(...) return include "identification/panels".by_output(...) end

-- The options of a picture with those that the user gives.
local function with_options(base, options)
  for key, value in pairs(options) do base[key] = value end
  return base
end

local function column(m, i)
  local values = {}
  for k = 1, m.rows do values[k] = m(k, i) end
  return values
end

-- One figure for each signal.
local function each_signal(t, m, names, style)
  local all = {}
  for i, name in ipairs(names) do
    all[i] = { by = "d:plot", ylabel = name, legend = false,
      series = { { x = t, y = column(m, i), labels = { name }, style = style } } }
  end
  return all
end

doc { name = "iddata:plot", module = "identification", sig = "d:plot([options]) -> figure",
  options = figures.frame, options_at = 2,
  text = "The outputs against time, and below them the inputs as stairs, each in its panel; options as in "
    .. "figures, for the first panel.",
  example = "iddata{ y = {0, 1, 2}, u = {1, 1, 0} }:plot()", gives = "figure: 1 series, 3 points, 2 panels",
  function(d, options)
    local t, below = column(d.t, 1), {}
    local panels = each_signal(t, d.y, d.y_names, "line")
    for _, panel in ipairs(each_signal(t, d.u, d.u_names, "steps")) do panels[#panels + 1] = panel end
    panels[#panels].xlabel = "t [s]"
    for i = 2, #panels do below[i - 1] = figure(panels[i]) end
    panels[1].below = below
    return figure(with_options(panels[1], options))
  end }

doc { name = "idmodel:plot", module = "identification", sig = "mod:plot(d [, options]) -> figure",
  options = of_output, options_at = 3,
  text = "The measured output and the simulated one, with the fit in the title. Options as in plot; several "
    .. "outputs have a panel each, { output = name or number } shows one.",
  example = "d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }\nfir(d, { nb = 1 }):plot(d)",
  gives = "figure 'simulation, fit 100 %': 2 series, 8 points",
  function(mod, d, options)
    if object_type(d) ~= "iddata" then fail "mod:plot(d) needs the data to compare with" end
    local fit, simulated = mod:fit(d, "simulation"), mod:simulate(d)
    return by_output("mod:plot", d.y_names, options, function(i, rest)
      local own = object_type(fit) == "matrix" and fit[i] or fit
      return named "plot" (d.t, column(d.y, i), d.t, column(simulated, i),
        with_options({ labels = { "measured", "simulated" }, xlabel = "t [s]", ylabel = d.y_names[i],
          style = "line", title = ("simulation, fit %.4g %%"):format(own) }, rest))
    end)
  end }

doc { name = "validation:plot", module = "identification",
  sig = "v:plot([\"auto\" | \"cross\" [, options]]) -> figure",
  text = "The autocorrelation of the residuals, or their correlation with the inputs, with 99 % bounds.",
  example = "u, y = {}, {}\nfor t = 1, 40 do u[t] = (-1)^(t*t//3); y[t] = u[t] + ((7*t) % 5)/9 end\n"
    .. "d = iddata{ y = y, u = u }\nfir(d, { nb = 1, nk = 0 }):validate(d):plot().title",
  gives = "autocorrelation of the residuals", options = figures.frame,
  function(v, what, options)
    if type(what) == "table" then what, options = nil, what end
    options = check_options("plot", options, figures.frame)
    what = what or "auto"
    if what ~= "auto" and what ~= "cross" then fail "v:plot: expected \"auto\" or \"cross\"" end
    local values = what == "auto" and v.autocorrelation or v.crosscorrelation
    local n = v.autocorrelation.rows
    local first = what == "auto" and 1 or -n
    local lags = {}
    for k = first, n do lags[#lags + 1] = k end
    local bound = what == "auto" and v.bound or v.cross_bound
    if object_type(bound) == "matrix" then bound = bound[1] end
    local series = { { x = { first, n }, y = { bound, bound }, lower = { -bound, -bound }, style = "fill",
      labels = { "99 % by chance" } } }
    for i = 1, values.cols do
      series[#series + 1] = { x = lags, y = column(values, i), style = "impulses", marker = "circle",
        labels = { what == "auto" and "residuals" or values.cols > 1 and "input " .. i or "input" } }
    end
    return figure(with_options({ by = "v:plot", xlabel = "lag", series = series,
      title = what == "auto" and "autocorrelation of the residuals" or "residuals and inputs" }, options))
  end }

doc { name = "validations:plot", module = "identification",
  sig = "v:plot([\"auto\" | \"cross\" [, options]]) -> figure", options = of_output, options_at = 3,
  text = "The same of several outputs, a panel each; { output = name or number } shows one.",
  example = "u, y = {}, {{}, {}}\nfor t = 1, 40 do u[t] = (-1)^(t*t//3) for i = 1, 2 do y[i][t] = u[t] + "
    .. "((7*i*t) % 5)/9 end end\nd = iddata{ y = y, u = u }\nfir(d, { nb = 1, nk = 0 }):validate(d):plot()",
  gives = "figure 'autocorrelation of the residuals': 2 series, 12 points, 2 panels",
  function(v, what, options)
    if type(what) == "table" then what, options = nil, what end
    return by_output("v:plot", v.y_names, options, function(i, rest)
      rest.ylabel = rest.ylabel or v.y_names[i]
      return v[i]:plot(what, rest)
    end)
  end }

-- The convex hull of points in the plane, counter-clockwise (Andrew's monotone chain).
local function hull(points)
  table.sort(points, function(a, b) return a[1] < b[1] or (a[1] == b[1] and a[2] < b[2]) end)
  local function half(from, to, step)
    local chain = {}
    for i = from, to, step do
      local p = points[i]
      while #chain >= 2 do
        local a, b = chain[#chain - 1], chain[#chain]
        if (b[1] - a[1]) * (p[2] - a[2]) - (b[2] - a[2]) * (p[1] - a[1]) > 0 then break end
        chain[#chain] = nil
      end
      chain[#chain + 1] = p
    end
    chain[#chain] = nil
    return chain
  end
  local lower, upper = half(1, #points, 1), half(#points, 1, -1)
  for _, p in ipairs(upper) do lower[#lower + 1] = p end
  return lower
end

local function column_of(set, which, fallback)
  if which == nil then return fallback end
  for i, name in ipairs(set.names) do if name == which or i == which then return i end end
  fail(("set:plot: there is no parameter '%s' (parameters: %s)"):format(tostring(which),
    table.concat(set.names, ", ")))
end

doc { name = "parameter_set:plot", module = "identification", sig = "set:plot([p, q]) -> figure",
  text = "The set in the plane of two parameters (for more than two: its projection), with the Chebyshev "
    .. "centre.",
  example = "d = iddata{ u = {1,-1,2,0,-2,1,3,-1}, y = {1.2,-.1,1.9,.4,-2.1,-.2,2.6,.5} }\n"
    .. "arx(d, { na = 1, nb = 1, nk = 0, noise = uniform(-1, 1), ic = \"zero\" }):plot()",
  gives = "figure 'parameters that explain all 8 rows': 2 series, 6 points",
  function(set, p, q)
    if #set.names < 2 then fail "set:plot needs at least two parameters" end
    local i, j = column_of(set, p, 1), column_of(set, q, 2)
    local vertices, points = named "evaluate" (set.vertices), {}
    for k = 1, vertices.rows do points[k] = { vertices(k, i), vertices(k, j) } end
    local x, y = {}, {}
    local ring = #points > 2 and hull(points) or points
    for k, point in ipairs(ring) do x[k], y[k] = point[1], point[2] end
    x[#x + 1], y[#y + 1] = x[1], y[1]
    local center = set.center
    return named "plot" (x, y, { center[i] }, { center[j] },
      { xlabel = set.names[i], ylabel = set.names[j], labels = { "the set", "Chebyshev centre" },
        style = { "line", "points" },
        title = ("parameters that explain all %d rows"):format(set.rows) })
  end }

doc { name = "fit_result:plot", module = "identification", sig = "r:plot([options]) -> figure",
  options = of_output, options_at = 2,
  text = "The measured outputs and those of the fitted model, a panel each; { output = name or number } shows "
    .. "one.",
  example = "x, k = var \"x\", param(\"k\", 1)\nd = iddata{ y = {1, 0.6, 0.4}, Ts = 1 }\n"
    .. "fit(dae{ der(x) ~ -k*x }, { params = {k}, data = d, y = x, start = { x = 1 } }):plot()",
  gives = "figure: 2 series, 6 points",
  function(r, options)
    local d = r.data
    return by_output("r:plot", d.y_names, options, function(i, rest)
      return named "plot" (d.t, column(d.y, i), d.t, column(r.simulated, i),
        with_options({ labels = { d.y_names[i], d.y_names[i] .. " fitted" }, xlabel = "t [s]",
          style = { "points", "line" } }, rest))
    end)
  end }

-- What a linear system answers, asked of an estimated model.
for _, row in ipairs {
  { "poles", "() -> roots",
    "Poles of the transfer function from u to y, with sampling time: inside the unit circle is stable." },
  { "zeros", "() -> roots", "Its zeros." },
  { "dcgain", "() -> number or matrix", "Its static gain G(1)." },
  { "step", "([to or times]) -> response", "Its step response.", "(10)" },
  { "impulse", "([to or times]) -> response", "Its impulse response.", "(10)" },
  { "bode", "([ω]) -> frequency response", "Its frequency response." },
  { "freqresp", "([ω]) -> frequency response", "The same as mod:bode.", "{ 0.1, 0.3, 1 }" },
  { "nyquist", "([ω]) -> figure", "Its Nyquist curve." },
  { "pzmap", "() -> figure", "Its poles and zeros in the plane." },
} do
  local name, sig, text, arguments = table.unpack(row)
  doc { name = "idmodel:" .. name, module = "identification", sig = "mod:" .. name .. sig, text = text,
    example = "d = iddata{ y = {0, 2, 1, 4, 2, 3}, u = {1, 0.5, 2, 1, 0, 1}, Ts = 1 }\n"
      .. "return arx(d, { na = 1, nb = 2 }):" .. name .. (arguments or "()"),
    function(m, ...)
      local G = (m.kind == "state space" or #m.y_names > 1) and m:ss() or m:tf()
      return G[name](G, ...)
    end }
end

doc { name = "order_scan_result:plot", module = "identification", sig = "s:plot([options]) -> figure",
  options = figures.flat, options_at = 2,
  text = "For every number of parameters the best loss, and the best loss on the validation data; the least "
    .. "is marked.",
  example = "u, y = {}, {}\nfor t = 1, 60 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-2] or 0) "
    .. "+ ((7*t) % 5)/50 end\n"
    .. "order_scan(iddata{ y = y, u = u }, { na = {1, 2}, nb = 1, nk = {1, 3} }):plot()",
  gives = "figure 'order scan: best model of every size': 2 series, 3 points",
  function(s, options)
    local best, best_v, sizes = {}, {}, {}
    for i = 1, #s do
      local m = s[i]
      local d = m.parameters
      if not best[d] then sizes[#sizes + 1] = d end
      best[d] = math.min(best[d] or math.huge, m.loss)
      if m.validation_loss then best_v[d] = math.min(best_v[d] or math.huge, m.validation_loss) end
    end
    table.sort(sizes)
    local loss, loss_v = {}, {}
    for i, d in ipairs(sizes) do loss[i], loss_v[i] = best[d], best_v[d] end
    local arguments = { sizes, loss }
    if #loss_v > 0 then arguments[3], arguments[4] = sizes, loss_v end
    local judged = #loss_v > 0 and loss_v or loss
    local least = 1
    for i = 2, #judged do if judged[i] < judged[least] then least = i end end
    arguments[#arguments + 1], arguments[#arguments + 2] = { sizes[least] }, { judged[least] }
    local labels = #loss_v > 0 and { "estimation", "validation" } or { "estimation" }
    local style = #loss_v > 0 and { "line", "line", "points" } or { "line", "points" }
    labels[#labels + 1] = ("least: %d parameters"):format(sizes[least])
    arguments[#arguments + 1] = with_options({ title = "order scan: best model of every size",
      xlabel = "parameters", ylabel = "loss", style = style, labels = labels }, options)
    return named "plot" (table.unpack(arguments))
  end }

doc { name = "comparison:plot", module = "identification", sig = "c:plot([options]) -> figure",
  options = of_output, options_at = 2,
  text = "The measured output and the simulation of every model, with its fit in the legend. Options as in "
    .. "plot; several outputs have a panel each, { output = name or number } shows one.",
  example = "d = iddata{ y = {0, 2, 1, 4, 2}, u = {1, 0.5, 2, 1, 0} }\ncompare(d, fir(d, { nb = 1 })):plot()",
  gives = "figure 'simulation': 2 series, 10 points",
  function(c, options)
    local d = c.data
    local simulated = {}
    for i = 1, #c do simulated[i] = c.models[i]:simulate(d) end
    return by_output("c:plot", d.y_names, options, function(j, rest)
      local arguments, labels = { d.t, column(d.y, j) }, { "measured" }
      for i = 1, #c do
        local fit = #d.y_names == 1 and c[i].simulation or c.models[i]:fit(d, "simulation")[j]
        arguments[#arguments + 1], arguments[#arguments + 2] = d.t, column(simulated[i], j)
        labels[#labels + 1] = ("%s, %.4g %%"):format(c[i].name, fit)
      end
      arguments[#arguments + 1] = with_options({ title = "simulation", labels = labels, xlabel = "t [s]",
        ylabel = d.y_names[j], style = "line" }, rest)
      return named "plot" (table.unpack(arguments))
    end)
  end }

-- ── LaTeX ──

local function polynomial_latex(row)
  local out = ""
  for k = 1, row.cols do
    local c = row[k] + 0.0
    if c ~= 0 then
      local size = ("%.6g"):format(math.abs(c))
      local power = k == 1 and "" or ("q^{-%d}"):format(k - 1)
      local term = power == "" and size or (size == "1" and "" or size .. "\\,") .. power
      out = out .. (out == "" and (c < 0 and "-" or "") or (c < 0 and " - " or " + ")) .. term
    end
  end
  return out == "" and "0" or out
end

local function entries_of(value) return type(value) == "table" and value or { value } end

doc { name = "idmodel:latex", module = "identification", sig = "mod:latex() -> string",
  text = "The model with its polynomials in LaTeX; of a state-space model its matrices.",
  example = "d = iddata{ y = {0, 2, 1, 4}, u = {1, 0.5, 2, 1} }\nprint(fir(d, { nb = 1 }):latex())",
  gives = "\\begin{aligned} y(t) &= B(q)\\,u(t) + e(t) \\\\ B(q) &= 2\\,q^{-1} \\end{aligned}",
  function(m)
    if m.kind == "state space" then return m:ss():latex() end
    if #m.y_names > 1 then
      fail "mod:latex is for models with one output; mod:ss():latex() gives the state space"
    end
    local B, F, lines = entries_of(m.B), entries_of(m.F), {}
    local function name(letter, i) return #B > 1 and letter .. "_{" .. i .. "}(q)" or letter .. "(q)" end
    local right = {}
    for i, u in ipairs(m.u_names) do
      local factor = F[i].cols > 1 and ("\\frac{%s}{%s}"):format(name("B", i), name("F", i)) or name("B", i)
      right[#right + 1] = factor .. "\\,\\mathrm{" .. u:gsub("_", "\\_") .. "}(t)"
      if #u == 1 then right[#right] = factor .. "\\," .. u .. "(t)" end
    end
    local noise = m.D.cols > 1 and ("\\frac{%s}{D(q)}\\,e(t)"):format(m.C.cols > 1 and "C(q)" or "1")
      or (m.C.cols > 1 and "C(q)\\,e(t)" or "e(t)")
    right[#right + 1] = noise
    local y = #m.y_names[1] == 1 and m.y_names[1] or "\\mathrm{" .. m.y_names[1]:gsub("_", "\\_") .. "}"
    lines[1] = (m.A.cols > 1 and "A(q)\\," or "") .. y .. "(t) &= " .. table.concat(right, " + ")
    local function add(label, row) lines[#lines + 1] = label .. " &= " .. polynomial_latex(row) end
    if m.A.cols > 1 then add("A(q)", m.A) end
    for i in ipairs(m.u_names) do
      add(name("B", i), B[i])
      if F[i].cols > 1 then add(name("F", i), F[i]) end
    end
    if m.C.cols > 1 then add("C(q)", m.C) end
    if m.D.cols > 1 then add("D(q)", m.D) end
    return "\\begin{aligned} " .. table.concat(lines, " \\\\ ") .. " \\end{aligned}"
  end }

doc { name = "predictor:tf", module = "identification", sig = 'p:tf(["plant" | "noise" [, Ts = 1]]) -> G',
  text = [[The system G from u to y, or with "noise" the system H from e to y, of a predictor that is linear
    in u(t-k), y(t-k), yhat(t-k) and e(t-k): H ŷ = G u + (H - 1) y.]],
  example = [[
    y, u = func "y", func "u"
    return predictor(y(t - 1)/2 + 3*u(t - 1)):tf()]],
  gives = "transfer function, sampling time 1\n     3\n  ───────\n  z - 1/2",
  function(p, which, Ts)
    return include "identification/predictor_systems".systems(p, which or "plant", Ts or 1)
  end }
