-- What is said about methods in words, tables and pictures: report(), verify(), plot(), rk.table() and its
-- kin. Loaded when first needed; the numbers come from src/integrate.
local analysis = {}
local layout = include "layout"

local function short(number, digits)
  if number ~= number then return "–" end
  if number == math.huge then return "∞" end
  if number == -math.huge then return "-∞" end
  return (("%." .. (digits or 6) .. "g"):format(number))
end

-- ── report ─────────────────────────────────────────────────────────────────────────────────────────────────

local function kind_of(tab)
  if tab:is "explicit" then return "explicit" end
  if not tab:is "diagonally implicit" then return "fully implicit" end
  local first = tab:is "explicit first stage" and tab.stages > 1
  if tab:is "singly diagonally implicit" then return first and "ESDIRK" or "SDIRK" end
  return first and "EDIRK" or "DIRK"
end

local function properties(tab)
  local list = { kind_of(tab) }
  for _, name in ipairs { "FSAL", "stiffly accurate", "collocation", "symplectic", "symmetric",
    "algebraically stable" } do
    if tab:is(name) and not (name == "FSAL" and not tab:is "explicit") then list[#list + 1] = name end
  end
  return table.concat(list, ", ")
end

local most_missed = 9

local function order_lines(tab, lines)
  local p = tab:order()
  local holds = "order            %d: every condition of the trees with at most %d vertices holds"
  lines[#lines + 1] = holds:format(p, p)
  if p >= 9 or tab.stages > 20 then return end
  local conditions, missed, count = tab:conditions(p + 1), {}, 0
  for i = 1, #conditions do
    local c = conditions[i]
    if not c.met then
      count = count + 1
      if count <= most_missed then
        local residual = c.residual_text
        if width(residual) > 24 then residual = short(evaluate(c.residual)) end
        missed[count] = { c.tree, c.text, "residual " .. residual }
      end
    end
  end
  lines[#lines + 1] = ("missed           %d of order %d:"):format(count, p + 1)
  lines[#lines + 1] = layout(missed, nil, 17)
  if count > most_missed then lines[#lines + 1] = (" "):rep(17) .. "…" end
end

local function expected(order)
  if order < 0 then return "not applicable" end
  return order == 0 and "no convergence" or tostring(order)
end

local function dae_lines(tab, lines)
  local o = tab:dae_orders()
  local p = tab:order()
  lines[#lines + 1] = ("index 1          x %d, z %d (x′ and z at mesh points solve the equations)"):format(p,
    p)
  if o.x2 < 0 then
    lines[#lines + 1] = "index 2, 3       not applicable as they stand: the stages do not determine z; "
      .. "reduce the index"
    return
  end
  if o.z1 ~= p then lines[#lines] = lines[#lines] .. ("; z from the stages: %s"):format(expected(o.z1)) end
  lines[#lines + 1] = ("index 2          x %s, z %s"):format(expected(o.x2), expected(o.z2))
  lines[#lines + 1] = o.x3 > 0 and ("index 3          x %d, x′ %d, z %d"):format(o.x3, o.v3, o.z3)
    or "index 3          no convergence in general"
end

local function cost_line(tab)
  local s, kind = tab.stages, kind_of(tab)
  if kind == "explicit" then return ("%d evaluations per step"):format(tab:is "FSAL" and s - 1 or s) end
  if kind == "fully implicit" then
    local cost = "one system of %d·n unknowns per step: its factorisation costs %d times that of one stage"
    return cost:format(s, s^3)
  end
  local stages = kind:sub(1, 1) == "E" and s - 1 or s
  return ("%d systems of n unknowns per step, one after another"):format(stages)
    .. (kind:find "SD" and stages > 1 and ", all with one factorisation" or "")
end

local function collocation_lines(tab, lines)
  if not tab:is "collocation" or tab.stages > 20 then return end
  local values, zero = {}, 0
  for k, value in ipairs(tab:orthogonality(tab.stages)) do
    values[k] = tostring(value)
    if width(values[k]) > 20 then values[k] = short(evaluate(value)) end
    if evaluate(value) == 0 and zero == k - 1 then zero = k end
  end
  lines[#lines + 1] = "orthogonality    ∫₀¹ ∏(τ - cᵢ) τᵏ dτ = " .. table.concat(values, ", ")
    .. " for k = 0, 1, …"
  lines[#lines + 1] = ("                 zero for the first %d: order s + %d = %d"):format(zero, zero,
    tab.stages + zero)
end

function analysis.report(tab)
  local lines = { tostring(tab), "" }
  if tab.text ~= "" then lines[#lines + 1] = tab.text end
  if tab.cite ~= "" then lines[#lines + 1] = "(" .. tab.cite .. ")" end
  if #lines > 2 then lines[#lines + 1] = "" end
  lines[#lines + 1] = "kind             " .. properties(tab)
  order_lines(tab, lines)
  local s = tab:simplifying()
  lines[#lines + 1] = ("stage order      %d;  B(%d), C(%d), D(%d) hold"):format(tab:stage_order(), s.B, s.C,
    s.D)
  collocation_lines(tab, lines)
  if tab.bhat then
    lines[#lines + 1] = ("embedded         order %d, for the error estimate"):format(tab:embedded_order())
  end
  if tab.dense then lines[#lines + 1] = ("dense output     order %d"):format(tab:dense_order()) end
  lines[#lines + 1] = tostring(tab:stability())
  dae_lines(tab, lines)
  lines[#lines + 1] = "work             " .. cost_line(tab)
  return table.concat(lines, "\n")
end

-- ── verify ─────────────────────────────────────────────────────────────────────────────────────────────────

local built

-- The problems with their exact solutions, built once.
local function problems()
  if built then return built end
  local x, y, z, v, y1, y2, x1, x2, v1, v2 = vars "x y z v y1 y2 x1 x2 v1 v2"
  local exp1 = math.exp(1)
  built = {
    { name = "nonlinear", text = "x′ = x y, y′ = -ln x", model = dae { der(x) ~ x * y, der(y) ~ -log(x) },
      start = { x = 1, y = 1 }, measure = { { "x", x, math.exp(math.sin(1)) }, { "y", y, math.cos(1) } },
      expect = function(_, p) return p end },
    { name = "non-autonomous", text = "x′ = t x²", model = dae { der(x) ~ t * x^2 }, start = { x = 0.5 },
      measure = { { "x", x, 1 / 1.5 } }, expect = function(_, p) return p end },
    { name = "stiff", text = "x′ = -10⁶(x - cos t) - sin t",
      model = dae { der(x) ~ -10^6 * (x - cos(t)) - sin(t) },
      start = { x = 1 }, measure = { { "x", x, math.cos(1) } }, implicit = true,
      expect = function(tab, p)
        local st, q = tab:stability(), tab:stage_order()
        if st.real > -math.huge then return -1 end
        return math.min(p, math.abs(st.infinity - 1) < 1e-9 and q - 1 or q)
      end,
      why = [[order reduction: on stiff problems only the stage order q = %d is certain (Prothero & Robinson
        1974)]] },
    { name = "index 1", text = "x′ = -x z, 0 = z + z³ - ln x - (ln x)³",
      model = dae { der(x) ~ -x * z, 0 ~ z + z^3 - log(x) - log(x)^3 }, start = { x = exp1, z = 1 },
      measure = { { "x", x, math.exp(math.exp(-1)) }, { "z", z, math.exp(-1) } }, expect = function(_, p)
        return p
      end },
    { name = "index 2", text = "y₁′ = y₁y₂z, y₂′ = y₁²y₂² - 3y₂²z, 0 = y₁²y₂ - 1 (Jay)",
      model = dae { der(y1) ~ y1 * y2 * z, der(y2) ~ y1^2 * y2^2 - 3 * y2^2 * z, 0 ~ y1^2 * y2 - 1 },
      start = { y1 = 1, y2 = 1, z = 1 }, direct = true,
        measure = { { "y", y1, exp1, 1e-11 }, { "z", z, exp1^2, 1e-10 } },
      expect = function(tab, _, name) return tab:dae_orders()[name == "z" and "z2" or "x2"] end,
      why = [[order reduction: z follows the stage order and R(∞), y is better where D(r) helps (Hairer &
        Wanner II, §VII.4)]] },
    { name = "index 3", text = "x″ = -z x + t (cos t, sin t), 0 = x·x - 1",
      model = dae { der(x1) ~ v1, der(x2) ~ v2, der(v1) ~ -z * x1 + t * cos(t),
        der(v2) ~ -z * x2 + t * sin(t),
                    0 ~ (x1^2 + x2^2 - 1) / 2 },
      start = { x1 = 1, x2 = 0, v1 = 0, v2 = 1, z = 1 }, direct = true,
      measure = { { "x", x1, math.cos(1), 1e-11 }, { "x′", v1, -math.sin(1), 1e-10 }, { "z", z, 2, 1e-8 } },
      expect = function(tab, _, name)
        return tab:dae_orders()[({ x = "x3", ["x′"] = "v3", z = "z3" })[name]]
      end,
      why = "order reduction: each derivative of the constraint costs z one order (Jay 1993)" },
  }
  return built
end

-- Errors below this are rounding and the tolerance of Newton's method; algebraic variables of index 2 and 3
-- divide them
-- by Δt and Δt².
local function floor_of(measure) return measure[4] or 1e-13 end

-- Errors of every measured quantity for Δt = 1/2, 1/4, … until all are down to rounding; nil where no run is
-- possible.
local function errors_of(problem, tab)
  local list, failure = {}, nil
  for _ = 1, #problem.measure do list[#list + 1] = {} end
  for k = 1, 8 do
    local fine = true
    local ok, sol = pcall(problem.model.integrate, problem.model,
      { start = problem.start, to = 1, method = tab, dt = 1 / 2^k, direct = problem.direct })
    if not ok then return nil, tostring(sol) end
    if sol.status ~= "finished" then
      failure = sol.status
    else
      for i, measure in ipairs(problem.measure) do
        local e = math.abs(sol:final(measure[2]) - measure[3])
        list[i][#list[i] + 1] = e
        if e > floor_of(measure) then fine = false end
      end
      if fine then break end
    end
  end
  return list, failure
end

-- The slope of the last halvings above rounding; the best of one, two and three halvings, since an error may
-- cross zero.
local function slope_of(errors, floor)
  local n = #errors
  while n > 0 and errors[n] < floor do n = n - 1 end
  local slope
  for k = 1, math.min(3, n - 1) do
    slope = math.max(slope or -math.huge, math.log(errors[n - k] / errors[n], 2) / k)
  end
  return slope
end

-- What a slope may fall short at steps that are not small yet: 0.3, of high orders a tenth.
local function shortfall(order) return math.max(0.3, order / 10) end

local function verify_problem(problem, tab, result)
  local p, reduced = tab:order(), false
  if problem.implicit and tab:is "explicit" then
    result.rows[#result.rows + 1] = { problem = problem.name, quantity = "–",
      verdict = "for implicit methods only", ok = true }
    return
  end
  local first = problem.expect(tab, p, problem.measure[1][1])
  if first < 0 then
    result.rows[#result.rows + 1] = { problem = problem.name, quantity = "–", ok = true,
      verdict = problem.implicit and "not stable on stiff problems" or "not applicable as it stands" }
    return
  end
  local lists, failure = errors_of(problem, tab)
  for i, measure in ipairs(problem.measure) do
    local row = { problem = problem.name, quantity = measure[1],
      expected = problem.expect(tab, p, measure[1]) }
    row.measured = lists and slope_of(lists[i], floor_of(measure))
    row.errors = lists and lists[i]
    if row.expected <= 0 then
      row.ok, row.verdict = true, "convergence is not guaranteed"
    elseif not lists then
      row.ok, row.verdict = false, "failed: " .. failure
    elseif not row.measured then
      row.ok = #lists[i] > 0
      row.verdict = row.ok and "errors at the level of rounding" or "failed: " .. tostring(failure)
    else
      row.ok = row.measured >= row.expected - shortfall(row.expected)
      local seen = 0
      for _, e in ipairs(row.errors) do seen = seen + (e > 10 * floor_of(measure) and 1 or 0) end
      if not row.ok and seen < 4 then
        row.ok, row.verdict = true, "errors at the level of rounding"
      else
        row.verdict = row.ok and "✓" or "✗ below the expected order"
      end
      reduced = reduced or row.expected < p
    end
    result.rows[#result.rows + 1] = row
    result.ok = result.ok and row.ok
  end
  if reduced and problem.why then
    result.notes[#result.notes + 1] = problem.name .. ": "
      .. problem.why:format(object_type(tab) == "tableau" and tab:stage_order() or 0)
  end
end

local verification = {
  __name = "verification",
  __index = { latex = report_latex },
  __tostring = function(self)
    local rows = { { "problem", "quantity", "expected", "measured", "" } }
    for _, row in ipairs(self.rows) do
      rows[#rows + 1] = { row.problem, row.quantity, row.expected and expected(row.expected) or "",
        row.measured and ("%.2f"):format(row.measured) or "", row.verdict }
    end
    local text = ("%s: order %d, measured at t = 1 with Δt = 1/2, 1/4, … (one-sided: more than expected is "
      .. "no fault)\n%s"):format(
      self.method, self.order, layout(rows, { false, false, true, true }, 2))
    for _, note in ipairs(self.notes) do text = text .. "\n" .. note end
    return text .. "\n" .. (self.ok and "verified" or "NOT verified: see ✗")
  end,
}

-- Multistep methods have no stages: their order holds for stiff components and for index 1, 2 and 3 alike.
-- For index 3 as it stands the Runge–Kutta steps that start them leave order 4. Rounding adds up over many
-- steps.
function analysis.verify_multistep(method)
  local result = setmetatable({ method = method.name, order = method:order(), rows = {}, notes = {},
    ok = true }, verification)
  for _, problem in ipairs(problems()) do
    local measures = {}
    for i, measure in ipairs(problem.measure) do
      measures[i] = { measure[1], measure[2], measure[3], 100 * floor_of(measure) }
    end
    local promised = problem.name == "index 3" and math.min(4, method:order()) or method:order()
    verify_problem(setmetatable({ expect = function() return promised end, measure = measures,
      why = "the start by Radau steps limits it; constant steps after it have the order of the formula" },
        { __index = problem }), method, result)
  end
  return result
end

function analysis.verify(tab)
  local result = setmetatable({ method = tab.name, order = tab:order(), rows = {}, notes = {}, ok = true },
    verification)
  for _, problem in ipairs(problems()) do verify_problem(problem, tab, result) end
  return result
end

-- ── comparisons ────────────────────────────────────────────────────────────────────────────────────────────

local comparison = { __name = "comparison", __index = { latex = report_latex },
  __tostring = function(self) return self.text end }

function analysis.compare(list)
  local rows = { { "method", "s", "p", "p̂", "q", "kind", "real", "imaginary", "stability", "properties" } }
  for _, tab in ipairs(list) do
    local st = tab:stability()
    local more = {}
    for _, name in ipairs { "FSAL", "stiffly accurate", "symplectic", "symmetric" } do
      if tab:is(name) and not (name == "FSAL" and not tab:is "explicit") then more[#more + 1] = name end
    end
    rows[#rows + 1] = { tab.name, tostring(tab.stages), tostring(tab:order()),
      tab.bhat and tostring(tab:embedded_order()) or "",
      tostring(tab:stage_order()), kind_of(tab), short(st.real), short(st.imaginary),
      st.L_stable and "L" or st.A_stable and "A" or st.alpha > 0 and ("A(%.4g°)"):format(st.alpha) or "",
        table.concat(more, ", ") }
  end
  return setmetatable({ rows = rows, text = layout(rows, { false, true, true, true, true, false, true, true },
    0)
    .. "\ns stages, p order, p̂ embedded order, q stage order; |R| ≤ 1 on [real, 0] and for |Im z| ≤ "
      .. "imaginary" }, comparison)
end

-- The least number of stages of an explicit method of each order (Butcher), and the methods that attain it.
function analysis.stages_for_order(list)
  local least = { 1, 2, 3, 4, 6, 7, 9, 11 }
  local rows = { { "order", "stages at least", "attained by" } }
  for p, s in ipairs(least) do
    local names = {}
    for _, tab in ipairs(list) do
      if tab:is "explicit" and tab:order() == p and tab.stages - (tab:is "FSAL" and tab.stages > 1 and 1
        or 0) == s then
        names[#names + 1] = tab.name
      end
    end
    rows[#rows + 1] = { tostring(p), tostring(s), #names > 0 and table.concat(names, ", ") or "–" }
  end
  return setmetatable({ rows = rows, text = "explicit Runge-Kutta methods\n" .. layout(rows, { true, true },
    2)
    .. "\n  (order 9: 12 to 17 stages, not known exactly; FSAL methods count one stage less. Butcher, "
      .. "Numerical Methods for "
    .. "ODEs, 2nd ed., §32)" }, comparison)
end

-- What a given accuracy costs with more and more stages, measured. Work: 2/3 (s n)³ per factorisation.
function analysis.cost(methods, targets)
  local problem = problems()[1]
  local n = #problem.measure
  local head = { "error ≤" }
  for _, tab in ipairs(methods) do head[#head + 1] = tab.name end
  local rows, best_rows = { head }, {}
  for _, target in ipairs(targets) do
    local row, best, best_at = { short(target, 1) }, math.huge, nil
    for i, tab in ipairs(methods) do
      local cell = "–"
      for k = 0, 14 do
        local sol = problem.model:integrate { start = problem.start, to = 1, method = tab, dt = 1 / 2^k }
        local e = sol.status == "finished"
          and math.abs(sol:final(problem.measure[1][2]) - problem.measure[1][3]) or math.huge
        if e <= target then
          local stats = sol:stats()
          local work = stats.factorisations * 2 / 3 * (tab.stages * n)^3
          cell = ("%d × %d: %.3g"):format(stats.steps, stats.factorisations // stats.steps, work)
          if work < best then best, best_at = work, i end
          break
        end
      end
      row[i + 1] = cell
    end
    rows[#rows + 1] = row
    best_rows[#best_rows + 1] = best_at and ("%s: %s"):format(short(target, 1), methods[best_at].name)
  end
  return setmetatable({ rows = rows, text =
    "steps × factorisations per step: operations, 2/3 (s n)³ per factorisation; " .. problem.text
      .. " to t = 1\n"
    .. layout(rows, nil, 2) .. "\ncheapest  " .. table.concat(best_rows, ";  ")
    .. "\nOne step costs s³ times the factorisation of one stage and gains the factor Δt² per stage: more "
      .. "stages pay only "
    .. "for small errors." }, comparison)
end

return analysis
