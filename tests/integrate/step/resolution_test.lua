-- Steps see what happens between their stages: pulses, poles, oscillations that become faster, roots.
local families = dofile "tests/families.lua"
local x, y = vars "x y"
local implicit = families.implicit
local pairs_of_methods = { "auto", "dopri5", "tsit5", "dop853", "verner76", "verner87" }

-- The largest error over methods and tolerances, in tolerances; a run that stops has said so.
local function worst(equations, start, exact, to, tolerances, methods)
  local model, most = dae(equations), 0
  for _, method in ipairs(methods or pairs_of_methods) do
    for _, rtol in ipairs(tolerances) do
      local options = { start = start, to = to, rtol = rtol, max_steps = 100000 }
      if method ~= "auto" then options.method = method end
      local sol = model:integrate(options)
      if sol.status == "finished" then
        local value = exact(to)
        most = math.max(most, math.abs(sol(x, to) - value)/(rtol*math.max(1, math.abs(value))))
      end
    end
  end
  return most
end

test("x' = -k/x^p stops at its pole, not behind it", function()
  for _, p in ipairs { 1, 2, 3 } do
    for _, size in ipairs { 1e-3, 1, 50 } do
      local pole = size^(p + 1)/(p + 1)
      for _, rtol in ipairs { 1e-3, 1e-4, 1e-5, 1e-6 } do
        local sol = dae { der(x) ~ -x^(-p) }:integrate { start = { x = size }, to = 3*pole, rtol = rtol,
          atol = 1e-3*rtol*size }
        expect(sol.status:match "^stopped"):equals "stopped"
        expect(sol.t[#sol.t]/pole):near(1, 100*rtol)
      end
    end
  end
end)

test("cos of a phase that grows exponentially", function()
  local function exact(to)                                     -- ∫ cos(w eᵗ) dt by the substitution s = eᵗ
    local sum, n, w = 0, 400000, 3
    local last = math.exp(to)
    for i = 1, n do
      local s = 1 + (last - 1)*(i - 0.5)/n
      sum = sum + math.cos(w*s)/s
    end
    return sum*(last - 1)/n
  end
  local equations = { der(x) ~ cos(3*y), der(y) ~ y }
  expect(worst(equations, { x = 0, y = 1 }, exact, 6, { 1e-3, 1e-4, 1e-5 }) < 100):is_true()
end)

test("a pulse that comes again and again", function()
  for _, width in ipairs { 0.1, 0.03 } do
    -- one bell of area w√π for every turn of y = πt, with the sine for the distance
    local function exact(to)
      local sum, n = 0, 200000
      for i = 1, n do
        sum = sum + math.exp(-(math.sin(math.pi*to*(i - 0.5)/n)/(math.pi*width))^2)
      end
      return sum*to/n
    end
    local equations = { der(x) ~ exp(-(sin(pi*t)/(pi*width))^2) }
    expect(worst(equations, { x = 0 }, exact, 7.5, { 1e-3, 1e-4, 1e-6 }) < 100):is_true()
  end
end)

test("roots of |g|: where their slope is infinite", function()
  for _, k in ipairs { 1, 1e3 } do
    local function exact() return k*4/3*0.5^1.5 end
    for _, border in ipairs { t - 1/2, y, -2*y } do
      local factor = tostring(border) == tostring(-2*y) and math.sqrt(2) or 1
      local equations = { der(x) ~ k/factor*sqrt(abs(border)), der(y) ~ -1 }
      expect(worst(equations, { x = 0, y = 0.5 }, exact, 1, { 1e-4, 1e-6, 1e-8, 1e-10 }) < 30):is_true()
      expect(worst(equations, { x = 0, y = 0.5 }, exact, 1, { 1e-4, 1e-7 }, implicit) < 30):is_true()
    end
  end
end)

test("rodas passes |g|^(1/3) = 0 inside and at the start", function()
  local function exact() return 2*3/4*0.5^(4/3) end
  local inside = { der(x) ~ abs(t - 0.5)^(1/3) }
  expect(worst(inside, { x = 0 }, exact, 1, { 1e-4, 1e-6 }, { "rodas" }) < 30):is_true()
  local start = { der(x) ~ sqrt(abs(t)) }
  expect(worst(start, { x = 0 }, function() return 2/3 end, 1, { 1e-4, 1e-6 }, { "rodas" }) < 30):is_true()
end)

-- Estimates of formulas with 5 and 7 stages are of order 5 and 7: where waves become as short as a step, they
-- were a thousandth of the error (one run of six was off, up to 720 tolerances in one step).
test("waves as short as steps: Radau with many stages sees that its polynomial does not converge", function()
  local a, b, c = vars "a b c"
  local m = dae { der(a) ~ t, der(b) ~ (a + 3)/(cos(1.9*c*b) + 2), der(c) ~ 1.8*a }
  local off, silent = 0, 0
  for k = 0, 150, 2 do
    local start = { a = 0.8 + k/1000, b = 0.2, c = 1/3 }
    local sol = m:integrate { start = start, to = 3, rtol = 1e-6, method = "radau" }
    local tight = m:integrate { start = start, to = 3, rtol = 1e-11, method = "dop853", times = sol.t }
    local worst = 0
    for _, time in ipairs(sol.t) do
      worst = math.max(worst, math.abs(sol(b, time)/tight(b, time) - 1)/1e-6)
    end
    if worst > 100 then
      off = off + 1
      if not tostring(sol):find("add up", 1, true) then silent = silent + 1 end
    end
  end
  expect(off < 3 and silent < 3):is_true()
end)

test("a step of Radau that its halves contradict by many tolerances: the run says so", function()
  local a, b, c = vars "a b c"
  local m = dae { der(a) ~ cos(-0.3*a/(cos(b) + 2)), der(b) ~ t*c - 7*b, der(c) ~ t^2 - 0.7457052122*b }
  local off = 0
  for k = 0, 40 do                                     -- cos(b) turns up to 50 times in a unit of time
    local sol = m:integrate { start = { a = -0.13 + k/1000, b = -0.97, c = -0.5 }, to = 10, rtol = 1e-6,
      method = "radau" }
    if not sol:check().good then
      off = off + 1
      expect(tostring(sol)):matches "add up"
    end
  end
  expect(off < 20):is_true()
end)
