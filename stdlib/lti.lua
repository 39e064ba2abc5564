-- Figures of linear systems: responses in time, Bode and Nyquist curves, pole-zero maps
-- (src/lua/bind/lti/lti_response.cpp).

local figure_options = include("plot/options").frame

local unpack = table.unpack

local function copy(into, options)
  for key, value in pairs(options or {}) do into[key] = value end
  return into
end

local function column(matrix, j)
  local values = {}
  for i = 1, matrix.rows do values[i] = matrix(i, j) end
  return values
end

-- r:plot(), r:show() and r:save() of a type whose picture is make(r, options); what: the picture in the text
-- of help; value: one, for the examples.
local function drawn_as(name, what, make, plot, value)
  local module = "lti responses"
  doc { name = name .. ":plot", module = module, sig = "r:plot([options]) -> figure",
    options = figure_options, text = plot.text, example = plot.example,
    gives = plot.gives, make }
  doc { name = name .. ":show", module = module, sig = "r:show()",
    text = "Draws " .. what .. " in the terminal.", example = value .. ":show()",
    function(r) return make(r):show() end }
  doc { name = name .. ":save", module = module, sig = "r:save(file) -> r",
    text = "Writes " .. what .. " to a file.", example = value .. ':save(os.tmpname() .. ".svg")',
    function(r, file)
      make(r):save(file)
      return r
    end }
end

-- ── time ───────────────────────────────────────────────────────────────────────────────────────────────────

local titles = { step = "Step response", impulse = "Impulse response",
  initial = "Response to the initial state",
                 lsim = "Simulation" }

