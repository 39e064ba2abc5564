-- explain: where a result came from: the derivation, the definition used, the source.

local function columns()
  local screen = screen_width()
  return screen == 0 and 96 or math.min(screen, 96)
end

local function say(line)
  if screen_width() == 0 then print(line) else page(line .. "\n") end
end

local function wrapped(text, margin)
  local line = margin
  for word in text:gmatch "%S+" do
    if width(line) + 1 + width(word) > columns() and line ~= margin then
      say(line)
      line = margin
    end
    line = line .. (line == margin and "" or " ") .. word
  end
  say(line)
end

local function section(title, text)
  say(title)
  for paragraph in (tostring(text) .. "\n"):gmatch "(.-)\n" do
    if width(paragraph) > columns() and paragraph:find "^%S" then
      wrapped(paragraph, "  ")
    else
      say("  " .. paragraph)
    end
  end
end

-- What is laid out already: tables, sentences of a given width.
local function laid_out(title, text)
  say(title)
  for line in (tostring(text) .. "\n"):gmatch "(.-)\n" do say(line == "" and "" or "  " .. line) end
end

-- ── models ─────────────────────────────────────────────────────────────────────────────────────────────────

local forms = {
  [""] = { "the model as it was written, or converted without reducing its index" },
  acc = { [[every constraint is replaced by its last derivative that is needed for index 1; the conditions
    left behind hold if the start satisfies them, and drift numerically]],
    "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1, §VII.2" },
  ggl = { [[constraints and their derivatives stay equations; q′ = v - (∂C/∂q)ᵀ μ with multipliers μ that
    vanish on the exact solution; index 2]],
    "Gear, Leimkuhler & Gupta, J. Comput. Appl. Math. 12-13, 1985" },
  baumgarte = { [[0 = C″ + 2α C′ + β² C in place of 0 = C″: a violation of the constraint decays; α and β are
    no part of the physics]],
    "Baumgarte, Comput. Methods Appl. Mech. Eng. 1, 1972" },
  project = { [[the explicit (or index-1) form, and after every step the smallest change of the states that
    satisfies all constraints, for mechanisms in the norm of the mass matrix]],
    "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.2" },
  dummy = { [[all equations and all their derivatives; as many derivatives as there are surplus equations
    become algebraic variables, chosen by pivoting and again during the run]],
    "Mattsson & Söderlind, SIAM J. Sci. Comput. 14(3), 1993" },
  minimal = { [[constraints that are linear in a coordinate, or quadratic once a start names the root, are
    solved for it and the coordinate is substituted: independent coordinates only]] },
  ode = { "derivatives and algebraic variables are solved for by linear solves: x′ = f(t, x)",
    "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1" },
}

