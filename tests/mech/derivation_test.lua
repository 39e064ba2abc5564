-- The derivation of Lagrange's equations as a solution sheet prints it.
local q = var("q", 6)
p1, p2 = q:slice(1, 3), q:slice(4, 6)               -- globals lend their names to printed vectors
local m, g, R, L = params "m=1 g=9.81 R=1 L=0.5"
local chain = lagrange { q = q, T = m/2*q.dot.T*q.dot, V = m*g*(p1[3] + p2[3]),
  C = { (p1.T*p1 - R^2)/2, (norm(p2 - p1)^2 - L^2)/2 } }

local has = require "printed"
local function lacks(text, words) expect(tostring(text):find(words, 1, true)):equals(nil) end

test("two masses on a sphere: every line that a sheet has", function()
  local text = chain:trace()
  for _, line in ipairs {
    "L = m q′ᵀq′/2 - z₁ (p1ᵀp1 - R²)/2 - z₂ ((p2 - p1)ᵀ(p2 - p1) - L²)/2 - m g (q₃ + q₆)",
    "∂L/∂q′ = m q′", "d/dt ∂L/∂q′ = m q″", "∂L/∂p1 = -m g e₃ - z₁ p1 - z₂ (p1 - p2)",
    "∂L/∂p2 = z₂ (p1 - p2) - m g e₃", "∂C/∂q = ⎡  q₁       q₂",
    "d/dt ∂L/∂q′ - ∂L/∂q = Q and C = 0:", "(1)  m p1″ + z₁ p1 + z₂ (p1 - p2) = -m g e₃",
    "W(q) q″ + (∂C/∂q)ᵀ z = c", "W = ∂²T/∂q′² = ⎡m", "q′ = v", "v₄′ = z₂ (q₁ - q₄)/m", "0 = (p1ᵀp1 - R²)/2",
  } do has(text, line) end
end)