local function response_figure(r, options)
  local labels, series = r.labels, {}
  for j = 1, #labels do
    series[j] = { x = r.t, y = column(r.y, j), labels = { labels[j] },
      style = r.discrete and "steps" or "line" }
  end
  return figure(copy({ by = "plot", series = series, title = titles[r.kind], xlabel = "t",
                       ylabel = #labels == 1 and labels[1] or nil, legend = #labels > 1 },
                         check_options("plot", options, figure_options)))
end

drawn_as("response", "r:plot()", response_figure, { text = "The outputs over time; options as in plot.",
  example = "return tf({1}, {1, 1}):step(5):plot()", gives = "figure 'Step response': 1 series, 301 points" },
  "tf({1}, {1, 1}):step(5)")

-- ── frequency ──────────────────────────────────────────────────────────────────────────────────────────────

-- Ticks every 45°, or 90° where the phase turns far.
local function phase_step(curves)
  local low, high = math.huge, -math.huge
  for _, c in ipairs(curves) do
    for _, v in ipairs(c.y) do if v == v then low, high = math.min(low, v), math.max(high, v) end end
  end
  return high - low > 400 and 90 or 45
end

local function bode_figure(r, options)
  options = check_options("plot", options, figure_options)
  local labels, gain, angle = r.labels, {}, {}
  for j = 1, #labels do
    gain[j] = { x = r.w, y = column(r.db, j), labels = { labels[j] } }
    angle[j] = { x = r.w, y = column(r.phase, j), labels = { labels[j] } }
  end
  local legend = #labels > 1
  local below = figure { by = "bode", series = angle, xlog = true, xlabel = "ω [rad/s]", ylabel = "phase [°]",
    legend = false,
    ystep = phase_step(angle) }
  return figure(copy({ by = "bode", series = gain, xlog = true, title = "Bode diagram", ylabel = "gain [dB]",
    legend = legend,
                       below = { below } }, options))
end

drawn_as("frequency response", "the Bode diagram", bode_figure,
  { text = "The Bode diagram: gain in dB, and the phase below it.",
  example = "return tf({1}, {1, 1}):bode({0.1, 1, 10}):plot()",
    gives = "figure 'Bode diagram': 1 series, 3 points, 2 panels" }, "tf({1}, {1, 1}):bode()")

-- The head of an arrow in the middle of a curve, which is `size` long.
local function arrow_head(x, y, size)
  local length, half, k = { 0 }, 0, 2
  for i = 2, #x do length[i] = length[i - 1] + math.sqrt((x[i] - x[i - 1])^2 + (y[i] - y[i - 1])^2) end
  half = length[#x]/2
  while k < #x and length[k] < half do k = k + 1 end
  local angle = math.atan(y[k] - y[k - 1], x[k] - x[k - 1])
  local function corner(turn)
    return x[k] - size*math.cos(angle + turn), y[k] - size*math.sin(angle + turn)
  end
  local ax, ay = corner(0.4)
  local bx, by = corner(-0.4)
  return { x = { ax, x[k], bx }, y = { ay, y[k], by }, labels = { "" }, colour = "grey" }
end

-- G(0), where a Nyquist curve begins; nil with an integrator, nil of what has parameters without values.
local function static_gain(G)
  local good, gain = pcall(function() return tonumber(evaluate(G:dcgain())) end)
  return good and gain or nil
end

-- Frequencies from near 0: where a Nyquist curve leaves the real axis.
local function from_zero(w)
  local all, more = {}, 60
  for k = 1, more do all[k] = w[1]*10^(3*(k - 1)/more - 3) end
  for k = 1, #w do all[#all + 1] = w[k] end
  return all
end

-- The curve and its mirror image; a pole on the axis sends it to infinity, so far-away points are left out.
local function nyquist_figure(G, frequencies, options)
  options = check_options("nyquist", options, figure_options)
  local r = G:freqresp(frequencies)
  local at_rest = frequencies == nil and #r.labels == 1 and static_gain(G)
  if at_rest then r = G:freqresp(from_zero(r.w)) end
  local labels, series, heads, left_out = r.labels, {}, {}, 0
  local far, height, left, right = 0, 0, -1, -1
  for j = 1, #labels do
    local sizes = column(r.mag, j)
    table.sort(sizes)
    far = math.max(far, math.max(5, 3 * sizes[(#sizes + 1) // 2]))
  end
  for j = 1, #labels do
    local re, im, x, y, mirrored = column(r.re, j), column(r.im, j), {}, {}, {}
    if at_rest then x[1], y[1], mirrored[1] = at_rest, 0, 0 end
    for k = 1, #re do
      if re[k]^2 + im[k]^2 <= far^2 then x[#x + 1], y[#y + 1], mirrored[#mirrored + 1] = re[k], im[k], -im[k]
      else left_out = left_out + 1 end
    end
    if #x > 0 then
      series[#series + 1] = { x = x, y = y, labels = { labels[j] .. "(iω), ω > 0" } }
      series[#series + 1] = { x = x, y = mirrored, labels = { labels[j] .. "(iω), ω < 0" }, dash = "dashed" }
      local size, moved = 0, 0
      for k = 1, #x do
        size, height = math.max(size, math.abs(y[k]), math.abs(x[k])), math.max(height, math.abs(y[k]))
        moved = math.max(moved, math.abs(x[k] - x[1]), math.abs(y[k] - y[1]))
        left, right = math.min(left, x[k]), math.max(right, x[k])
      end
      if moved <= 1e-6*size then
        series[#series].style, series[#series - 1].style = "points", "points"
      elseif #x > 2 then
        heads[#heads + 1] = arrow_head(x, y, 0.08*size)
      end
    end
  end
  series[#series + 1] = { x = { -1 }, y = { 0 }, labels = { "-1" }, style = "points", marker = "plus" }
  table.move(heads, 1, #heads, #series + 1, series)
  local notes = left_out > 0 and { ("%d frequencies with |G| > %.3g are left out"):format(left_out, far) }
    or nil
  local span = math.max(right - left, 1)  -- a curve on the real axis has a frame around it
  local ylim = height < 0.1*span and { -0.25*span, 0.25*span } or nil
  return figure(copy({ by = "nyquist", ylim = ylim, series = series, title = "Nyquist curve", xlabel = "Re G",
    ylabel = "Im G", equal = true, legend = "right", notes = notes }, options))
end

local function check_system(by, G)
  local kind = object_type(as_model(G))
  if kind == "model" then
    fail(by .. ": a model becomes a linear system at a point: G = sys:linearize(at)")
  end
  if kind ~= "lti" and kind ~= "delay system" then fail(by .. ": expected a linear system (ss, tf, zpk)") end
  if kind == "lti" and #G.inputs == 0 then
    fail(by .. ': the system has no input; a model gets one by u = input "u" in its equations')
  end
  return G
end

doc { name = "nyquist", module = "lti responses", sig = "nyquist(G [, frequencies [, options]]) -> figure",
  options = figure_options,
  text = "G(iω) in the complex plane, its mirror image for ω < 0, and the point -1. The closed loop's "
    .. "stability: margin(G).",
  example = "return nyquist(tf({4}, {1, 3, 3, 1})).title", gives = "Nyquist curve",
  function(G, ...) return nyquist_figure(check_system("nyquist", G), ...) end }
doc { name = "lti:nyquist", module = "lti responses", sig = "G:nyquist([frequencies [, options]]) -> figure",
  options = figure_options,
  text = "The same as nyquist(G).",
  example = "return tf({1}, {1, 1}):nyquist().title", gives = "Nyquist curve", nyquist_figure }

doc { name = "bode", module = "lti responses",
  sig = "bode(G [, frequencies or { from, to }]) -> frequency response",
  text = "The same as G:bode(): gain, phase and margins; :plot() is the diagram.",
  example = "return bode(tf({1}, {1, 1}), {1}).phase(1, 1)", gives = "-45.0",
  function(G, second, ...)
    if object_type(second) == "lti" or object_type(second) == "delay system" then
      fail "bode: several systems in one diagram are overlay(bode(G):plot(), bode(H):plot())"
    end
    return check_system("bode", G):bode(second, ...)
  end }

for _, kind in ipairs { "step", "impulse" } do
  doc { name = kind, module = "lti responses", sig = kind .. "(G [, to or times]) -> response",
    text = ("The same as G:%s()."):format(kind),
    example = ("return #%s(tf({1}, {1, 1}), {0, 1, 2}).t"):format(kind), gives = "3",
    function(G, ...)
      check_system(kind, G)
      return G[kind](G, ...)
    end }
end

-- ── the complex plane ──────────────────────────────────────────────────────────────────────────────────────

-- Poles as × and zeros as ○.
local function marked_roots(G)
  local series = {}
  for _, each in ipairs { { G:poles(), "poles", "cross" }, { G:zeros(), "zeros", "ring" } } do
    local roots, name, marker = unpack(each)
    if #roots > 0 then
      series[#series + 1] = { x = roots.re, y = roots.im, labels = { name }, style = "points",
        marker = marker }
    end
  end
  return series
end

local function unit_circle()
  local x, y = {}, {}
  for k = 0, 180 do x[k + 1], y[k + 1] = math.cos(k * math.pi / 90), math.sin(k * math.pi / 90) end
  return { x = x, y = y, labels = { "unit circle" }, style = "dots" }
end

-- The numbers of poles and zeros that coincide, beside them.
local function multiple(G, margin)
  local texts = {}
  for _, roots in ipairs { G:poles(), G:zeros() } do
    local counted = {}
    for k = 1, #roots do
      local x, y, known = evaluate(roots.re[k]), evaluate(roots.im[k]), nil
      for _, c in ipairs(counted) do
        if math.abs(c[1] - x) + math.abs(c[2] - y) < 1e-3 * margin then known = c end
      end
      if known then known[3] = known[3] + 1 else counted[#counted + 1] = { x, y, 1 } end
    end
    for _, c in ipairs(counted) do
      if c[3] > 1 then texts[#texts + 1] = { c[1] + 0.1 * margin, c[2] + 0.25 * margin, tostring(c[3]) } end
    end
  end
  return #texts > 0 and texts or nil
end

local function map_of(by, G, options)
  if object_type(check_system(by, G)) == "delay system" then
    fail(by .. ": a delay in a loop has infinitely many poles; pade(G, n) has finitely many")
  end
  options = check_options(by, options, figure_options)
  local series, discrete = marked_roots(G), G.Ts ~= 0
  if discrete then series[#series + 1] = unit_circle() end
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
  local axes = not discrete and { 0 } or nil
  return figure(copy({ by = by, series = series, hlines = axes, vlines = axes, texts = multiple(G, margin),
    xlim = { low - margin, high + margin },
    ylim = { -top - margin, top + margin },
                       title = "Poles and zeros", xlabel = "Re " .. (discrete and "z" or "s"),
                       ylabel = "Im " .. (discrete and "z" or "s"), equal = true }, options))
end

doc { name = "pzmap", module = "lti responses", sig = "pzmap(G [, options]) -> figure",
  options = figure_options,
  text = "Poles × and zeros ○ in the complex plane; in discrete time with the unit circle.",
  example = "return pzmap(tf({1, 2}, {1, 2, 5}))", gives = "figure 'Poles and zeros': 2 series, 3 points",
  function(G, options) return map_of("pzmap", G, options) end }
doc { name = "lti:pzmap", module = "lti responses", sig = "G:pzmap([options]) -> figure",
  text = "The same as pzmap(G).", options = figure_options,
  example = "return tf({1, 2}, {1, 2, 5}):pzmap().title", gives = "Poles and zeros",
  function(G, options) return map_of("pzmap", G, options) end }

-- ── root loci and delays ────────────────────────────────────────────────────────────────────────────────

-- The entries of `now` in the order of the nearest ones of `before`.
local function matched(before, now)
  local used, order = {}, {}
  for i, b in ipairs(before) do
    local best, least
    for j, z in ipairs(now) do
      local d = (z[1] - b[1])^2 + (z[2] - b[2])^2
      if not used[j] and (not least or d < least) then best, least = j, d end
    end
    used[best], order[i] = true, now[best]
  end
  return order
end

-- Gains at which something happens: 1/|G(iω)|, two decades beyond on both sides.
local function locus_gains(G)
  local low, high = math.huge, 0
  local mag = G:freqresp().mag
  for k = 1, mag.rows do
    local size = mag(k, 1)
    if size > 0 and size < math.huge then low, high = math.min(low, 1 / size), math.max(high, 1 / size) end
  end
  if high == 0 then fail "rlocus: the system is zero" end
  local gains, count = { 0 }, 600
  for k = 0, count do gains[#gains + 1] = 0.01 * low * (1e4 * high / low)^(k / count) end
  return gains
end

-- Eigenvalues of A - k B C/(1 + k D) as { re, im }.
local function closed_loop_poles(S, k)
  local e = named "eig" (S.A - S.B * S.C * (k / (1 + k * S.D)))
  local list = {}
  for i = 1, e.re.rows do list[i] = { e.re[i], e.im[i] } end
  return list
end

local function root_locus(G, gains, options)
  if object_type(G) ~= "lti" then fail "rlocus: expected a linear system (ss, tf, zpk)" end
  if #G.inputs ~= 1 or #G.outputs ~= 1 then
    fail "rlocus is for one input and one output; choose one with G:channel(i, j)"
  end
  options = check_options("rlocus", options, figure_options)
  local g, evaluate = G:ss(), named "evaluate"
  if g.A.rows == 0 then fail "rlocus: a gain has no poles" end
  local S = { A = evaluate(g.A) * 1.0, B = evaluate(g.B) * 1.0, C = evaluate(g.C) * 1.0,
              D = evaluate(g.D(1, 1)) }
  local branches, now, far = {}, nil, 0
  local poles, zeros = G:poles(), G:zeros()
  for _, roots in ipairs { poles, zeros } do
    for k = 1, #roots do
      far = math.max(far, 3 * math.sqrt(evaluate(roots.re[k])^2 + evaluate(roots.im[k])^2))
    end
  end
  if far == 0 then far = 3 end
  for i, k in ipairs(gains or {}) do
    if type(k) ~= "number" then fail(("rlocus: gain %d is no number"):format(i)) end
  end
  for _, k in ipairs(gains or locus_gains(G)) do
    if 1 + k * S.D ~= 0 then
      local list = closed_loop_poles(S, k)
      now = now and matched(now, list) or list
      for i, z in ipairs(now) do
        branches[i] = branches[i] or { x = {}, y = {} }
        local b = branches[i]
        if z[1]^2 + z[2]^2 <= far^2 then b.x[#b.x + 1], b.y[#b.y + 1] = z[1], z[2] end
      end
    end
  end
  local series = {}
  for i, b in ipairs(branches) do
    if #b.x > 0 then series[#series + 1] = { x = b.x, y = b.y, labels = { "branch " .. i } } end
  end
  for _, each in ipairs(marked_roots(G)) do series[#series + 1] = each end
  local v, axes = G.Ts ~= 0 and "z" or "s", G.Ts == 0 and { 0 } or nil
  if G.Ts ~= 0 then series[#series + 1] = unit_circle() end
  return figure(copy({ by = "rlocus", series = series, title = "Root locus", xlabel = "Re " .. v,
                       ylabel = "Im " .. v, equal = true, legend = false, hlines = axes, vlines = axes },
    options))
end

doc { name = "rlocus", module = "lti responses", sig = "rlocus(G [, gains [, options]]) -> figure",
  options = figure_options,
  text = "The poles of the closed loop G/(1 + k G) for k from 0 on, or for a list of gains, with the poles "
    .. "and zeros of G. Points beyond three times the farthest pole or zero are left out.",
  example = "return rlocus(tf({1, 2}, {1, 1, 0})).title", gives = "Root locus",
  root_locus }

doc { name = "pade", module = "lti", sig = "pade(T [, n = 1]) or pade(G [, n = 1]) -> G",
  text = "The Padé approximant of the delay exp(-T s), order n in numerator and denominator: |G(iω)| = 1, "
    .. "and the phase is right up to about ω = n/T. T may be a parameter. Of a "
    .. "system with delays: every delay so.",
  example = "return pade(2, 2):dcgain()", gives = "1",
  function(T, n)
    n = n or 1
    if object_type(T) == "delay system" then return T:pade(n) end
    if math.type(n) ~= "integer" or n < 1 or n > 10 then
      fail "pade: the order n is a whole number from 1 to 10"
    end
    if type(T) == "number" and not (T >= 0 and T < math.huge) then
      fail(("pade: T = %g; a delay is a time of at least 0"):format(T))
    end
    if T == 0 then return named "tf" ({ 1 }, { 1 }) end
    local above, below = {}, {}
    local function factorial(k) local f = 1 for i = 2, k do f = f * i end return f end
    for k = n, 0, -1 do
      local c = factorial(2 * n - k) // (factorial(k) * factorial(n - k))
      local term = c * T^k
      below[#below + 1], above[#above + 1] = term, (k % 2 == 1 and -1 or 1) * term
    end
    return named "tf" (above, below)
  end }

-- ── spectra ────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "spectrum:plot", module = "signals", sig = "s:plot([options]) -> figure",
  options = figure_options,
  text = "The periodogram over the frequency in Hz, in dB; lines below 10⁻¹² of the largest are left out.",
  example = "return periodogram(prbs(31)):plot().title", gives = "Periodogram",
  function(s, options)
    local f, power, top = {}, {}, 0
    for k = 1, s.power.rows do top = math.max(top, s.power[k]) end
    if top == 0 then fail "plot: the signal is zero" end
    for k = 1, s.power.rows do
      if s.power[k] > 1e-12 * top then
        f[#f + 1], power[#power + 1] = s.f[k], 10 * math.log(s.power[k], 10)
      end
    end
    return figure(copy({ by = "plot", series = {
      { x = f, y = power, style = #f <= 64 and "points" or "line" } },
                         title = "Periodogram", xlabel = "f [Hz]", ylabel = "power [dB]" },
                           check_options("plot", options, figure_options)))
  end }
doc { name = "spectrum:show", module = "signals", sig = "s:show()", text = "Draws s:plot() in the terminal.",
  example = "periodogram(prbs(31)):show()",
  function(s) return s:plot():show() end }
