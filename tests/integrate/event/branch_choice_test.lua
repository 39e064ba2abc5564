-- Where branches of solutions meet, `branch =` says which one a run follows. Solutions in closed form.
local families = dofile "tests/families.lua"
local x, z, v = vars "x z v"
local part_of = dofile "tests/part_of.lua"
local methods = families.with("auto", "dopri5", "tsit5", "verner76")

-- Exact before, at and behind the points where branches meet, for every method.
local followed = part_of(3)
local function follows(sys, start, to, branch, exact, unit)
  for _, method in ipairs(methods) do
    for _, rtol in ipairs { 1e-4, 1e-8 } do
      if followed() then
        local sol = sys:integrate { start = start, to = to, rtol = rtol, method = method, branch = branch }
        expect(method .. " " .. sol.status):equals(method .. " finished")
        for k = 1, 20 do expect(sol(z, k*to/20) / unit):near(exact(k*to/20), 30*rtol) end
      end
    end
  end
end

test("crossing branches, in three units", function()
  for _, u in ipairs { 1e-6, 1, 1e6 } do
    local sys = dae { der(x) ~ u, 0 ~ z^2 - x^2 }
    local start = { x = -u, z = -u }
    follows(sys, start, 2, "smooth", function(t) return t - 1 end, u)
    follows(sys, start, 2, { [z.dot] = u }, function(t) return t - 1 end, u)
    follows(sys, start, 2, { [z.dot] = -u }, function(t) return t < 1 and t - 1 or 1 - t end, u)
    expect(sys:integrate { start = start, to = 2 }.status):matches(
      "z = 0 there, and %(2%) no longer determines z.*solutions go on there with z′ = %-[^ ]+ or z′ = [^ ]+ %(branch = ")
  end
end)

test("branches that cross again and again; times that are asked for lie on them, too", function()
  local sys = dae { der(x) ~ 1, 0 ~ z^2 - sin(x)^2 }
  local start, times = { x = -1, z = -math.sin(1) }, { 0.5, 1, 1.0001, 4, 11 }
  local smooth = sys:integrate { start = start, times = times, rtol = 1e-6, branch = "smooth" }
  local above = sys:integrate { start = start, times = times, rtol = 1e-6, branch = { [z.dot] = 1 } }
  expect(smooth.status .. ", " .. above.status):equals "finished, finished"
  for k, time in ipairs(times) do
    expect(smooth(z)[k]):near(math.sin(time - 1), 1e-4)
    -- z′ = cos at the zero is +1 or -1; +1 is the branch that rises
    expect(above(z)[k]):near(time < 1 and math.sin(time - 1) or math.abs(math.sin(time - 1)), 1e-4)
  end
end)

test("only solutions are named as ways on, multiple roots or not", function()
  local cube = dae { der(x) ~ 1, 0 ~ z^3 - x^3 }                  -- one real branch: z = x
  local run = { start = { x = -1, z = -1 }, to = 2 }
  expect(cube:integrate(run).status):matches "a solution goes on there with z′ = 1 %(branch = \"smooth\""
  for _, branch in ipairs { "smooth", { [z.dot] = 1.05 } } do
    run.branch = branch
    expect(cube:integrate(run)(z, 2)):near(1, 1e-6)
  end
  run.branch = { [z.dot] = 1.6 }
  expect(cube:integrate(run).status):matches "is not the one that was asked for; write branch = { %[z%.dot%] = 1 }"
  local sheets = dae { der(x) ~ -z, 0 ~ (z - 1)*(z + x) }         -- from z = 1 into z = -x, of slope z = 1
  local at = sheets:init { fix = { x = 2 }, guess = { z = 0.9 } }
  expect(sheets:integrate{ start = at, to = 5 }.status):matches "with z′ = 0 or z′ = 1 "
  local cusp = dae { der(x) ~ 1, 0 ~ z^2 - x^3 }                  -- z = ± x^(3/2): both with z′ = 0
  local status = cusp:integrate{ start = { x = 0, z = 0 }, to = 2 }.status
  expect(status):matches "z = 0 there, and %(2%) no longer determines z"
  expect(status:find "z′ = 0%.0"):is_nil()
end)

