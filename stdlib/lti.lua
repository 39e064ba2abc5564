-- Figures of linear systems: responses in time, Bode and Nyquist curves, pole-zero maps (src/lua/bind/lti/lti_response.cpp).

local unpack = table.unpack

local function copy(into, options)
  for key, value in pairs(options or {}) do into[key] = value end
  return into
end

-- options of figure{}, without what a figure of this kind sets by itself
local function check_options(by, options)
  if options ~= nil and type(options) ~= "table" then fail(by .. ": options are a table { title = … }") end
  return options or {}
end

local function column(matrix, j)
  local values = {}
  for i = 1, matrix.rows do values[i] = matrix(i, j) end
  return values
end

-- r:plot(), r:show() and r:save() of a type whose picture is make(r, options); what: the picture in the text of help.
local function drawn_as(name, what, make, plot)
  local module = "lti responses"
  doc { name = name .. ":plot", module = module, sig = "r:plot([options]) -> figure", text = plot.text, example = plot.example,
    gives = plot.gives, make }
  doc { name = name .. ":show", module = module, sig = "r:show()", text = "Draws " .. what .. " in the terminal.",
    function(r) return make(r):show() end }
  doc { name = name .. ":save", module = module, sig = "r:save(file) -> r", text = "Writes " .. what .. " to a file.",
    function(r, file)
      make(r):save(file)
      return r
    end }
end

-- ── time ────────────────────────────────────────────────────────────────────────────────────────────────────────────

local titles = { step = "Step response", impulse = "Impulse response", initial = "Response to the initial state",
                 lsim = "Simulation" }

