-- What an attack on version d56f8bb found and no other test holds: systems without inputs, outputs
-- or states; unknowns that are infinite on the whole of a run; signs that files mix.

-- A value or an error of ours; `what` goes into the message.
local function answers(what, f)
  local good, message = pcall(function() return tostring(f()) end)
  if not good and tostring(message):find "internal error" then error(what .. ": " .. message, 2) end
  expect(#tostring(message) > 0):is_true()
end

local systems = { empty = ss { {} }, unfed = ss({ { -1 } }, zeros(1, 0), { { 1 } }, zeros(1, 0)),
  unseen = ss({ { -1 } }, { { 1 } }, zeros(0, 1), zeros(0, 1)),
  gain = ss(zeros(0, 0), zeros(0, 1), zeros(1, 0), { { 3 } }) }

test("every method of systems without inputs, outputs or states answers", function()
  local methods = ("tf ss zpk latex feedback d2c dcgain poles zeros charpoly stability is_stable damp " ..
    "controllability observability minreal gram norm margin transition solution step impulse bode " ..
    "nyquist"):gmatch "%a+"
  for method in methods do
    for name, G in pairs(systems) do
      answers(name .. ":" .. method, function() return G[method](G) end)
      answers(name .. " by tf:" .. method, function() return G:tf()[method](G:tf()) end)
    end
  end
  for name, G in pairs(systems) do
    answers(name .. ":c2d", function() return G:c2d(0.1) end)
    for _, f in ipairs { series, parallel, feedback, hstack } do
      answers(name .. " joined", function() return f(G, G) end)
    end
    for _, f in ipairs { lqr, lqe, kalman, place, balred, balreal } do
      answers(name .. " designed", function() return f(G, 1, 1) end)
    end
  end
end)

test("an unknown that is infinite wherever its equations hold does not finish", function()
  local y, w = vars "y_inf w_inf"
  for _, method in ipairs { "auto", "verner87", "radau", "gauss", "bdf", "rodas" } do
    local good, sol = pcall(function()
      return dae { 0 ~ y, 0 ~ w + t/atan(y) }:integrate { to = 2, method = method }
    end)
    expect(good and sol.status == "finished"):equals(false)
    local falling = dae { der(y) ~ -1, 0 ~ w + t/atan(y) }
      :integrate { start = { [y] = 1 }, to = 2, method = method }
    expect(falling.status):matches "^stopped at t = 1: .*atan%(y_inf%)"
  end
end)

test("an algebraic unknown without digits left does not hold up a run", function()
  -- b = 0.77 e^(t²/2): sin b turns 10¹⁷ times a second in the end
  local a, b, c = vars "a_turn b_turn c_turn"
  local sol = dae { der(a) ~ c, der(b) ~ t*b, 0 ~ c - 0.2244574172*a/(sin(sin(b))^2 + 1) }
    :integrate { start = { [a] = -0.0666666667, [b] = 0.7666666667 }, to = 10, max_steps = 12000 }
  expect(sol.status):matches "max_steps"
end)

test("√|x| is crossed by every method, from either side", function()
  local x = var "x_root"
  for _, method in ipairs { "auto", "dopri5", "tsit5", "dop853", "radau", "gauss", "bdf", "rodas" } do
    local sol = dae { der(x) ~ sqrt(abs(x)) + 1/10 }
      :integrate { start = { [x] = -1 }, to = 5, method = method }
    expect(sol.status):equals "finished"
    -- with u = √|x|: t = 2 (1 - log(11)/10) down to 0, t = 2 (u - log(1 + 10 u)/10) behind it
    local u, rest = 1, 5 - 2*(1 - math.log(11)/10)
    for _ = 1, 50 do u = u - (2*(u - math.log(1 + 10*u)/10) - rest)/(20*u/(1 + 10*u)) end
    expect(sol:final(x)):near(u^2, 1e-4)
    local back = dae { der(x) ~ -sqrt(abs(x)) - 1/10 }
      :integrate { start = { [x] = 1 }, to = 5, method = method }
    expect(back:final(x)):near(-u^2, 1e-4)
  end
end)

test("commas in a file are not guessed to be what they may not be", function()
  local file = os.tmpname()
  local function read(text)
    local out = assert(io.open(file, "w"))
    out:write(text)
    out:close()
    return iddata.read(file, { y = 2, u = 1, Ts = 1 }).y
  end
  expect(read "u\ty\n0\t1,5\n1\t2,25\n"):near(vec { 1.5, 2.25 }, 0)
  expect(read "u;y\n0;1.5\n1;2.25\n"):near(vec { 1.5, 2.25 }, 0)
  expect(function() read "u\ty\n0\t1,234\n0.5\t7\n" end)
    :fails ":3: '0.5' next to '1,234' in line 2: with semicolons or tabs"
  expect(function() read "u;y\n0.5;1\n1;1,234\n" end):fails ":3: '1,234' next to '0.5' in line 2"
  os.remove(file)
end)

test("searching a derivation fails where it was called", function()
  local x = var "x_found"
  local story = dae { der(x, 2) ~ -x }:reduce():trace()
  for _, f in ipairs { function() story:find "[" end, function() story:match() end,
    function() story:gsub("a", true) end, function() story:gsub("%a", function() error "mine" end) end } do
    local _, message = pcall(f)
    expect(message):matches "attack_test.lua:%d+: "
    expect(select(2, message:gsub("attack_test", ""))):equals(1)
  end
end)