-- A pitchfork: z = 0 goes on, z = ±√x leaves with an infinite slope, which no list of derivatives shows.
test("a solution that goes on where others leave with infinite slope, in units of x and t", function()
  local taken = part_of(5)
  for _, unit in ipairs { { 1e-9, 1e-6 }, { 1, 1 }, { 1e6, 1 } } do
    local u, T = unit[1], unit[2]
    local fork = dae { der(x) ~ u/T, 0 ~ z*(x - u*z^2) }
    local run = { start = { x = -u, z = 0 }, to = 2*T }
    for _, method in ipairs(methods) do
      if taken() then
        run.method, run.branch = method, nil
        local label = ("%s u = %g T = %g: "):format(method, u, T)
        expect(label .. fork:integrate(run).status):matches "a solution goes on there with z′ = 0 %(branch = "
        run.branch = "smooth"
        local sol = fork:integrate(run)
        expect(label .. sol.status):equals(label .. "finished")
        expect(sol(z, 2*T)):near(0, 1e-9)
      end
    end
  end
  -- slowly through one that moves, z = sin y: the value of a run of z = sin y alone
  local y = var "y"
  local moving = dae { der(x) ~ 1 + 0.1*y, der(y) ~ z - y, 0 ~ (z - sin(y))*(x - (z - sin(y))^2) }
  local alone = dae { der(x) ~ 1 + 0.1*y, der(y) ~ sin(y) - y }
  local start = moving:init { fix = { x = -1, y = 0.5 }, guess = { z = 0.5 } }
  local at = moving:integrate{ start = start, to = 3 }.status
  expect(at):matches "a solution goes on there with z′ = %-0.0163 "
  local sol = moving:integrate { start = start, to = 3, rtol = 1e-8, branch = "smooth" }
  expect(sol(y, 3)):near(alone:integrate{ start = { x = -1, y = 0.5 }, to = 3, rtol = 1e-10 }(y, 3), 1e-7)
end)

test("a way that ends where it begins is not named", function()
  local cusp = dae { der(x) ~ -1, 0 ~ z^2 - x^3 }                 -- no real z where x < 0
  local status = cusp:integrate{ start = { x = 1, z = 1 }, to = 2 }.status
  expect(status):matches "^stopped at t = 1"
  expect(status:find "goes? on"):is_nil()
  expect(cusp:integrate{ start = { x = 1, z = 1 }, to = 2, branch = "smooth" }.status):matches "; branch: "
end)

test("branches that touch differ in the second derivative", function()
  local sys = dae { der(x) ~ 1, 0 ~ z*(z - x^2) }
  local start = { x = -1, z = 1 }
  expect(sys:integrate { start = start, to = 2 }.status):matches "go on there with z″ = 0 or z″ = 2 "
  expect(sys:integrate { start = start, to = 2, branch = "smooth" }(z, 1.7)):near(0.49, 1e-5)
  expect(sys:integrate { start = start, to = 2, branch = { [der(z, 2)] = 0 } }(z, 1.7)):near(0, 1e-5)
end)

test("a fold that the solution touches: from z = -√x to z = √x, or to rest", function()
  local sys = dae { der(x) ~ z, 0 ~ z^2 - x }
  for _, method in ipairs { "auto", "dopri5", "radau" } do
    for _, branch in ipairs { "smooth", { [z.dot] = 0.5 } } do
      local sol = sys:integrate { start = { x = 1, z = -1 }, to = 5, method = method, branch = branch }
      expect(sol.status):equals "finished"
      expect(sol(x, 5)):near(2.25, 1e-4)
    end
  end
  expect(sys:integrate { start = { x = 1, z = -1 }, to = 5, branch = { [z.dot] = 0 } }(x, 5)):near(0, 1e-5)
  local circle = dae { der(x) ~ z, 0 ~ z^2 + x^2 - 1 }      -- x = sin t, at rest at x = 1, or back
  local swing = circle:integrate { start = { x = 0, z = 1 }, to = 5, branch = "smooth" }
  expect(swing(x, 5)):near(math.sin(5), 1e-4)
end)

test("what cannot be followed is said", function()
  local sys = dae { der(x) ~ 1, 0 ~ z^2 - x^2 }
  local function run(options)
    options.start, options.to = { x = -1, z = -1 }, 2
    return sys:integrate(options)
  end
  expect(function() run { branch = { z = 3 } } end):fails(
    'branch = { z = 3 }: solutions that meet have the same z; they differ in a derivative: write '
    .. 'branch = "smooth", or choose by its value, branch = { [z.dot] = 1 }')
  expect(function() run { branch = { [x.dot] = 1 } } end):fails "solutions that meet have the same x′"
  expect(function() run { branch = { [v] = 1 } } end):fails "v is no unknown of the model"
  expect(run { branch = { [z.dot] = 0 } }.status):matches(
    "none of them is clearly the one that was asked for; write branch = { %[z.dot%] = %-1 } or ")
  expect(run { branch = { [der(z, 2)] = 0 } }.status):matches "z″ does not tell them apart; write branch = "
  expect(function() run { branch = "left" } end):fails 'branch = "smooth"'
  expect(function() run { branch = {} } end):fails "branch is empty"
  expect(function() run { branch = { q = 1 } } end):fails "unknown symbol 'q'"
  expect(function() run { branch = "smooth", dt = 0.1, method = rk.rk4 } end):fails "leave dt out"
  local pole = dae { der(x) ~ 1, z*v ~ 1, v ~ x }           -- z = 1/x: no branch leads across
  local sol = pole:integrate { start = { x = -1, v = -1, z = -1 }, to = 2, branch = "smooth" }
  expect(sol.status):matches "stopped at t = "
end)