test("three levels: results, steps, every part", function()
  local short, full, every = chain:trace "short", chain:trace(), chain:trace "every step"
  expect(#short < #full and #full < #every):is_true()
  lacks(short, "∂L/∂q′ =")
  has(short, "(1)  m p1″")
  has(every, "∂C₂/∂p2 = p2 - p1")
  lacks(full, "∂C₂/∂p2")
  expect(tostring(chain:trace "full")):equals(tostring(full))
  expect(tostring(chain:trace { detail = "short" })):equals(tostring(short))
  expect(function() chain:trace "shrt" end):fails "Did you mean 'short'"
end)

test("forms of the model begin with it; in every step with the energies", function()
  local low = chain:reduce "acc"
  lacks(low:trace(), "Lagrange function")
  has(low:trace "every step", "Lagrange function")
end)

local x, th = vars "x theta"
local M, f = params "M f"

test("generalised forces are told from where they come", function()
  local cart = lagrange { q = { x, th }, T = (m + M)/2*x.dot^2 + M*L^2/2*th.dot^2 - L*M*th.dot*x.dot*sin(th),
    V = M*g*L*sin(th), Q = generalized_force({ x, th }, { { vec { x }, vec { f } } }) }
  local text = cart:trace()
  has(text, "force f at x:  δW = Fᵀ δp")
  has(text, "Q(x) = f")
  has(text, "∂L/∂x′ = (m + M) x′ -")                 -- the lecture's gradients, term by term
  has(text, "θ″ - ")
  has(text, "ω′ = ")
  local by_hand = lagrange { q = { x }, T = m/2*x.dot^2, V = 0, Q = vec { f } }
  has(by_hand:trace(), "Q = f")
  lacks(by_hand:trace(), "force f at")
  has(lagrange { q = { x }, T = m/2*x.dot^2, V = 0 }:trace(), "No forces besides those of V")
end)

test("in LaTeX no mark and no Unicode sign of mathematics is left", function()
  local latex = chain:trace("every step", { latex = true })
  expect(latex:find("[\x1a-\x1f]")):equals(nil)
  for _, sign in ipairs { "′", "∂", "δ", "ᵀ", "₁" } do lacks(latex, sign) end
  has(latex, "\\frac{\\mathrm{d}}{\\mathrm{d}t} \\frac{\\partial L}{\\partial \\dot{\\mathbf{q}}}")
  expect(select(2, latex:gsub("%$", "")) % 2):equals(0)
end)

test("a model in LaTeX is numbered by rows and broken where it is wide", function()
  local latex = chain:latex()
  has(latex, [[0 &= \frac{\mathbf{p}_1^\top \mathbf{p}_1 - R^2}{2} \tag{2a}]])
  local a = vars "a b c d"
  local y = var "y"
  local sum = 0
  for i = 1, 30 do sum = sum + param("k" .. i)*y^i end
  local long = dae { der(y) ~ sum }:latex()
  expect(select(2, long:gsub("\\tag", "")) == 1 and select(2, long:gsub("\\notag", "")) >= 1):is_true()
end)

test("semi_explicit: x′ = f and 0 = g with their signs, usual names of velocities", function()
  local se = chain:semi_explicit()
  expect(se:index()):equals(3)
  lacks(se, "at most")
  has(se, "v₁′ = -(q₁ z₁ + z₂ (q₁ - q₄))/m")
  has(se, "0 = (p1ᵀp1 - R²)/2")
  local p = vars "p"
  local two = lagrange { q = { th, x }, T = m/2*x.dot^2 + m/2*th.dot^2, V = m*g*x }:semi_explicit()
  has(two, "θ′ = ω")
  has(two, "v_x′ = -g")
  local T = m/2*x.dot^2 + m*x.dot*th.dot/2 + m/2*th.dot^2
  local coupled = lagrange { q = { x, th }, T = T, V = m*g*x }:semi_explicit()
  has(coupled, "v_x′ = -4 g/3")
end)

test("an equation keeps its sign: F is left - right, and g of 0 = g", function()
  local y, w = vars "y w"
  local sys = dae { der(y) ~ w - y, 0 ~ w^3 - y, w ~ 2*y }
  local F = tostring(sys:implicit())
  has(F, "0 = y′ + y - w")
  has(F, "0 = w³ - y")
  has(F, "0 = w - 2 y")
end)

test("every form is derived: conditions row by row, why they suffice, what follows", function()
  local x, y = vars "x y"
  local low = lagrange { q = { x, y }, T = m/2*(x.dot^2 + y.dot^2), V = m*g*y, C = { (x^2 + y^2 - L^2)/2 } }
  local function told(form, level, ...)
    local text = tostring(low:reduce(form):trace(level))
    for _, line in ipairs { ... } do
      if not text:find(line, 1, true) then error(form .. " lacks '" .. line .. "':\n" .. text, 2) end
    end
    return text
  end
  local brief = told("ggl", "short", "(4)′:  0 = x v_x + y v_y", "The index is 2.")
  expect(brief:find "On the exact solution"):equals(nil)
  told("ggl", "full", "On the exact solution μ = 0", "q′ = v - Cqᵀ μ,  Cq = ∂C/∂q")
  told("ggl", "every step", "Cq Cqᵀ = x² + y²")
  told("dummy", "full", "0 = x x″ + y y″ + x′² + y′²",
    "with the coefficient y: it can be solved for it where y ≠ 0.",
    "y′, y″ are replaced by the dummy derivatives y_dot, y_ddot")
  told("array", "full", "differentiated 3 times: (4)", "become algebraic unknowns: ")
  told("ode", "full", "(2) is linear in z:  A z = b", "A = (x² + y²)/m")
  local at = low:init { fix = { x = 0.1, [x.dot] = 1 }, guess = { y = -1 }, params = { L = 1 } }
  local minimal = tostring(low:reduce("minimal", { at = at }):trace())
  expect(minimal):matches "What remains of the equations:"
end)

test("a derivation in LaTeX: dots and no primes, numbers as tags, numerators that fit the line", function()
  local text = chain:trace():latex()
  has(text, [[\frac{\mathrm d}{\mathrm dt} \frac{\partial L}{\partial \dot{q}} - ]],
    [[0 = \frac{\mathbf{p}_1^\top \mathbf{p}_1 - R^2}{2} \tag{2a}]], [[$\displaystyle W(q) \ddot{q} + ]])
  expect(text:find "q'"):is_nil()
  has(chain:reduce "ode":trace():match "ode: .*", "⎣p1ᵀ(p1 - p2)/m  2 (p1 - p2)ᵀ(p1 - p2)/m⎦")
  has(chain:reduce "acc":trace():latex(), [[$\ddot{q}_{1}$, $\ddot{q}_{2}$]],
    [[is differentiated twice because it contains neither $\ddot{q}$ nor $z$]])
  local l1, l2, m1, m2, g1 = params "l1 l2 m1 m2 g1"
  local th1, th2 = vars "theta1 theta2"
  local p = vec { l1*sin(th1), -l1*cos(th1) }
  local r = p + vec { l2*sin(th2), -l2*cos(th2) }
  local double = lagrange { q = { th1, th2 }, T = m1/2*der(p).T*der(p) + m2/2*der(r).T*der(r),
    V = m1*g1*p[2] + m2*g1*r[2] }
  has(double:reduce "ode":latex(), [[\frac{\begin{gathered} ]])
  expect(double:latex():find "gathered"):is_nil()
end)

test("a derivation in a page: equations with their numbers, fractions in full size, no LaTeX left", function()
  local page = view(chain:reduce "acc":trace "every step", { file = os.tmpname() .. ".html", open = false })
  local html = io.open(page):read "a"
  has(html, [[class="tag"><mtext>(2a)</mtext>]], [[<math displaystyle="true">]])
  expect(html:find("1ex", 1, true)):is_nil()
  expect(html:match "<p class=\"step\">[^\n]*\\[^\n]*"):is_nil()
end)
