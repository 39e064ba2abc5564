-- The reference problems: one file each in a folder by subject, listed here in the order of help() and
-- problems.list().
--
-- A file returns what is known about the problem, from the literature or by hand, and how it is built:
--
--   return {
--     title = "…", source = "…",       -- what it is, where it is from
--     statement = "…",                 -- what makes it worth having
--     tags = "mechanics nonlinear",
--     index = 3, dof = 2,              -- differentiation index, free initial values; no index: `why`
--     structural_index = 3, structural_dof = 2, verdict = "valid",       -- what the Σ-method says about it
--     remark = "…",                    -- why the two differ, where they do
--     to = 10, dt = 0.01,              -- an interval worth integrating, and a step for gauss(3)
--     digits = 6,                      -- how many digits a short reference has
--     forms = { "acc" },               -- the forms that the tests integrate; all of them by default
--     build = function()
--       return {
--         model = dae { … },
--         constraints = { … },         -- conditions on the start, explicit and hidden: each expression is 0
--         fix = { … }, guess = { … },  -- a start: as many values as are free
--         inputs = { [u] = sin(t) },
--         exact = { [x] = cos(t) },    -- the solution as expressions in t,
--         reference = { [x] = 0.275 }, -- or its values at `to`
--       }
--     end,
--   }
--
-- Nothing of it is loaded before it is asked for. How the figures were found: docs/derivations.md#problems.
local subjects = {
  { folder = "lecture",
    "exam_3d", "sphere_chain", "nilpotent", "cstr", "spherical_pendulum", "cart_pendulum", "delta_robot" },
  { folder = "linear",         -- constant coefficients; then coefficients that vary
    "reissig", "hidden_sum", "mattsson_linear", "scholz_steinbrecher", "tracking_chain", "spring_servo",
    "gear_shafts", "singular_arc", "opamp_integrator", "opamp_differentiator", "capacitor_loop",
    "inductor_cutset", "two_tanks", "coupled_outputs", "differentiator_cascade", "inverse_heat",
    "nonminimum_phase",
    "gear_petzold", "kunkel_mehrmann", "kunkel_mehrmann_open", "parameter_index", "singular_time",
    "rotating_nilpotent" },
  { folder = "nonlinear",
    "cube_root", "van_der_pol_limit", "two_branches", "implicit_circle", "jay_index2", "jay_index3",
    "pantelides_reactor", "substitution", "linear_combination", "robot_arm", "catalyst_mixing",
    "hessenberg4" },
  { folder = "mechanics",
    "pendulum", "pendulum_velocity", "pendulum_acceleration", "two_pendula", "rotating_rod", "skate",
    "slider_crank", "double_pendulum", "car_axis", "squeezer", "chain", "redundant_bar" },
  { folder = "benchmarks",     -- chemistry and circuits of the test sets
    "robertson", "akzo", "hires", "transistor_amplifier", "diode_ladder", "ring_modulator" },
}