test("a run that begins where branches meet follows the one that is asked for; a start there says so", function()
  for _, u in ipairs { 1e-6, 1, 1e6 } do
    local sys = dae { der(x) ~ u, 0 ~ z^2 - x^2 }
    for _, method in ipairs(methods) do
      for _, sign in ipairs { 1, -1 } do
        local sol = sys:integrate { start = { x = 0, z = 0 }, to = 2, branch = { [z.dot] = sign*u },
          method = method }
        expect(method .. " " .. sol.status):equals(method .. " finished")
        expect(sol:final(z)/u):near(2*sign, 1e-4)
      end
    end
    local ends = sys:integrate { start = { x = 0, z = 0 }, to = 2, branch = "smooth" }.status
    expect(ends):matches "the run begins there, and nothing tells which of them is smooth: write branch = { %[z"
    expect(sys:init { fix = { x = 0, z = 0 } }:ledger()):matches(
      "z = 0 here, where solutions meet: they go on with z′ = %-[^ ]+ or z′ = [^ ]+; integrate follows one")
    expect(function() sys:init { fix = { x = 0 } } end):fails "are singular here, where z = 0: rank 1 of 2"
    expect(function() sys:init { fix = { x = 0 } } end):fails "Solutions meet here and go on with z′ = -"
  end
end)

test("branches whose equations have sizes between 1 and 300 are told by first derivatives", function()
  for _, size in ipairs { 1, 30, 1e3, 1e5 } do
    local sys = dae { der(x) ~ v, der(v) ~ -x, 0 ~ z^2 - size^2*x^2 }
    for _, method in ipairs { "auto", "radau" } do
      local sol = sys:integrate { start = { x = -1, v = 1, z = -size }, to = 2, method = method }
      local below, above = sol.status:match "go on there with z′ = (%S+) or z′ = (%S+) "
      expect(tonumber(below)/size):near(-math.sqrt(2), 5e-3)
      expect(tonumber(above)/size):near(math.sqrt(2), 5e-3)
    end
  end
end)

-- A long step may solve for the other root: it is repeated in shorter ones, and ends no run.
test("steps beside branches that do not meet on the way", function()
  for _, slope in ipairs { 2, 1.1 } do
    local sys = dae { der(x) ~ 1, 0 ~ (z - x)*(z - slope*x) }
    for _, method in ipairs { "auto", "tsit5", "verner87", "bdf" } do
      for _, rtol in ipairs { 1e-3, 1e-4, 1e-5, 1e-7 } do
        for _, x0 in ipairs { -1.3, -1.01, -2 } do
          local sol = sys:integrate { start = { x = x0, z = x0 }, to = 1, rtol = rtol, method = method }
          expect(sol.status):equals "finished"
          expect(sol:final(z) / sol:final(x)):near(1, 1e-2)
        end
      end
    end
  end
end)

test("of branches that touch, those that are solutions are named, and the smooth one is followed", function()
  for _, r in ipairs { 1e-3, 1e-5, 1e-6, 1e-7, 1e-9 } do
    for _, side in ipairs { 1, -1 } do
      local run = { start = { x = -1, z = side }, to = 2, rtol = r }
      expect(dae { der(x) ~ 1, 0 ~ z^2 - x^4 }:integrate(run).status):matches "z″ = %-2 or z″ = 2 %("
      run.branch = "smooth"
      local sol = dae { der(x) ~ 1, 0 ~ z^2 - x^4 }:integrate(run)
      if sol.status == "finished" then expect(sol:final(z)):near(side, 1e-3) end  -- or it says why not
    end
  end
  local run = { start = { x = -1, z = 1 }, to = 2 }
  local function ways(factors) return dae { der(x) ~ 1, 0 ~ factors }:integrate(run).status end
  expect(ways((z - x^2)*(z - 2*x^2))):matches "z″ = 2 or z″ = 4 %("
  expect(ways((z - x^2)*(z + x^2 + x^3))):matches "z″ = %-2 or z″ = 2 %("
end)

test("a run may end where branches meet", function()
  for _, from in ipairs { -1, 1 } do
    local sys = dae { der(x) ~ -from, 0 ~ z*(z - x)*(z + 2*x) }
    local sol = sys:integrate { start = { x = from, z = from }, to = 1, branch = "smooth" }
    expect(sol.status):equals "finished"
    expect(sol.t[#sol.t]):near(1, 1e-12)
    expect(sol:final(z)):near(0, 1e-6)
  end
end)