local function response_figure(r, options)
  local labels, series = r.labels, {}
  for j = 1, #labels do
    series[j] = { x = r.t, y = column(r.y, j), labels = { labels[j] }, style = r.discrete and "steps" or "line" }
  end
  return figure(copy({ by = "plot", series = series, title = titles[r.kind], xlabel = "t",
                       ylabel = #labels == 1 and labels[1] or nil, legend = #labels > 1 }, check_options("plot", options)))
end

drawn_as("response", "r:plot()", response_figure, { text = "The outputs over time; options as in plot.",
  example = "return tf({1}, {1, 1}):step(5):plot()", gives = "figure 'Step response': 1 series, 301 points" })

-- ── frequency ───────────────────────────────────────────────────────────────────────────────────────────────────────

local function bode_figure(r, options)
  options = check_options("plot", options)
  local labels, gain, angle = r.labels, {}, {}
  for j = 1, #labels do
    gain[j] = { x = r.w, y = column(r.db, j), labels = { labels[j] } }
    angle[j] = { x = r.w, y = column(r.phase, j), labels = { labels[j] } }
  end
  local legend = #labels > 1
  local below = figure { by = "bode", series = angle, xlog = true, xlabel = "ω [rad/s]", ylabel = "phase [°]", legend = false,
    ystep = 45 }
  return figure(copy({ by = "bode", series = gain, xlog = true, title = "Bode diagram", ylabel = "gain [dB]", legend = legend,
                       below = { below } }, options))
end

drawn_as("frequency response", "the Bode diagram", bode_figure, { text = "The Bode diagram: gain in dB, and the phase below it.",
  example = "return tf({1}, {1, 1}):bode({0.1, 1, 10}):plot()", gives = "figure 'Bode diagram': 1 series, 3 points, 2 panels" })

-- The curve and its mirror image; a pole on the axis sends it to infinity, so far-away points are left out.
local function nyquist_figure(G, frequencies, options)
  options = check_options("nyquist", options)
  local r = G:freqresp(frequencies)
  local labels, series, left_out = r.labels, {}, 0
  local far = 0
  for j = 1, #labels do
    local sizes = column(r.mag, j)
    table.sort(sizes)
    far = math.max(far, math.max(5, 3 * sizes[(#sizes + 1) // 2]))
  end
  for j = 1, #labels do
    local re, im, x, y, mirrored = column(r.re, j), column(r.im, j), {}, {}, {}
    for k = 1, #re do
      if re[k]^2 + im[k]^2 <= far^2 then x[#x + 1], y[#y + 1], mirrored[#mirrored + 1] = re[k], im[k], -im[k]
      else left_out = left_out + 1 end
    end
    if #x > 0 then
      series[#series + 1] = { x = x, y = y, labels = { labels[j] .. "(iω), ω > 0" } }
      series[#series + 1] = { x = x, y = mirrored, labels = { labels[j] .. "(iω), ω < 0" }, style = "dots" }
    end
  end
  series[#series + 1] = { x = { -1 }, y = { 0 }, labels = { "-1" }, style = "points" }
  local notes = left_out > 0 and { ("%d frequencies with |G| > %.3g are left out"):format(left_out, far) } or nil
  return figure(copy({ by = "nyquist", series = series, title = "Nyquist curve", xlabel = "Re G", ylabel = "Im G", equal = true,
                       notes = notes }, options))
end

local function check_system(by, G)
  if object_type(G) ~= "lti" then fail(by .. ": expected a linear system (ss, tf, zpk)") end
  return G
end

doc { name = "nyquist", module = "lti responses", sig = "nyquist(G [, frequencies [, options]]) -> figure",
  text = "G(iω) in the complex plane, its mirror image for ω < 0, and the point -1. The closed loop's stability: margin(G).",
  example = "return nyquist(tf({4}, {1, 3, 3, 1})).title", gives = "Nyquist curve",
  function(G, ...) return nyquist_figure(check_system("nyquist", G), ...) end }
doc { name = "lti:nyquist", module = "lti responses", sig = "G:nyquist([frequencies [, options]]) -> figure",
  text = "The same as nyquist(G).", nyquist_figure }

doc { name = "bode", module = "lti responses", sig = "bode(G [, frequencies or { from, to }]) -> frequency response",
  text = "The same as G:bode(): gain, phase and margins; :plot() is the diagram.",
  example = "return bode(tf({1}, {1, 1}), {1}).phase(1, 1)", gives = "-45.0",
  function(G, ...) return check_system("bode", G):bode(...) end }

for _, kind in ipairs { "step", "impulse" } do
  doc { name = kind, module = "lti responses", sig = kind .. "(G [, to or times]) -> response",
    text = ("The same as G:%s()."):format(kind),
    example = ("return #%s(tf({1}, {1, 1}), {0, 1, 2}).t"):format(kind), gives = "3",
    function(G, ...)
      check_system(kind, G)
      return G[kind](G, ...)
    end }
end

-- ── the complex plane ───────────────────────────────────────────────────────────────────────────────────────────────

local function map_of(by, G, options)
  check_system(by, G)
  options = check_options(by, options)
  local series, discrete = {}, G.Ts ~= 0
  for _, each in ipairs { { G:poles(), "poles", "cross" }, { G:zeros(), "zeros", "ring" } } do
    local roots, name, marker = unpack(each)
    if #roots > 0 then
      series[#series + 1] = { x = roots.re, y = roots.im, labels = { name }, style = "points", marker = marker }
    end
  end
  if discrete then
    local x, y = {}, {}
    for k = 0, 180 do x[k + 1], y[k + 1] = math.cos(k * math.pi / 90), math.sin(k * math.pi / 90) end
    series[#series + 1] = { x = x, y = y, labels = { "unit circle" }, style = "dots" }
  end
  if #series == 0 then fail(by .. ": a gain has neither poles nor zeros") end
  local low, high, top = discrete and -1 or 0, discrete and 1 or 0, discrete and 1 or 0
  for _, each in ipairs(series) do
    if object_type(each.x) == "matrix" then
      for k = 1, each.x.rows do
        low, high = math.min(low, evaluate(each.x[k])), math.max(high, evaluate(each.x[k]))
        top = math.max(top, math.abs(evaluate(each.y[k])))
      end
    end
  end
  local margin = 0.15 * math.max(high - low, 2 * top, 1e-9)
  return figure(copy({ by = by, series = series, xlim = { low - margin, high + margin }, ylim = { -top - margin, top + margin },
                       title = "Poles and zeros", xlabel = "Re " .. (discrete and "z" or "s"),
                       ylabel = "Im " .. (discrete and "z" or "s"), equal = true }, options))
end

doc { name = "pzmap", module = "lti responses", sig = "pzmap(G [, options]) -> figure",
  text = "Poles × and zeros ○ in the complex plane; in discrete time with the unit circle.",
  example = "return pzmap(tf({1, 2}, {1, 2, 5}))", gives = "figure 'Poles and zeros': 2 series, 3 points",
  function(G, options) return map_of("pzmap", G, options) end }
doc { name = "lti:pzmap", module = "lti responses", sig = "G:pzmap([options]) -> figure", text = "The same as pzmap(G).",
  function(G, options) return map_of("pzmap", G, options) end }

-- ── spectra ─────────────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "spectrum:plot", module = "signals", sig = "s:plot([options]) -> figure",
  text = "The periodogram over the frequency in Hz, in dB; lines below 10⁻¹² of the largest are left out.",
  example = "return periodogram(prbs(31)):plot().title", gives = "Periodogram",
  function(s, options)
    local f, power, top = {}, {}, 0
    for k = 1, s.power.rows do top = math.max(top, s.power[k]) end
    if top == 0 then fail "plot: the signal is zero" end
    for k = 1, s.power.rows do
      if s.power[k] > 1e-12 * top then f[#f + 1], power[#power + 1] = s.f[k], 10 * math.log(s.power[k], 10) end
    end
    return figure(copy({ by = "plot", series = { { x = f, y = power, style = #f <= 64 and "points" or "line" } },
                         title = "Periodogram", xlabel = "f [Hz]", ylabel = "power [dB]" }, check_options("plot", options)))
  end }
doc { name = "spectrum:show", module = "signals", sig = "s:show()", text = "Draws s:plot() in the terminal.",
  function(s) return s:plot():show() end }
