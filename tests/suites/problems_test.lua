-- Every reference problem (stdlib/problems/): what the literature or a hand calculation says about it against
-- what the program finds, and its reduced forms against each other and against the known solution. A new
-- problem is tested by being listed.
--
-- The declared figures do not come from this program: indices and free values were found by ranks of
-- derivative arrays at exact jets and offsets by brute force (in Python, 60 digits), solutions by hand, end
-- values from the test sets or by extrapolation methods on independently derived equations.

local forms = { "", "acc", "ggl", "baumgarte", "ode", "project", "dummy", "minimal" }

local function has(p, tag) return (" " .. p.tags .. " "):find(" " .. tag .. " ", 1, true) ~= nil end

for _, p in ipairs(problems.list()) do
  test("structure and truth: " .. p.name, function()
    local sys = p()
    local s = sys:structure()
    expect(s.verdict):equals(p.verdict)
    expect(s.structural_index):equals(p.structural_index)
    expect(s.structural_dof):equals(p.structural_dof)
    if not p.index then
      expect(function() return sys:index() end):fails "no index"
      expect(s.index == nil):is_true()
      return
    end
    expect(sys:index()):equals(p.index)
    expect(sys:dof()):equals(p.dof)
    expect(s.index):equals(p.index)
    expect(s.dof):equals(p.dof)
    -- a difference between structure and truth is explained in words
    expect(p.remark ~= nil):equals(p.structural_index ~= p.index or p.structural_dof ~= p.dof)
    -- what is not free is constrained, in the declared list and in the one that is found
    expect(#p.constraints):equals(#sys.differential - p.dof)
    expect(#sys:constraints()):equals(#p.constraints)
    for _, v in ipairs(p.variants or {}) do
      local other = sys:with(v.params)
      expect(other:index()):equals(v.index)
      expect(other:dof()):equals(v.dof)
    end
  end)

  if p.index then
    test("start: " .. p.name, function()
      local sys, at = p(), p:start()
      for _, c in ipairs(p.constraints) do expect(at(c)):near(0, 1e-9) end     -- init solves to 1e-10, scaled
      if p.exact then
        for symbol, value in pairs(p:solution(p.from)) do expect(at(symbol)):near(value, 1e-9) end
      end
      -- the declared and the found conditions have the same tangent space there: together they have no higher
      -- rank
      local found = sys:constraints()
      if #p.constraints > 0 then
        local both = {}
        for _, c in ipairs(p.constraints) do both[#both + 1] = c end
        for i = 1, #found do both[#both + 1] = found[i].rhs - found[i].lhs end
        local J = at(jacobian(vec(both), sys.differential))
        if #both == 1 then J = mat { { J } } end
        expect(rank(J)):equals(#p.constraints)
      end
    end)
  end

  -- The exact pencil is a second road to index and free values of linear systems with constant coefficients.
  local good, pencil = pcall(function() return p():pencil() end)
  if good and has(p, "linear") and p.index then
    test("pencil: " .. p.name, function()
      expect(pencil.regular):equals(true)
      expect(pencil.index):equals(p.index)
      expect(pencil.dof):equals(p.dof)
      expect(#pencil.constraints):equals(#p.constraints)
    end)
  end

  if p.singular then
    test("singular point: " .. p.name, function()
      local at = p():init { fix = p.singular.fix, guess = p.singular.guess, from = p.singular.from }
      expect(p():structure { at = at }.verdict):equals "valid but singular at this point"
    end)
  end

  -- Every form that reduce() offers for it, at 2 dt and dt. Whatever the order, the error at dt is at most
  -- the change from 2 dt to dt (for order one equal, for gauss(3) a 63rd of it), up to rounding that index 3
  -- amplifies.
  if p.index and p.dt and (p.exact or p.reference) then
    test("reduced forms: " .. p.name, function()
      local at = p:start()
      local ran = 0
      for _, form in ipairs(p.forms or forms) do
        local good, low = pcall(function()
          -- the road that is chosen for it
          if form == "" then return p():reduce() end
          return p():reduce(form, (form == "dummy" or form == "minimal") and { at = at } or nil)
        end)
        if not good then
          expect(form ~= ""):is_true()
          expect(#low > 40 and not low:find("internal", 1, true)):is_true()      -- a refusal says why
        else
          if low:dof() ~= p.dof then
            expect(("%s has %d free initial values, the model %d"):format(form, low:dof(),
              p.dof)):equals "as many"
          end
          local function run(dt)
            return low:integrate { start = at, to = p.to, dt = dt, inputs = p.inputs,
              direct = form == "ggl" or nil,
              method = form == "ggl" and rk.radau(3) or rk.gauss(3) }
          end
          local coarse, fine = run(2*p.dt), run(p.dt)
          expect(fine.status):equals "finished"
          local e, where = p:error(fine)
          local change = 0
          for symbol, value in pairs(p:solution()) do
            local size = math.abs(value) > 1e-14 and math.abs(value) or 1
            change = math.max(change, math.abs(fine:final(symbol) - coarse:final(symbol))/size)
          end
          ran = ran + 1
          if not (e <= change + 10^-(p.digits or 9) and e <= 1e-4) then
            expect(("%s: error %.1e in %s, change from 2 dt to dt %.1e"):format(form, e, tostring(where),
              change)):equals "smaller"
          end
        end
      end
      expect(ran >= 1):is_true()
    end)
  end
end

test("the list", function()
  expect(#problems.list() >= 45):is_true()
  expect(#problems.list "exam"):equals(2)
  expect(function() problems.list "circus" end):fails "Did you mean 'circuit'?"
  expect(function() return problems.pendulm end):fails "Did you mean 'pendulum'?"
  expect(tostring(problems.pendulum)):matches "Planar pendulum"
  expect(problems.pendulum { g = 1 }.parameters.rows):equals(2)
  expect(function() problems.pendulum:error(nil) end):fails ""
  expect(function() problems.pendulum:solution(3) end):fails "known at t = 10 only"
  expect(problems.robertson:solution(4e7)[var "y2"]):near(2.0813357318925326e-10, 1e-24)
  expect(#problems.chain.links(3):constraints()):equals(6)
  expect(problems.diode_ladder.cells(3):dof()):equals(3)
end)
