-- Derivations and models as text and as LaTeX.
local p, v = var("p", 2), var("v", 2)
local z = var "z"
local m, g, L = params "m=1 g=9.81 L=1"
local ball = dae { der(p) ~ v, m*der(v) ~ -z*p - m*g*vec { 0, 1 }, 0 ~ (p.T*p - L^2)/2 }

local function has(story, words) expect(story:find(words, 1, true) ~= nil):is_true() end

test("a derivation names equations by their numbers, in text and in LaTeX", function()
  local story = ball:reduce "acc":trace()
  has(story, "(3)  0 = (pᵀp - L²)/2   is differentiated twice")
  has(story, "substituting (1)  p′ = v")
  local latex = story:latex()
  has(latex, [[(3)  $\displaystyle 0 = \frac{\mathbf{p}^\top \mathbf{p} - L^2}{2}$   is differentiated]])
  has(latex, [[neither $\dot{p}$, $\dot{v}$ nor $z$]])
  has(latex, [[$\mathrm{d}^2/\mathrm{d}t^2$:  $0 = \mathbf{p}^\top \dot{\mathbf{v}} + ]])
  expect(ball:reduce "acc":trace { latex = true }):equals(latex)
  expect(latex:find("[\x1c-\x1f]")):equals(nil)           -- no mark is left
  expect(tostring(story):find("[\x1c-\x1f]")):equals(nil)
  expect(select(2, tostring(story):gsub("\n", "\n")) + 1):equals(#story)
end)

test("every form has a derivation without marks, in both notations", function()
  for _, form in ipairs { "acc", "ggl", "baumgarte", "project", "dummy", "ode" } do
    local story = ball:reduce(form):trace()
    has(story, form == "acc" and "index 1" or form .. ": ")
    expect(tostring(story):find("[\x1c-\x1f]")):equals(nil)
    local latex = story:latex()
    expect(latex:find("[\x1c-\x1f]")):equals(nil)
    expect(latex:find("′", 1, true)):equals(nil)
    expect(latex:find("₁", 1, true)):equals(nil)
    expect(select(2, latex:gsub("%$", "")) % 2):equals(0)    -- dollars in pairs
  end
end)

test("rows of a column equation are (1a), (1b), and keep these names", function()
  local x = var("x", 3)
  local E, A = { { 0, 1, 0 }, { 0, 0, 1 }, { 0, 0, 0 } }, eye(3)
  local list = tostring(dae { E*x.dot ~ A*x + vec { 0, 0, sin(t) } }:constraints())
  has(list, "(1c)")
  expect(list:find("[3]", 1, true)):equals(nil)
end)

test("the original equations keep their numbers in form dummy", function()
  local low = ball:reduce "dummy"
  has(tostring(low), "(3)   0 = (pᵀp - L²)/2")
  has(tostring(low), "[(3) differentiated twice]")
end)

test("a model in LaTeX has a tag for every equation", function()
  expect(ball:latex()):equals [[
\begin{align}
  \dot{\mathbf{p}} &= \mathbf{v} \tag{1} \\
  m \dot{\mathbf{v}} &= -m g \mathbf{e}_2 - z \mathbf{p} \tag{2} \\
  0 &= \frac{\mathbf{p}^\top \mathbf{p} - L^2}{2} \tag{3}
\end{align}]]
end)

test("a model that was not reduced says so; options are checked", function()
  expect(tostring(ball:trace())):equals "The model stands as it was written; nothing was derived."
  expect(ball:trace():latex()):equals "The model stands as it was written; nothing was derived."
  expect(function() ball:trace { latx = true } end):fails "Did you mean 'latex'"
end)

test("param reads a value in its name, as params does", function()
  local R = param "R=1/3"
  expect(R.value):equals(rational "1/3")
  local S = param "S = 2"
  expect(evaluate(S)):equals(2)
  expect(function() param("R=1", 2) end):fails "has its value already"
  expect(select("#", param "R=1 S=2")):equals(2)
end)

test("conditions and projections in sentences", function()
  local x1, x2, u, b, g = var "x1", var "x2", var "u", param "b", func("g", 1)
  local told = tostring(dae { der(x1) ~ x2, der(x2) ~ b*u, 0 ~ g(x1, x2) }:reduce "acc":trace())
  expect(told):matches "Of the original model: the structural answer holds where b ≠ 0%."
  local x, y, z = vars "x y z"
  told = tostring(dae { der(x) ~ y, der(y) ~ z, 0 ~ x - sin(t) }:reduce "project":trace())
  expect(told):matches "after every step x moves as little as possible"
end)
