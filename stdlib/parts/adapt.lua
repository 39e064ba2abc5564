-- Other models as parts: dae and lagrange models with all their variables, linear systems with u and y.
local scopes = use "parts/scope"
local names = use "parts/names"
local place = use "parts/place"
local kinds = use "parts/kinds"
local P = scopes.P

local adapt = {}

-- ── dae, lagrange ──────────────────────────────────────────────────────────────────────────────────────────

local function check_form(model)
  if model.form ~= "" then
    fail(("a model in the form \"%s\" cannot be a part: its conditions on the start would be lost; use "
      .. "the model that it was made from, and reduce the model of parts"):format(model.form))
  end
end

local function items_of(model)
  local items = {}
  for i, equation in ipairs(model.equations) do items[i] = equation end
  items.start, items.guess, items.events = model.start_values, model.start_guesses, model.events
  return items
end

local function part_of_model(model)
  check_form(model)
  return place.new_part({ name = model.name:find "^[%a_][%w_]*$" and model.name or "dae", defaults = {},
    text = "",
    items = items_of(model) }, {})
end

-- { kind, s = q[1] }: an across variable of the connector for every coordinate expression.
local function check_port(name, port)
  local kind = type(port) == "table" and port[1]
  if not kinds.is(kind) then
    fail(("ports: '%s' must be { connector kind, across variable = expression }, as in { flange, s "
      .. "= q[1] }"):format(name))
  end
  local across, through = rawget(kind, "across"), rawget(kind, "through")
  if #across ~= #through then
    fail(("ports: connectors of kind %s do not pair forces and positions"):format(kind.name))
  end
  for _, v in ipairs(across) do
    if port[v.name] == nil then
      fail(("ports: '%s' needs %s = an expression in the coordinates"):format(name, v.name))
    end
  end
  return kind, across
end

-- A lagrange model with connectors: a force at a connector is the generalised force (∂position/∂q)ᵀ f.
function adapt.with_ports(model, ports)
  check_form(model)
  local q, n = model.q, #model.q
  local items = items_of(model)
  local motion = table.remove(items, 1)
  local sorted = {}
  for name in pairs(ports) do sorted[#sorted + 1] = name end
  table.sort(sorted)
  for _, name in ipairs(sorted) do check_port(name, ports[name]) end
  local class = { name = "lagrange", defaults = {}, text = "", items = items }
  function class.ports(scope)
    local force = zeros(n, 1)
    for _, name in ipairs(sorted) do
      local kind, across = check_port(name, ports[name])
      scopes.set(scope, name, kind)
      local pin = scopes.member(scope, name)
      for _, v in ipairs(across) do
        local position = ports[name][v.name]
        place.add_own(scope, pin[v.name] ~ names.translate(scope, position))
        local effort = pin[kinds.partner(kind, v.name)]
        force = force + names.translate(scope, jacobian(position, q)).T*effort
      end
    end
    local own = names.translate(scope, motion)
    place.add_own(scope, own.lhs ~ own.rhs + (n == 1 and force[1] or force))
  end
  return place.new_part(class, {})
end

-- ── linear systems ─────────────────────────────────────────────────────────────────────────────────────────

local function signals(self, declare, name, n)
  if n == 1 then return vec { self[declare](self, name) } end
  local list = {}
  for k = 1, n do list[k] = self[declare](self, name .. k) end
  return vec(list)
end

local function continuous_body(G)
  return function(self)
    local n, inputs, outputs = G.A.rows, G.D.cols, G.D.rows
    local u, x = signals(self, "input", "u", inputs), {}
    for k = 1, n do
      x[k] = self:var("x" .. k)
      self:start(x[k], 0)
    end
    local y = signals(self, "output", "y", outputs)
    if n == 0 then return { y ~ G.D*u } end
    x = vec(x)
    return { y ~ G.C*x + G.D*u, der(x) ~ G.A*x + G.B*u }
  end
end

-- y is held between the samples: y_k = C x_k + D u_k, then x_{k+1} = A x_k + B u_k.
local function discrete_body(G)
  return function(self)
    local n, inputs, outputs = G.A.rows, G.D.cols, G.D.rows
    local u, x, y = signals(self, "input", "u", inputs), {}, {}
    for k = 1, n do x[k] = self:discrete("x" .. k, 0) end
    for k = 1, outputs do
      y[k] = self:discrete(outputs == 1 and "y" or "y" .. k, 0)
      self:gives(y[k])
    end
    local now, change, output, state = G.D*u, nil, {}, nil
    if n > 0 then
      x, state = vec(x), {}
      now, change = G.C*x + now, G.A*x + G.B*u
      for k = 1, n do state[x[k]] = change[k] end
    end
    for k = 1, outputs do output[y[k]] = now[k] end
    use "parts/clocks".run(self, G.Ts, 0, output, state)
  end
end

local function part_of_system(G)
  local H = G:ss()
  return place.new_part({ name = "linear", defaults = {}, text = "", source = "",
    body = H.Ts > 0 and discrete_body(H) or continuous_body(H) }, {})
end

function adapt.part(value)
  local kind = object_type(value)
  if kind == "model" then return part_of_model(value) end
  return part_of_system(value)
end

return adapt