local names, folder_of = {}, {}
for _, subject in ipairs(subjects) do
  for _, name in ipairs(subject) do
    names[#names + 1] = name
    folder_of[name] = subject.folder
  end
end

-- What is computed from the file when it is read: the file itself, once, and what its build() returns, once.
local of_build = {
  model = true, constraints = true, fix = true, guess = true, inputs = true, params = true, from = true,
  exact = true, reference = true, references = true,
}
-- Fields that some problems do without.
local optional = {
  index = true, dof = true, structural_index = true, structural_dof = true, remark = true, why = true,
  dt = true, digits = true, forms = true, variants = true, singular = true,
}

local problem = { __name = "problem", __metatable = "problem" }
local methods = {}

local function file_of(name)
  local file = include("problems/" .. folder_of[name] .. "/" .. name)
  for _, key in ipairs { "title", "source", "statement", "remark", "why" } do
    if file[key] then file[key] = prose(file[key]) end
  end
  return file
end

local function loaded(self)
  local file = rawget(self, "file")
  if not file then
    file = file_of(self.name)
    rawset(self, "file", file)
  end
  return file
end

local function built(self)
  local result = rawget(self, "built")
  if not result then
    result = loaded(self).build()
    rawset(self, "built", result)
  end
  return result
end

function problem:__index(key)
  if methods[key] then return methods[key] end
  if of_build[key] then
    local value = built(self)[key]
    if value == nil and (key == "from") then return 0 end
    return value
  end
  local value = loaded(self)[key]
  if value == nil and not optional[key] then
    local keys = { "name", "start", "solution", "error" }
    for _, set in ipairs { of_build, optional, loaded(self) } do
      for word in pairs(set) do keys[#keys + 1] = word end
    end
    table.sort(keys)
    fail(("problems.%s has no field '%s'."):format(self.name, tostring(key))
      .. did_you_mean(tostring(key), keys))
  end
  return value
end

-- problems.pendulum() is the model; problems.pendulum{ g = 1 } the model with other parameters.
function problem:__call(params)
  local model = self.model
  return params == nil and model or model:with(params)
end

-- ── values that are known ──────────────────────────────────────────────────────────────────────────────────

-- A start made with the values of the file: sys:init{ … } of the problem's model, or of another form of it.
function methods:start(form)
  return (form or self.model):init { fix = self.fix, guess = self.guess, inputs = self.inputs,
    from = self.from }
end

-- The known solution at time `at` (by default at the end): a list of { symbol, value } in a fixed order.
local function known(self, at)
  at = at or self.to
  local source, list = self.exact, {}
  if not source then
    local times = { self.reference and self.to }
    for time in pairs(self.references or {}) do times[#times + 1] = time end
    if #times == 0 then fail("problems." .. self.name .. ": no solution is known") end
    source = at == self.to and self.reference or (self.references or {})[at]
    table.sort(times)
    for i, time in ipairs(times) do times[i] = ("%g"):format(time) end
    if not source then
      fail(("problems.%s: the solution is known at t = %s only"):format(self.name, table.concat(times, ", ")))
    end
  end
  for symbol, value in pairs(source) do
    list[#list + 1] = { symbol, self.exact and evaluate(value, { t = at }) or value }
  end
  table.sort(list, function(a, b) return tostring(a[1]) < tostring(b[1]) end)
  return list
end

function methods:solution(at)
  local values = {}
  for _, pair in ipairs(known(self, at)) do values[pair[1]] = pair[2] end
  return values
end

-- Largest error of a solution at its end; relative where the known value is not 0. Second: of which variable.
function methods:error(sol)
  local times = sol.t
  local last = times[#times]
  local worst, where = 0, nil
  for _, pair in ipairs(known(self, last)) do
    local wanted = pair[2]
    local size = math.abs(wanted) > 1e-14 and math.abs(wanted) or 1
    local e = math.abs(sol(pair[1], last) - wanted) / size
    if not (e <= worst) then worst, where = e, pair[1] end
  end
  return worst, where
end

-- ── how they print ─────────────────────────────────────────────────────────────────────────────────────────

local page_width = 96

local function wrapped(label, text)
  local lines, line = {}, (label .. (" "):rep(13)):sub(1, 13)
  local empty = true
  for word in text:gmatch "%S+" do
    if not empty and width(line) + 1 + width(word) > page_width then
      lines[#lines + 1] = line
      line, empty = (" "):rep(13), true
    end
    line = line .. (empty and "" or " ") .. word
    empty = false
  end
  lines[#lines + 1] = line
  return table.concat(lines, "\n")
end

local function count(n, what) return n .. " " .. what .. (n == 1 and "" or "s") end

function problem:__tostring()
  local lines = { self.title }
  local function row(label, text) lines[#lines + 1] = wrapped(label, text) end
  row("source", self.source)
  row("", self.statement)
  if self.index then
    row("index", ("%d; %s, %s"):format(self.index, count(self.dof, "free initial value"),
      count(#self.constraints, "constraint")))
  else
    row("index", "none: " .. self.why)
  end
  if self.structural_index then
    row("structure", ("index %d, %s; system Jacobian %s"):format(self.structural_index,
      count(self.structural_dof, "degree") .. " of freedom", self.verdict))
  else
    row("structure", self.verdict)
  end
  if self.remark then row("", self.remark) end
  for i, c in ipairs(self.constraints) do
    lines[#lines + 1] = (i == 1 and "constraints  0 = " or "             0 = ") .. tostring(c)
  end
  if self.exact then
    local list = {}
    for symbol, value in pairs(self.exact) do
      list[#list + 1] = tostring(symbol) .. " = " .. tostring(value)
    end
    table.sort(list)
    for i, text in ipairs(list) do
      lines[#lines + 1] = (i == 1 and "solution     " or "             ") .. text
    end
  elseif self.reference then
    local list = {}
    for _, pair in ipairs(known(self)) do
      list[#list + 1] = ("%s = %.10g"):format(tostring(pair[1]), pair[2])
    end
    for i, text in ipairs(list) do
      lines[#lines + 1] = (i == 1 and ("at t = %-6g"):format(self.to) or (" "):rep(13)) .. text
    end
  end
  lines[#lines + 1] = tostring(self.model)
  return table.concat(lines, "\n")
end

local function described(name)
  return function(entry)
    local file = file_of(name)
    entry.text = file.title .. ". " .. file.statement .. " (" .. file.source .. ")"
    entry.example = file.index and "problems." .. name .. "():index()" or "problems." .. name .. ".why"
    entry.gives = file.index and tostring(file.index) or file.why
  end
end

-- ── the list ───────────────────────────────────────────────────────────────────────────────────────────────

local layout = include "layout"
local list_type = { __name = "problems", __metatable = "problems" }

function list_type:__tostring()
  local rows = { { "name", "index", "dof", "structural", "title" } }
  for _, p in ipairs(self) do
    rows[#rows + 1] = { p.name, tostring(p.index or "–"), tostring(p.dof or "–"),
      p.structural_index and ("%d, %d"):format(p.structural_index, p.structural_dof) or "–", p.title }
  end
  return layout(rows)
end

doc { name = "problems.list", sig = "problems.list([tag]) -> list of problems", module = "problems",
  title = "Reference problems",
  text = [[The reference problems, all of them or those with a tag (exam, lecture, linear, nonlinear,
    mechanics, circuit, chemistry, control, benchmark, failure: where structure alone misleads; singular).
    Each p has p.name, p.title, p.source, p.statement, p.index, p.dof, p.structural_index, p.structural_dof,
    p.verdict, p.remark, p.constraints, p.fix, p.guess, p.inputs, p.from, p.to, p.dt, p.exact or p.reference;
    p() is the model, p:start() a consistent start, p:solution(t) the known values, p:error(sol) the error of
    a solution at its end. print(p) shows everything.]],
  example = 'problems.list "exam"', gives = [[
name          index  dof  structural  title
exam_3d       2      1    0, 3        Exam problem 3(d): E x′ = x with a singular E
sphere_chain  3      8    3, 8        Exam problem 1: a mass on a sphere and a second one on a link]],
  function(tag)
    local list = {}
    for _, name in ipairs(names) do
      local p = named("problems." .. name)
      if tag == nil or (" " .. p.tags .. " "):find(" " .. tostring(tag) .. " ", 1, true) then
        list[#list + 1] = p
      end
    end
    if #list == 0 then
      local tags, seen = {}, {}
      for _, name in ipairs(names) do
        for word in named("problems." .. name).tags:gmatch "%S+" do
          if not seen[word] then seen[word] = true tags[#tags + 1] = word end
        end
      end
      table.sort(tags)
      fail("problems.list: no problem has the tag '" .. tostring(tag) .. "'."
        .. did_you_mean(tostring(tag), tags)
           .. " Tags: " .. table.concat(tags, ", "))
    end
    return setmetatable(list, list_type)
  end }

for _, name in ipairs(names) do
  doc { name = "problems." .. name, sig = "problems." .. name .. "([params]) -> model", module = "problems",
    title = "Reference problems", text = "", describe = described(name),
      setmetatable({ name = name }, problem) }
end

return names
