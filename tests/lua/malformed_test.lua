-- At least 300 malformed inputs: each gets an error that starts with a place, is no internal error and no
-- NaN, and the session goes on. Part 1: what people really type, with the words the message must contain.
-- Part 2: every word of the vocabulary, with arguments of every wrong kind.

local setup = [[
  x, y, z = vars "x y z"
  q = var("q", 3)
  m, g, L = params "m=1 g=9.81 L=1"
  u = input "u"
  decay = dae { der(x) ~ -x }
  ball = lagrange { q = q, T = m/2*q.dot.T*q.dot, V = m*g*q[3], C = { (q.T*q - L^2)/2 } }
]]

-- { code, words of the message … }
local typed = {
  -- Lua's silent traps
  { "return x < y", "lt" }, { "return x <= 1", "le" }, { "return 1 > x", "gt" },
    { "if x > y then end", "gt" },
  { "dae { x == y }", "~" }, { "dae { 3 }", "~" }, { "dae { der(x) ~ x, true }", "~" },
    { "dae { der(x) = -x }", "" },
  { "return vec{1, nil, 3}", "nil" }, { "return undefined_thing", "undefined_thing" },
    { "return sinn(x)", "sin" },
  { "lagrnge {}", "lagrange" }, { "x.dott = 1", "" }, { "return x.dott", "dot" }, { "q[1] = 5", "" },
    { "return q[0]", "3" },
  { "return bin({1, 1/0}, 2)", "infinite" }, { "return smooth_density{1, 1/0}", "infinite" },
  { "return q[4]", "3" }, { "return q[1.5]", "" }, { "return q(1, 2)", "1" }, { "return q:slice(2, 9)", "" },
  { "return q:slice(0, 1)", "" }, { "return q:slice(3, 1)", "" }, { "return q:block(1, 9, 1, 1)", "" },
  { "return ('x') + x", "" }, { "return {} + x", "" }, { "return x + nil", "nil" },
    { "return x + true", "boolean" },
  { "return x // 2", "" }, { "return x % 2", "" }, { "return x & 1", "" }, { "return #decay", "" },
    { "return decay()", "" },
  { "return decay.indx", "index" }, { "return decay:indx()", "index" }, { "return decay + 1", "" },
  -- numbers and symbols
  { "return x/0", "zero" }, { "return rational '1/0'", "zero" }, { "return rational 'a'", "a" },
    { "return rational ''", "" },
  { "return x*(0/0)", "nan" }, { "return x + 1/0", "inf" }, { "return sqrt(x - x - 1)", "sqrt(-1)" },
    { "return log(0)", "log(0)" },
  { "return var ''", "name" }, { "return var '1x'", "1x" }, { "return var 'a b'", "a b" },
    { "return var(3)", "" },
  { "return var('q', -1)", "-1" }, { "return var('q', 0)", "0" }, { "return var('q', 1e12)", "" },
    { "return var 'x\\xff'", "byte 2 is 255" }, { "return param('\\xed\\xa0\\x80', 1)", "byte 1 is 237" },
    { "return input 'u\\xc3'", "byte 2 is 195" }, { "return vars 'x \\xc0\\x80'", "byte 1 is 192" },
    { "return func('\\xf4\\x90\\x80\\x80', 1)", "utf8.char" }, { "return var 'cell.\\x80'", "byte 6 is 128" },
  { "return decay:integrate { start = { x = 1 }, to = 1, [{}] = 2 }", "the key [a table]" },
    { "return decay:integrate { start = { [print] = 1 }, to = 1 }", "the key [a function]" },
    { "return dae { [coroutine.create(print)] = 1 }", "the key 'a coroutine'" },
    { "return rk[print]", "'a function'" },
  { "return var('q', 2.5)", "2.5" },
  { "return params 'm='", "m" }, { "return params 'm=one'", "one" }, { "return params '=1'", "" },
    { "return param()", "" },
  { "return input(7)", "" }, { "return func ''", "name" }, { "return func('g', 0)", "" },
    { "return func('g')()", "" },
  { "return vars ''", "" }, { "return vars(1)", "" }, { "return var('x', { unt = 'm' })", "unit" },
  -- matrices
  { "return vec{1,2} + vec{1,2,3}", "2" }, { "return mat{{1,2},{3}}", "2" },
    { "return mat{{1,2},{3,4}} * vec{1,2,3}", "2" },
  { "return eye(-1)", "-1" }, { "return eye(1e9)", "" }, { "return zeros(1e6, 1e6)", "" },
    { "return zeros(2, -1)", "-1" },
  { "return zeros('a')", "" }, { "return det(vec{1,2})", "2" },
    { "return inv(mat{{1,1},{1,1}})", "singular" },
  { "return inv(mat{{1,2,3}})", "" }, { "return solve(mat{{1,1},{1,1}}, vec{1,2})", "singular" },
  { "return solve(eye(2), vec{1,2,3})", "" }, { "return vstack(vec{1}, mat{{1,2}})", "" },
    { "return hstack(vec{1}, vec{1,2})", "" },
  { "return cross(vec{1,2}, vec{1,2,3})", "3" }, { "return dot(vec{1,2}, vec{1,2,3})", "" },
    { "return norm()", "" },
  { "return mat{{1}, {2, 3}}", "2" }, { "return vec{1, {}}", "" }, { "return vec{{}}", "" },
    { "return mat{{x}, print}", "function" }, { "return diag('a')", "" },
  { "return eig(mat{{1,2,3}})", "" }, { "return expm(vec{1,2})", "" }, { "return charpoly(vec{1,2})", "" },
    { "return rank()", "" },
  { "return linspace(0, 1, 0)", "" }, { "return linspace(0, 1, -3)", "" },
    { "return linspace(0, 1, 1e12)", "" },
  { "return linspace('a', 1, 3)", "" }, { "return sum(print)", "" }, { "return sum{1, print}", "entry 2" },
    { "return sum{print}", "entry 1" }, { "return map(3, sin)", "" }, { "return map({1}, 3)", "" },
  { "return sum{1, nil, 2}", "" }, { "return blkdiag()", "" }, { "return vec{1, 'two'}", "two" },
    { "return vec{1, true}", "boolean" },
  { "return vec{print}", "function" }, { "return q.T.T.foo", "foo" },
  -- calculus
  { "return diff(x^2)", "" }, { "return diff(x^2, 2)", "" }, { "return diff(x^2, x^2)", "" },
    { "return diff(x, x, -1)", "" },
  { "return jacobian(x, 3)", "" }, { "return gradient(q, q)", "" }, { "return hessian()", "" },
    { "return der()", "" },
  { "return der(x, -1)", "" }, { "return der('x')", "" }, { "return subs(x, 3)", "" },
    { "return subs(x, { [3] = 1 })", "" },
  { "return subs(x, { w = 1 })", "w" }, { "return subs(x, { x = 1, [x] = 2 })", "x" },
    { "return evaluate(x)", "x" },
  { "return evaluate(x*y, { x = 1 })", "y" }, { "return evaluate(log(x), { x = -1 })", "log(x)" },
    { "return evaluate(x, { x = 'a' })", "" },
  { "return evaluate(1/x, { x = 0 })", "" }, { "return evaluate(q, { q = {1, 2} })", "3" },
    { "return evaluate(x, { x = 1, y = 2, xx = 3 })", "xx" },
  { "return fn({x}, x*y)", "y" }, { "return fn({x}, x)()", "" }, { "return fn({x}, x)(1, 2)", "" },
    { "return fn(x)", "" },
  { "return fn({x, x}, x)", "" }, { "return fn({x}, x)('a')", "" }, { "return simplify()", "" },
    { "return expand((x + y)^100000)", "" },
  { "return implicit_jacobian(x^2 + y, x)", "" }, { "return implicit_jacobian(x - x*1 + y*0 + 1, x, y)", "" },
    { "return latex()", "" },
  { "return ifelse(lt(x, 0), 1)", "" }, { "return ifelse(true, x)", "" }, { "return lt(x)", "" },
    { "return all()", "" },
  { "return jacobian(vec{x, y}, vec{x, x^2})", "" }, { "return x:latx()", "latex" },
    { "return x:code().x.y", "" },
  -- mechanics
  { "lagrange {}", "q" }, { "lagrange { q = {x} }", "T" }, { "lagrange { q = {x}, T = 0 }", "velocity" },
    { "lagrange { q = {x}, T = x^2 }", "velocity" },
  { "lagrange { q = {x, x}, T = x.dot^2 }", "twice" }, { "lagrange { q = {m}, T = x.dot^2 }", "variables" },
    { "lagrange { q = {}, T = x.dot^2 }", "" },
  { "lagrange { q = {x}, T = x.dot^2/2, C = { m - 1 } }", "coordinate" },
    { "lagrange { q = {x}, T = x.dot^2/2, C = { x - 1, 2*x - 3 } }", "contradicts" },
  { "lagrange { q = {x, y}, T = x.dot^2/2 }", "y" },
    { "lagrange { q = {x}, T = x.dot^2/2, Q = {1, 2} }", "2" },
  { "lagrange { q = {x}, T = x.dot^2/2 + y.dot^2 }", "y" },
    { "lagrange { q = {x}, T = x.dot^2/2, V = z }", "z" },
  { "lagrange { q = {x}, T = x.dot^2/2, U = 3 }", "U" }, { "lagrange { q = {x}, T = 'abc' }", "abc" },
    { "lagrange { q = 3, T = x.dot^2 }", "" },
  { "lagrange { q = {x, y}, T = (x.dot^2 + y.dot^2)/2, C = { x.dot - 1 } }", "" }, { "lagrange(1)", "" },
    { "lagrange { q = {x}, T = x.ddot^2 }", "" },
  { "lagrange { q = {x, y}, T = (x.dot^2+y.dot^2)/2 + z*0, C = { x*z - y } }", "z" },
  { "generalized_force(q, { {vec{1, 2}, vec{1, 2, 3}} })", "2" }, { "generalized_force(q, 3)", "" },
    { "generalized_force(q, { 3 })", "pair" },
  { "return decay.M", "lagrange" }, { "return decay.energy", "lagrange" },
    { "return decay.matrix_form", "lagrange" },
  -- models
  { "dae {}", "equation" }, { "dae()", "" }, { "dae { 1 ~ 2 }", "~" }, { "dae { x - x + 1 ~ 2 }", "~" },
    { "dae { m ~ 2*m }", "unknown" }, { "dae { name = 3, der(x) ~ x }", "name" },
  { "dae { der(x) ~ x, nam = 'a' }", "nam" }, { "dae { vec{x, y} ~ vec{1, 2, 3} }", "" },
    { "dae { 'x' ~ 2 }", "" },
  { "dae { der(x) ~ param 'x' }", "'x'" }, { "dae.semi_explicit { x = x, f = y }", "y" },
    { "dae.semi_explicit { x = {x, y}, f = x }", "2" },
  { "dae.semi_explicit { x = x }", "f" }, { "dae.semi_explicit { x = 3, f = 3 }", "" },
    { "dae.semi_explicit { x = x, f = der(x) }", "" },
  { "dae.implicit { x = x }", "F" }, { "dae.implicit { x = x, F = y }", "y" },
    { "dae.linear { E = eye(2), A = eye(3) }", "3" },
  { "dae.linear { E = eye(2) }", "A" }, { "dae.linear { E = eye(2), A = eye(2), B = eye(3) }", "B" },
    { "dae.linear { E = 'a', A = eye(2) }", "" },
  { "dae.linear { E = eye(2), A = eye(2), x = q }", "3" }, { "dae { der(x) ~ y }:index()", "unknown" },
    { "dae { x ~ 1, x ~ 2 }:index()", "" },
  { "decay:with { k = 1 }", "k" }, { "decay:with(3)", "" }, { "ball:with { m = x }", "number" },
    { "ball:with { m = {1, 2} }", "" }, { "ball:with { mm = 1 }", "m" },
  { "ball:reduce 'ac'", "acc" }, { "ball:reduce(3)", "" }, { "decay:constraints()[1]", "" },
  -- starts
  { "decay:init {}", "x" }, { "decay:init()", "" }, { "decay:init { fix = 3 }", "" },
    { "decay:init { fix = { w = 1 } }", "w" }, { "decay:init { fix = { x = 'a' } }", "" },
  { "decay:init { fix = { x = 1, [x] = 2 } }", "x" }, { "decay:init { fix = { x = {1, 2} } }", "" },
    { "decay:init { fix = { x = 0/0 } }", "" },
  { "decay:init { fix = { x = 1/0 } }", "" }, { "decay:init { fx = { x = 1 } }", "fix" },
    { "decay:init { fix = { x = true } }", "" }, { "decay:init { fix = { x = y } }", "" },
  { "ball:init { fix = { [q] = {2, 0, 0}, [q.dot] = {0, 0, 0} } }", "C" },
    { "ball:init { fix = { [q] = {1, 0, 0}, [q.dot] = {1, 0, 0} } }", "C′" },
  { "ball:init { fix = { [q] = {1, 0, 0} } }", "q" }, { "ball:init { fix = { [q] = {1, 0} } }", "3" },
    { "ball:init { guess = { w = 1 } }", "w" },
  { "dae { der(x) ~ -param('k_free')*x }:init { fix = { x = 1 } }", "k_free" },
    { "dae { der(x) ~ u }:init { fix = { x = 1 } }", "u" },
  { "dae { der(x) ~ u }:init { fix = { x = 1 }, inputs = { u = y } }", "y" },
    { "dae { der(x) ~ u }:init { fix = { x = 1 }, inputs = { w = 1 } }", "w" },
  { "dae { der(x) ~ u }:init { fix = { x = 1 }, inputs = { u = function() error 'boom' end } }", "boom" },
  { "dae { der(x) ~ u }:init { fix = { x = 1 }, inputs = { u = function() return 'a' end } }", "" },
  { "dae { der(x) ~ y, 0 ~ y^2 + 1 }:init { fix = { x = 0 } }", "" },
    { "decay:init { fix = { x = 1 } }(y)", "y" }, { "decay:init { fix = { x = 1 } }()", "" },
  { "decay:init { fix = { x = 1 }, from = 'now' }", "from" },
    { "decay:init { fix = { x = 1 }, params = { k = 1 } }", "k" },
  -- tableaus
  { "tableau {}", "" }, { "tableau { A = { {0} }, b = { 2 } }", "b" },
    { "tableau { A = { {0, 0}, {1, 0} }, b = { 1/2, 1/2 }, c = { 0, 1/2 } }", "c" },
  { "tableau { A = { {0}, {1} }, b = { 1 } }", "" }, { "tableau 'nonsense'", "" }, { "tableau(3)", "" },
    { "rk.gauss(0)", "" }, { "rk.gauss(-2)", "" },
  { "rk.gauss(1.5)", "" }, { "rk.gauss(1e6)", "" }, { "rk.gaus(2)", "gauss" }, { "rk.collocation {}", "" },
    { "rk.collocation { 1, 1 }", "" }, { "return rk.rk4.ordr", "order" },
  -- integration
  { "decay:integrate()", "" }, { "decay:integrate {}", "start" },
    { "decay:integrate { start = { x = 1 }, method = rk.rk4, dt = 0.1 }", "to" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4 }", "dt" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0 }", "dt" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = -0.1 }", "dt" },
  { "decay:integrate { start = { x = 1 }, to = -1, method = rk.rk4, dt = 0.1 }", "to" },
    { "decay:integrate { start = { x = 1 }, to = 0, method = rk.rk4, dt = 0.1 }", "to" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'dorpi5', dt = 0.1 }", "" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = 3, dt = 0.1 }", "" },
  { "decay:integrate { start = { x = 1 }, to = 1/0, method = rk.rk4, dt = 0.1 }", "" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0/0 }", "dt" },
  { "decay:integrate { start = { w = 1 }, to = 1, method = rk.rk4, dt = 0.1 }", "w" },
    { "decay:integrate { start = 3, to = 1, method = rk.rk4, dt = 0.1 }", "start" },
  { "decay:integrate { start = {}, to = 1, method = rk.rk4, dt = 0.1 }", "x" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1, stpes = 3 }", "stpes" },
  { "ball:integrate { start = { [q] = {1,0,0}, [q.dot] = {0,1,0} }, to = 1, method = rk.rk4, dt = 0.1 }",
    "index 3" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1, times = { 0.5, 0.2 } }",
    "times" }, { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1, times = { 5 } }",
    "5" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1 }(y)", "y" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1 }(x, 7)", "7" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1 }(x, 'a')", "" },
    { "decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1 }()", "" },
  { "return decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1 }.foo", "foo" },
    { "decay:integrate { start = ball:init { fix = { [q] = {1,0,0}, [q.dot] = {0,1,0} } }, to = 1, method = rk.rk4, dt = 0.1 }", "x" },
  -- plots, help, files
  { "plot()", "" }, { "plot({1, 2}, {1})", "2" }, { "plot({})", "" }, { "plot({0/0})", "" },
    { "plot({1, 2}, {1, 2}, { titel = 'a' })", "title" }, { "plot({1, 2}):save 'a.bmp'", "svg" },
  { "plot({1, 2}):save '/nonexistent/a.svg'", "nonexistent" }, { "plot('a')", "" }, { "plot3({1}, {1})", "" },
    { "semilogy({-1, -2})", "" }, { "loglog({0}, {0})", "" }, { "spy(3)", "" },
  { "help 'reduec'", "reduce" }, { "help(nil)", "" }, { "examples 'nothing_like_this'", "" },
    { "apropos()", "" }, { "apropos(3)", "" },
  -- Lua itself
  { "local function f() return 1 + f() end f()", "stack" }, { "return ('x'):rep(1e10)", "too large" },
    { "error()", "" }, { "error({})", "" }, { "error(nil)", "" }, { "return #print", "" },
  { "local a <const> = 1; a = 2", "" }, { "goto nowhere", "nowhere" }, { "return ('a')()", "" },
    { "return nil .. 'a'", "nil" }, { "setmetatable(x, {})", "" }, { "return load('\27Lua')()", "" },
  { "for i = 1, 10, 0 do end", "zero" }, { "return table.concat({{}})", "" },
    { "return string.format('%d', 1.5)", "" }, { "return tostring()", "" }, { "return select(0)", "" },
    { "x = = 1", "" },
}

