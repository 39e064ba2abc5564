-- A random network under construction: nodes, parts between them, and an entry for the ledger of each part.
local random = math.random
local M = {}

function M.number() return 0.5 + random(8)/4 end

-- Powers into a part through its ports, by the kind of the connector.
function M.electrical(pin) return pin.v*pin.i end
function M.sliding(flange) return flange.f*der(flange.s) end
function M.turning(flange) return flange.tau*der(flange.phi) end
function M.heat(port) return port.Q end
function M.fluid(port) return port.p*port.q end

local network = {}
network.__index = network

function M.new(nodes)
  local at = {}
  for k = 1, nodes do at[k] = {} end
  return setmetatable({ items = {}, at = at, nodes = nodes, entries = {} }, network)
end

function network:any() return random(self.nodes) end
function network:wire(node, pin) table.insert(self.at[node], pin) end
function network:join(...) self.items[#self.items + 1] = connect(...) end

-- Adds a part and its entry: powers in, what it stores, loses and keeps (functions of the part); check: how
-- far it is from its law at a time, by the solution.
function network:add(name, part, entry)
  self.items[name] = part
  if entry then
    entry.name, entry.W = name, var("W_" .. name)
    local into = 0
    for _, power in ipairs(entry.powers) do into = into + power end
    self.items[#self.items + 1] = der(entry.W) ~ into - (entry.lost or 0)
    self.entries[#self.entries + 1] = entry
  end
  return part
end

function network:model()
  for k = 1, self.nodes do
    if #self.at[k] > 0 then self:join(table.unpack(self.at[k])) end
  end
  return model(self.items)
end

-- The entries that do not balance, as text; `to`: how long; placed: where the nodes are is a start of theirs.
function network:faults(to, options)
  local m = self:model()
  local low = m:dae():index() > 1 and m:reduce() or m:dae()
  local guess = {}
  for k = 1, #low.differential do
    local x = low.differential[k]
    local free = not options.placed or x.name:find "^W_" or x.name:find "_m%."
    local given = options.guess[x.name] and not tostring(x):find "′"
    if free and not given then guess[x] = 0 end
  end
  for k, v in pairs(options.guess) do guess[k] = v end
  local sol = low:integrate{ start = low:init{ guess = guess }, to = to, rtol = 1e-9, atol = 1e-11 }
  local faults = {}
  if sol.status ~= "finished" then return { tostring(sol.status) } end
  for _, entry in ipairs(self.entries) do
    local part = m[entry.name]
    local stored = entry.stored and entry.stored(part) or 0
    local function value(x, t) return type(x) == "number" and x or sol(x, t) end
    local W = sol(m["W_" .. entry.name], to) - sol(m["W_" .. entry.name], 0)
    local gap = W - (value(stored, to) - value(stored, 0))
    local scale = 1 + math.abs(W) + math.abs(value(stored, to))
    if entry.at_least and gap < -1e-6*scale or not entry.at_least and math.abs(gap) > 1e-6*scale then
      faults[#faults + 1] = ("%s (%s): %g is missing"):format(entry.name, tostring(part):match "^[%w_]+", gap)
    end
    for k = 0, 4 do
      local sum = entry.kept and value(entry.kept(part), to*k/4) or 0
      if math.abs(sum) > 1e-8*scale then
        faults[#faults + 1] = ("%s keeps %g at t = %g"):format(entry.name, sum, to*k/4)
      end
      sum = entry.check and entry.check(sol, part, to*k/4 + 1e-3*(2 - k)) or 0
      if math.abs(sum) > 1e-6*scale then
        faults[#faults + 1] = ("%s is %g beside its law at t = %g"):format(entry.name, sum, to*k/4)
      end
      local loss = entry.positive and value(entry.positive(part), to*k/4) or 0
      if loss < -1e-8*scale then
        faults[#faults + 1] = ("%s gives the power %g at t = %g"):format(entry.name, -loss, to*k/4)
      end
    end
  end
  return faults
end

-- Between two nodes with the ports a and b.
function M.link(power)
  return function(net, name, part, entry)
    entry.powers = { power(part.a), power(part.b) }
    net:add(name, part, entry)
    local a = net:any()
    net:wire(a, name .. ".a")
    net:wire(a % net.nodes + 1, name .. ".b")
  end
end

-- From a node to a mass or inertia of its own: two surfaces that stick side by side would share their force
-- in any way.
function M.dry(power, make)
  return function(net, name, part, entry)
    entry.powers = { power(part.a), power(part.b) }
    net:add(name, part, entry)
    net:add(name .. "_m", make())
    net:wire(net:any(), name .. ".a")
    net:join(name .. ".b", name .. "_m.flange")
  end
end

return M