local function explain_model(sys)
  section("what it is", tostring(sys):match "^[^\n]*")
  local form = forms[sys.form] or { "form " .. sys.form }
  section(sys.form == "" and "form" or 'form "' .. sys.form .. '"', prose(form[1]))
  section("derivation", tostring(sys:trace()))
  section("index", prose [[The differentiation index is the least number of differentiations after which the
    equations determine x′ as a function of (t, x). structure() finds it from the offsets of the Σ-method and
    says whether the system Jacobian proves it.]])
  local good, structure = pcall(function() return sys:structure() end)
  if good then
    local verdict = {}
    for line in tostring(structure):gmatch "[^\n]+" do
      if line:find "^verdict" or line:find "^true index" then verdict[#verdict + 1] = line end
    end
    if #verdict > 0 then section("proof", table.concat(verdict, "\n")) end
  end
  local sources = { "Pryce, BIT 41(2), 2001 (Σ-method)", "Pantelides, SIAM J. Sci. Stat. Comput. 9(2), 1988" }
  if form[2] then table.insert(sources, 1, form[2]) end
  section("source", table.concat(sources, "\n"))
end

local function explain_start(at)
  section("what it is", tostring(at):match "^[^\n]*")
  section("definition", prose [[A start is consistent if it satisfies the equations, every hidden constraint
    (sys:constraints()) and every fixed value. A fixed value is a condition; a guess is only where Newton's
    method begins; nothing else becomes an equation. Free values stay as near to their guess as the equations
    allow, in units that are estimated from the terms of the equations.]])
  section("ledger", at:ledger())
  section("source", prose [[Pantelides, SIAM J. Sci. Stat. Comput. 9(2), 1988; Brown, Hindmarsh & Petzold,
    SIAM J. Sci. Comput. 19(5), 1998]])
end

local function explain_solution(sol)
  section("what it is", tostring(sol):match "^[^\n]*")
  section("cost", tostring(sol:stats()))
  local good, drift = pcall(function() return sol:drift() end)
  if good then section("constraints", tostring(drift)) end
end

-- ── errors ─────────────────────────────────────────────────────────────────────────────────────────────────

-- What an error text means: a part of it, the explanation, what to do, a source.
local errors = {
  { "contradict each other",
    [[The fixed values and the equations (with all hidden constraints) have no common solution. The smallest
      set of fixes that is contradictory alone is named, and the equation it violates, with the other unknowns
      eliminated where that is possible.]],
    [[Leave one of them out of fix, give it as guess, or let nearest = true move all of them as little as
      possible.]],
    "help \"init\"" },
  { "that there is none is not proved",
    [[Newton's method found no values that satisfy the equations together with all fixed values, from the
      guess, from mirrored and spread points, and with guesses for the other unknowns one by one. Neither
      interval arithmetic nor elimination proves that there are none.]],
    [[Give guesses near the solution, leave one of the fixes out, or let nearest = true move all of them as
      little as possible.]],
    "help \"init\"" },
  { "neither fixed nor determined",
    [[The equations leave initial values open, and there are fewer independent fixes than free values. The
      candidates are the unknowns that can still move; the recommended ones are chosen by pivoting, so that
      they determine the rest well.]],
    "Fix them, as in the call that is printed, or give a guess: then the values nearest to it are chosen.",
    "help \"init\"" },
  { "the model has index",
    [[The index is the number of differentiations that turn the equations into an ODE. From index 2 on, hidden
      constraints exist that a method must respect; methods for index 0 and 1 lose order or diverge.]],
    "Reduce the model: sys:reduce():integrate{ … }; or study the model as it stands: direct = true.",
    "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1" },
  { "system Jacobian",
    [[The structural analysis counts how often variables and equations must be differentiated. It is right
      where the system Jacobian J_ij = ∂F_i/∂x_j^(d_j - c_i) is regular. Where J is singular its answer may be
      wrong, and is not given as the true one.]],
    [[sys:structure() says where J is singular and which methods were tried instead; for linear models
      sys:pencil() is exact.]],
    "Pryce, BIT 41(2), 2001; Reißig, Martinson & Barton, SIAM J. Sci. Comput. 21(6), 2000" },
  { "structurally singular",
    [[No assignment gives every equation an unknown of its own: one part of the model has too many equations,
    another too few.]],
    "sys:structure() names the over- and the under-determined part (Dulmage–Mendelsohn).",
    "Dulmage & Mendelsohn, Canad. J. Math. 10, 1958" },
  { "no consistent start was found",
    [[Newton's method found no point that satisfies the equations, from the guess and from three spread
      points. The equation named is the one with the largest residual left.]],
    "Give a guess near the solution: guess = { … }.", "help \"init\"" },
  { "is undefined",
    [[An equation has no real value where Newton's method begins: a root or logarithm of a negative number, a
      division by zero.]],
    "Give a guess where it has one; a fixed value must be in the domain of the equation.", "help \"init\"" },
  { "Newton did not converge",
    [[The nonlinear equations of a step were not solved: the step is too long, the Jacobian is singular, or
      the solution ends there.]],
    [[Take a smaller dt or adaptive steps; look at the last point: a singularity of the model shows as a
      Jacobian that loses rank.]],
    "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.8" },
  { "has no value", "The equations contain a parameter or an input that has no value.",
    "Parameters: sys:with{ m = 1 } or params = { … }; inputs: inputs = { [u] = function(t) … end }.",
    "help \"init\"" },
  { "is linear or quadratic in none of",
    [[Form "minimal" writes dependent coordinates explicitly. That needs a constraint that is linear or
      quadratic in one of them.]],
    "Other coordinates (an angle instead of x and y), or reduce \"dummy\", which needs no solved form.",
    "help \"reduce\"" },
  { "which root holds depends on where the solution is",
    [[A quadratic constraint such as x² + y² = L² has two roots; a form in minimal coordinates belongs to one
      of them.]],
    [[Name a start: reduce("minimal", { at = sys:init{ fix = … } }); the run stops where the two roots
      meet.]],
    "help \"reduce\"" },
  { "free initial values, but",
    "A form must have as many free initial values as the model it was made of; any other is refused.",
    "Use reduce \"acc\" or \"project\".", "help \"reduce\"" },
}

local function explain_text(text)
  for _, e in ipairs(errors) do
    if text:find(e[1], 1, true) then
      section("error", (text:gsub("^[^\n]-:%d+: ", "")))
      section("what it means", prose(e[2]))
      section("what to do", prose(e[3]))
      section("source", e[4])
      return true
    end
  end
  return false
end

-- Some values have no member of that name and say so as an error.
local function member_of(value, name)
  local good, member = pcall(function() return value[name] end)
  return good and type(member) == "function"
end

local by_type = { model = explain_model, start = explain_start, solution = explain_solution }

return function(...)
  if select("#", ...) == 0 then
    fail 'explain: expected a value or an error text, as in explain(sys:reduce())'
  end
  local value = ...
  local kind = object_type(value)
  if by_type[kind] then return by_type[kind](value) end
  if type(value) == "string" then
    if explain_text(value) then return end
    local known = named(value)
    if known ~= nil then return help(value) end
    fail("explain: this text is not an error message about models; help \"word\" explains a word, apropos "
      .. "\"word\" searches")
  end
  if not kind then return help(value) end
  if member_of(value, "explain") then return value:explain() end
  section("what it is", kind)
  laid_out("result", member_of(value, "report") and tostring(value:report()) or tostring(value))
  say('help "' .. kind .. '" lists what it answers')
end