local function attempt(code)
  local env = setmetatable({}, { __index = _G })
  assert(load(setup, "=setup", "t", env))()
  local chunk, syntax = load(code, "=typed", "t", env)
  if not chunk then return false, syntax, env end
  local ok, message = pcall(chunk)
  return ok, message, env
end

local function alive(env)
  local ok, value = pcall(load("return evaluate(x^2, { [x] = 3 })", "=alive", "t", env))
  return ok and value == 9
end

-- What is wrong with the answer to a line, or nil.
local function complaint(code, ok, message, words)
  local text = tostring(message)
  if ok then return "no error" end
  if text:find("internal error", 1, true) then return "internal error" end
  local thrown = code:match "^error"  -- the script's own error values travel unchanged
  if not thrown and not text:match "^[%w_./]+:%d+:" then return "no place in the message" end
  for _, word in ipairs(words) do
    if not text:find(word, 1, true) then return "'" .. word .. "' is missing" end
  end
end

test("what people mistype gets a clear error and a living session", function()
  local complaints = {}
  for _, case in ipairs(typed) do
    local code = case[1]
    local ok, message, env = attempt(code)
    local wrong = complaint(code, ok, message, { table.unpack(case, 2) })
    if not alive(env) then wrong = "the session did not survive" end
    if wrong then complaints[#complaints + 1] = wrong .. " for: " .. code .. "   -> " .. tostring(message) end
  end
  if #complaints > 0 then error(table.concat(complaints, "\n"), 0) end
  expect(#typed >= 300):equals(true)
end)

test("every word of the vocabulary, with arguments of every wrong kind", function()
  local wrong = { true, print, {}, { true }, "no such thing", -1, 1e300, 0/0, coroutine.create(print),
    io.stdout }
  local skip = { edit = true, cd = true, record = true, save_session = true, help = true, apropos = true,
    examples = true, test = true, expect = true, print = true,
    load = true }
  for name, f in pairs(pendula) do
    if (type(f) == "function") and not skip[name] then
      for _, a in ipairs(wrong) do
        for _, arguments in ipairs { { a }, { a, a }, { var "x", a }, { a, var "x", a } } do
          local ok, message = pcall(f, table.unpack(arguments))
          local text = tostring(message)
          if not ok and text:find("internal error", 1, true) then
            error(name .. "(" .. tostring(a) .. ", …): " .. text, 0)
          end
          if ok and type(message) == "number" and message ~= message and a == a then
            error(name .. "(" .. tostring(a) .. ", …) gives NaN", 0)
          end
        end
      end
    end
  end
  os.remove "no such thing"                                      -- save("no such thing", x) has written it
end)
